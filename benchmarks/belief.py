"""What fusions believe of the fog: ahead as far as one sees, and at places along the way.

Drives through banks (edges of 20, 100 and 300 m), patches, even fog, bends and by night, with traffic, ten pictures in
two seconds. Their estimates are those of the scenario's estimators; each fusion is then given the same ones. For each
kind of drive and fusion:

``ahead``    error of the median visibility, |V_believed − V_true| / V_true, against the mean extinction from the camera
             to where 95 % of the light is lost, and how often the 90 % interval held it, where that visibility is
             below 1 km
``here`` the same of the fog at the vehicle's own place, by fusions that estimate places
``entered``  ``ahead`` in the 5 s after the ego has come 60 m into a bank (median)
``at D m``   error (median) and share held of the visibility at a place D m ahead, too, by fusions that give it

``reported`` gives the field filter what a vehicle 300 m ahead measures (deviation 10 %, every second, a second late).
Constants were chosen on pool 0 (other seeds, banks and cameras); pool 1 is what is reported.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from harness import Row, lines_of, mean, median, parse_options, progress, publish, quantile, timed

import fogsim
from fogsim.fusion import DatedFusion, make
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import Belief, Estimate, FogProfile, FogReport
from fogsim.values.estimate import NORMAL_90_PERCENT

CLOCKS = ("clocks.camera_period_s=0.2", "clocks.decision_period_s=0.4")
CAMERAS = (
    ("camera.width=320", "camera.height=240"),
    ("camera.width=640", "camera.height=480", "camera.field_of_view_deg=50"),
)
FOG = OPTICAL_DEPTH_AT_VISIBILITY / 1000.0
PLACES = (50.0, 100.0, 200.0, 400.0)
LEAD, DELAY, REPORT_DEVIATION = 300.0, 1.0, 0.1
BANK_START, ENTERED, SETTLING = 1300.0, 60.0, 5.0
FUSIONS = ("mixture_filter", "grid_filter", "field_filter", "reported")


@dataclass(frozen=True, slots=True)
class Drive:
    """A drive: its kind, the scenario, what is changed in it, and its seed."""

    kind: str
    scenario: str
    settings: tuple[str, ...]
    seed: int


@dataclass(frozen=True, slots=True)
class Seen:
    """What one instant of a drive had: estimates, and the truth."""

    time: float
    place: float
    estimates: tuple[Estimate, ...]
    ahead: float
    profile: FogProfile


@dataclass(slots=True)
class Found:
    """What a fusion made of drives of one kind."""

    errors: list[float] = field(default_factory=list)
    held: list[bool] = field(default_factory=list)
    here: list[tuple[float, bool]] = field(default_factory=list)
    entered: list[float] = field(default_factory=list)
    places: dict[float, list[tuple[float, bool]]] = field(default_factory=dict)
    spent: list[float] = field(default_factory=list)


def drives(pool: int) -> Iterator[Drive]:
    """All drives of a pool."""
    seed = 3 + 50 * pool
    common = (*CLOCKS, *CAMERAS[pool], "traffic.events=[]")
    for i, edge in enumerate((20.0, 100.0, 300.0)):
        for j, visibility in enumerate(((150.0, 60.0), (60.0, 110.0))[pool]):
            place = f"{{start_m: {BANK_START}, end_m: 2300, edge_m: {edge}, visibility_m: {visibility}}}"
            fog = f"fog={{outside_visibility_m: {(2000, 1200)[j]}, banks: [{place}]}}"
            yield Drive("bank", "motorway_fog_bank", (*common, "duration_s=85", fog), seed + 2 * i + j)
    for i, length in enumerate((100.0, 300.0)):
        patches = f"{{correlation_length_m: {length}, strength: 0.6, seed: {seed + i}}}"
        fog = f"fog={{visibility_m: {(130, 120)[pool]}, patches: {patches}}}"
        yield Drive("patches", "motorway_fog_bank", (*common, "duration_s=50", fog), seed + 10 + i)
    for i, visibility in enumerate(((80.0, 300.0), (60.0, 220.0))[pool]):
        fog = f"fog={{visibility_m: {visibility}}}"
        yield Drive("even", "motorway_fog_bank", (*common, "duration_s=30", fog), seed + 20 + i)
    fog = f"fog={{visibility_m: {(150, 200)[pool]}}}"
    bends = (*CLOCKS, *CAMERAS[pool], "duration_s=60", fog)
    yield Drive("slopes", "graded_motorway", bends, seed + 30)
    yield Drive("night", "night_motorway_fog", (*CLOCKS, *CAMERAS[pool], "duration_s=40"), seed + 31)


def taken(drive: Drive) -> list[Seen]:
    """What was seen on a drive."""
    scenario = fogsim.load_scenario(drive.scenario, drive.settings)
    seen = []
    for step in fogsim.run(scenario, drive.seed):
        profile = step.truth.profile
        if profile is None:
            raise SystemExit(f"{drive.scenario}: no route is known")
        seen.append(Seen(step.time, step.route_position, step.estimates, step.truth.extinction_ahead, profile))
    return seen


def reports(seen: list[Seen], number: int, rng: np.random.Generator) -> list[FogReport]:
    """What a vehicle ahead has measured a second ago, once a second."""
    now = seen[number]
    if number == 0 or math.floor(now.time) == math.floor(seen[number - 1].time):
        return []
    log_extinction, _ = now.profile.at(LEAD)
    told = math.exp(log_extinction + REPORT_DEVIATION * float(rng.standard_normal()))
    return [FogReport("ahead", number, now.place + LEAD, now.time - DELAY, told, REPORT_DEVIATION)]


def judge(seen: Seen, belief: Belief, found: Found) -> None:
    """Hold a belief against the truth."""
    if seen.ahead > FOG:
        true = OPTICAL_DEPTH_AT_VISIBILITY / seen.ahead
        low, middle, high = belief.visibility_quantiles((0.05, 0.5, 0.95))
        found.errors.append(100.0 * abs(middle / true - 1.0))
        found.held.append(low <= true <= high)
    if belief.profile is None:
        return
    for place in (0.0, *PLACES):
        true, _ = seen.profile.at(place)
        if true > math.log(FOG):
            value, deviation = belief.profile.at(place)
            told = found.places.setdefault(place, []) if place > 0.0 else found.here
            error = 100.0 * abs(math.expm1(true - value))
            told.append((error, abs(value - true) <= NORMAL_90_PERCENT * deviation))


def follow(name: str, seen: list[Seen], found: Found, seed: int) -> None:
    """Let a fusion take in a drive."""
    rng = np.random.default_rng(seed)
    fusion = DatedFusion(make("field_filter" if name == "reported" else name))
    inside: float | None = None
    for number, one in enumerate(seen):
        heard = reports(seen, number, rng) if name == "reported" else ()
        belief, spent = timed(partial(fusion.update_at, one.estimates, one.time, one.place, heard))
        found.spent.append(spent)
        judge(one, belief, found)
        if one.place >= BANK_START + ENTERED and one.ahead > FOG:
            inside = one.time if inside is None else inside
            if one.time - inside <= SETTLING and found.errors:
                found.entered.append(found.errors[-1])


def together(found: dict[tuple[str, str], Found]) -> dict[tuple[str, str], Found]:
    """What was found, and for each fusion that of all kinds of drives together."""
    out = dict(found)
    for name in FUSIONS:
        every = out["all", name] = Found()
        for one in (one for (_, fusion), one in found.items() if fusion == name):
            for part in ("errors", "held", "here", "entered", "spent"):
                getattr(every, part).extend(getattr(one, part))
            for place, told in one.places.items():
                every.places.setdefault(place, []).extend(told)
    return out


def records(found: dict[tuple[str, str], Found], pool: int) -> Iterator[Row]:
    """A record for each kind of drive and fusion."""
    for (kind, name), one in together(found).items():
        row: Row = {"pool": pool, "drive": kind, "fusion": name, "steps": len(one.spent)}
        row |= {"median_pct": median(one.errors), "p95_pct": quantile(one.errors, 0.95)}
        row |= {"coverage": mean(one.held), "ms": median(one.spent)}
        if one.here:
            errors, held = zip(*one.here, strict=True)
            row |= {"here_pct": median(errors), "here_p95_pct": quantile(errors, 0.95), "here_coverage": mean(held)}
        if kind == "bank":
            row["entered_pct"] = median(one.entered)
        for place, told in sorted(one.places.items()):
            errors, held = zip(*told, strict=True)
            row |= {f"at_{place:.0f}_pct": median(errors), f"at_{place:.0f}_coverage": mean(held)}
        yield row


def table(rows: list[Row]) -> list[str]:
    """Lines of the table."""
    told = "median / p95 % (held)"
    heads = ("drive", "fusion", f"ahead, {told}", f"here, {told}", "entered, %", *(f"at {p:.0f} m" for p in PLACES))
    return lines_of(heads, map(_cells, rows))


def _cells(row: Row) -> list[str]:
    ahead = f"{row['median_pct']:.1f} / {row['p95_pct']:.0f} ({row['coverage']:.2f})"
    told = "here_pct" in row
    here = f"{row['here_pct']:.1f} / {row['here_p95_pct']:.0f} ({row['here_coverage']:.2f})" if told else ""
    places = [f"at_{place:.0f}" for place in PLACES]
    there = (f"{row[f'{at}_pct']:.0f} ({row[f'{at}_coverage']:.2f})" if f"{at}_pct" in row else "" for at in places)
    entered = f"{row['entered_pct']:.0f}" if "entered_pct" in row else ""
    return [row["drive"], row["fusion"], ahead, here, entered, *there]


def main() -> None:
    """Measure and print."""
    given = parse_options(__doc__, docs=("explanation/belief.md", "belief"), pool=1)
    found: dict[tuple[str, str], Found] = {}
    for drive in progress(list(drives(given.pool)), "drives"):
        seen = taken(drive)
        for name in FUSIONS:
            follow(name, seen, found.setdefault((drive.kind, name), Found()), drive.seed)
    rows = list(records(found, given.pool))
    publish(given, rows, table)


if __name__ == "__main__":
    main()
