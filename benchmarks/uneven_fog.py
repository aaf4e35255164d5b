"""How daytime methods read fog that is not even, and how early a bank ahead is announced.

Drives through every kind of fog that a scenario can have, with traffic: even, banks with edges of 20 … 300 m, patches
of 30 … 300 m (strength 0.6), ground fog, a scale height, fog that thickens, wind, airlight dimmed by the fog overhead.
An estimate is held against the mean extinction along the road from the camera to where 95 % of the light is lost, or
as far as the estimate speaks (`Estimate.reach`). Errors are |V_est − V| / V of valid estimates in %; `coverage` is the
share of 90 % intervals of k that hold the truth, `here` the same for τ(d) at all distances that a method gives.

`announced_m`: way before the point of half density at which denser fog was believed (`Belief.denser`), and stayed so to
150 m before it, where the fog of the widest edge begins; 0 if it was not believed there.
The drives in clear air (V_met 2000 m and more; `--clear` minutes of them) count announcements; each is false. Only
`joint_road` reports denser fog, so that after one drive in each haze on each road it drives without the others.

Constants were chosen on pool 0 (other seeds, visibilities and camera); pool 1 is what is reported.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from harness import Row, lines_of, mean, parse_options, progress, publish

import fogsim
from fogsim.atmosphere.fog.optical_depth import optical_depth_along
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import Estimate, Step
from fogsim.values.estimate import NORMAL_90_PERCENT

BANK_START = 1300.0
KEPT = 150.0
PERIOD = 0.5  # [s] of the camera: neighbouring frames hardly say more
PATCHED = {30.0: 2, 60.0: 2, 100.0: 2, 200.0: 4, 300.0: 6}
"""Drives through patches of each length [m]: a drive of 40 s is but three patches of 300 m long."""

CLOCKS = (f"clocks.camera_period_s={PERIOD}", f"clocks.decision_period_s={PERIOD}")
CAMERAS = (
    ("camera.width=640", "camera.height=480"),
    ("camera.width=800", "camera.height=600", "camera.field_of_view_deg=50", "camera.response=linear"),
)
ANNOUNCING = "joint_road"
"""The method that reports denser fog: announcements are the same without the others."""

METHODS = (ANNOUNCING, "negru2013", "zhu2015", "huang2015_rough", "lead_contrast")
HAZES = (2000.0, 5000.0, "inf")  # V_met of the drives in clear air [m], in turn
CLEAR_ROADS = ("motorway_fog_bank", "graded_motorway", "clear_day", "ramp_merge")


@dataclass(frozen=True, slots=True)
class Drive:
    """A drive: kind of fog, what is changed in the scenario, seed, scenario, and whether only announcements count."""

    kind: str
    settings: tuple[str, ...]
    seed: int
    scenario: str = "motorway_fog_bank"
    announces_only: bool = False


@dataclass(slots=True)
class Found:
    """What was found on drives of one kind."""

    off: list[float] = field(default_factory=list)
    held: list[bool] = field(default_factory=list)
    told: list[bool] = field(default_factory=list)
    frames: int = 0
    announced: list[float] = field(default_factory=list)


def bank(visibility: float, edge: float, outside: float = 2000.0) -> str:
    """A bank as a setting."""
    place = f"start_m: {BANK_START}, end_m: {BANK_START + 900.0}, edge_m: {edge}, visibility_m: {visibility}"
    return f"fog={{outside_visibility_m: {outside}, banks: [{{{place}}}]}}"


def drives(pool: int) -> Iterator[Drive]:
    """All drives of a pool, those in clear air excepted."""
    sight = (150.0, 120.0)[pool]
    seed = 11 + 40 * pool
    common = (*CLOCKS, *CAMERAS[pool], "traffic.events=[]")
    for i, visibility in enumerate(((70.0, 160.0, 350.0), (60.0, 120.0, 300.0))[pool]):
        yield Drive("even", (*common, "duration_s=30", f"fog={{visibility_m: {visibility}}}"), seed + i)
    for i, (length, number) in enumerate(PATCHED.items()):
        for j in range(number):
            patches = f"{{correlation_length_m: {length}, strength: 0.6, seed: {seed + i + 10 * j}}}"
            fog = f"fog={{visibility_m: {sight}, patches: {patches}}}"
            yield Drive(f"patches, {length:.0f} m", (*common, "duration_s=40", fog), seed + i + 10 * j)
    for i, edge in enumerate((20.0, 100.0, 300.0)):
        for j in range(2):
            yield Drive("bank", (*common, "duration_s=70", bank(60.0, edge)), seed + 10 * j + i)
    layer = f"fog={{visibility_m: {sight}, top_m: 5, top_edge_m: 2}}"
    yield Drive("ground fog", (*common, "duration_s=30", layer), seed)
    yield Drive("scale height", (*common, "duration_s=30", f"fog={{visibility_m: {sight}, scale_height_m: 20}}"), seed)
    changes = "changes: [{at_s: 0, density: 0.4}, {at_s: 30, density: 2}]"
    yield Drive("thickening", (*common, "duration_s=40", f"fog={{visibility_m: {sight}, {changes}}}"), seed)
    patches = f"{{correlation_length_m: 80, strength: 0.6, seed: {seed}}}"
    wind = f"fog={{visibility_m: {sight}, patches: {patches}, wind: {{speed_kmh: 30, from_deg: 300}}}}"
    yield Drive("wind", (*common, "duration_s=40", wind), seed)
    shaded = f"fog={{visibility_m: {sight}, patches: {patches}, airlight_shading: 0.1}}"
    yield Drive("dimmed airlight", (*common, "duration_s=40", shaded), seed)


def clear_drives(pool: int, minutes: float) -> Iterator[Drive]:
    """Drives in clear air and thin haze on several roads, until so many minutes are full."""
    share = 60.0 * minutes / len(CLEAR_ROADS)
    for i, scenario in enumerate(CLEAR_ROADS):
        left, number = share, 0
        while left > 1.0 and number < 20:
            duration = min(left, 180.0)
            fog = f"fog={{visibility_m: {HAZES[number % len(HAZES)]}}}"
            settings = (*CLOCKS, *CAMERAS[pool], f"duration_s={duration:.0f}", fog, "expect={}")
            yield Drive("clear", settings, 100 * pool + 10 * i + number, scenario, number >= len(HAZES))
            left, number = left - duration, number + 1


def depths(step: Step, distances: np.ndarray) -> np.ndarray:
    """True optical depths along the road."""
    pose, fog = step.truth.pose, step.truth.fog
    if pose is None or fog is None:
        raise SystemExit("a step without a camera")
    level = math.cos(pose.road_grade)
    heading = (level * math.cos(pose.heading), level * math.sin(pose.heading), math.sin(pose.road_grade))
    return np.asarray(optical_depth_along(fog, np.array(pose.position), np.array(heading), distances))


def true_extinction(step: Step, estimate: Estimate) -> float:
    """Mean extinction as far as an estimate speaks [1/m]."""
    if math.isfinite(estimate.reach):
        depth = float(depths(step, np.array([estimate.reach]))[0])
        if depth < OPTICAL_DEPTH_AT_VISIBILITY:
            return depth / estimate.reach
    return step.truth.extinction_ahead


def judge(step: Step, estimate: Estimate, found: Found) -> None:
    """Hold an estimate against the truth."""
    found.frames += 1
    if not estimate.valid:
        return
    truth = true_extinction(step, estimate)
    if truth <= 0.0:
        return  # clear air has no relative error
    found.off.append(math.log(max(estimate.extinction, 1e-6) / truth))
    found.held.append(abs(estimate.extinction - truth) <= NORMAL_90_PERCENT * estimate.standard_deviation)
    curve = estimate.optical_depths
    if curve is not None:
        rows = zip(curve.depth, depths(step, np.array(curve.distance)), curve.standard_deviation, strict=True)
        # Beyond a depth of 3 nothing of the road is left to be seen.
        found.told += [abs(one - true) <= NORMAL_90_PERCENT * sd for one, true, sd in rows if true <= 3.0]


def run(drive: Drive, methods: list[str], found: dict[tuple[str, str], Found]) -> None:
    """Take a drive, and note what is found on it."""
    named = ", ".join(one for one in methods if one == ANNOUNCING or not drive.announces_only)
    scenario = fogsim.load_scenario(drive.scenario, (*drive.settings, f"estimators=[{named}]"))
    since: float | None = None
    before = 0
    for step in fogsim.run(scenario, drive.seed):
        for estimate in step.estimates:
            judge(step, estimate, found.setdefault((drive.kind, estimate.method), Found()))
        told = step.belief.denser is not None
        belief = found.setdefault((drive.kind, "belief"), Found())
        belief.frames += 1
        left = BANK_START - step.route_position
        if drive.kind == "clear":
            before += told and since is None
            since = step.route_position if told else None
        elif drive.kind == "bank" and left > KEPT:
            since = (left if since is None else since) if told else None
    if drive.kind == "clear":
        belief.announced.append(float(before))
    elif drive.kind == "bank":
        belief.announced.append(since or 0.0)


def records(found: dict[tuple[str, str], Found], pool: int) -> Iterator[Row]:
    """A record for each kind of fog and method."""
    for (kind, method), one in found.items():
        record: Row = {"pool": pool, "fog": kind, "method": method, "frames": one.frames}
        if one.off:
            errors = [100.0 * abs(math.expm1(-off)) for off in one.off]
            record["valid_share"] = len(errors) / one.frames
            record["median_pct"], record["p95_pct"] = (float(np.quantile(errors, q)) for q in (0.5, 0.95))
            record["bias_pct"] = -100.0 * float(np.median(one.off))
            record["coverage"] = mean(one.held)
            if one.told:
                record["here"] = mean(one.told)
        if kind == "bank" and one.announced:
            record["announced_m"] = [round(way) for way in one.announced]
        if kind == "clear" and one.announced:
            hours = one.frames * PERIOD / 3600.0
            record["false_announcements"], record["hours"] = int(sum(one.announced)), hours
        if method != "belief" or one.announced:
            yield record


def table(rows: list[Row]) -> Iterator[str]:
    """Lines of the table of docs/benchmarks/estimators.md."""
    heads = ("fog", "method", "frames", "valid", "median / p95, %", "bias, %", "90 % intervals hold", "τ(d) held")
    body = []
    for row in rows:
        if "median_pct" in row:
            errors = f"{row['median_pct']:.1f} / {row['p95_pct']:.1f}", f"{row['bias_pct']:+.1f}"
            held = f"{row['coverage']:.2f}", f"{row['here']:.2f}" if "here" in row else "–"
            head = row["fog"], row["method"], str(row["frames"]), f"{row['valid_share']:.2f}"
            body.append((*head, *errors, *held))
    yield from lines_of(heads, body)
    for row in rows:
        if "announced_m" in row:
            ways = ", ".join(f"{way}" for way in row["announced_m"])
            yield f"\nBanks of 60 m (edges of 20, 100, 300 m, twice) were announced {ways} m before half density."
        if "false_announcements" in row:
            yield f"\nIn {row['hours']:.2f} h of clear air: {row['false_announcements']} false announcements."


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        docs=("benchmarks/estimators.md", "uneven fog"),
        pool=1,
        methods=(list(METHODS), "names of estimators"),
        clear=(75.0, "minutes of driving in clear air"),
        only=("", "only kinds of fog whose name begins so"),
    )
    plan = [*drives(given.pool), *clear_drives(given.pool, given.clear)]
    found: dict[tuple[str, str], Found] = {}
    for drive in progress([one for one in plan if one.kind.startswith(given.only)], "drives"):
        run(drive, given.methods, found)
    rows = list(records(found, given.pool))
    publish(given, rows, table)


if __name__ == "__main__":
    main()
