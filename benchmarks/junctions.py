"""Gaps that drivers accept at an unsignalised crossing in fog, and what comes of it.

A road with priority (700 vehicles an hour in one direction, Poisson arrivals, 50 km/h) is crossed by another one (200
an hour); by day, step 0.1 s. Drivers are SUMO's own, whom fog does not concern, or FogSim's with a choice of speed. A
gap is the time between two vehicles of the first road at the crossing; it is accepted by who drives onto the crossing
in it, and refused by who has come within 10 m of the crossing before it begins and enters after its end.

Of all seeds together: accepted gaps at the quantiles 0 (smallest), 15 % and 50 % [s], the largest refused one [s], the
share of gaps below 5 s that are accepted, collisions in 1000 crossings with the mean of their impact speeds [m/s], and
vehicles of the first road that brake harder than 4.5 m/s², in 1000 crossings.
"""

import argparse
import itertools
import math
import statistics
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from harness import ROOT, Row, lines_of, parse_options, progress, publish

from fogsim.atmosphere import FieldAccess
from fogsim.traffic import SPEED_CHOICES, AfterCollision, DriverSetup, DriverSight, TrafficSetup, libsumo_traffic
from fogsim.traffic.sumo.libsumo_link import load_libsumo
from fogsim.traffic.sumo.link import Api
from fogsim.units import extinction_from_visibility
from fogsim.values import Command, FogField

NET = ROOT / "tests" / "data" / "crossing" / "priority.net.xml"
STEP = 0.1
MAJOR_FLOW, MINOR_FLOW = 700.0, 200.0
"""Vehicles an hour."""
MAJOR_WAY, MINOR_WAY = ":C_10", ":C_7"
"""Where the two roads cross, straight on."""
WAITING_PLACE = 10.0
"""Who is nearer to the crossing than this has come to it [m]."""
SUMO = "sumo"
"""The drivers of SUMO, who see through fog."""
HARD = 4.5
"""SUMO's comfortable deceleration of a passenger car [m/s²]."""
SHORT_GAP = 5.0


@dataclass
class Crossings:
    """Gaps accepted and refused [s], impact speeds [m/s], vehicles that have crossed and that have braked hard."""

    accepted: list[float] = field(default_factory=list)
    refused: list[float] = field(default_factory=list)
    impacts: list[float] = field(default_factory=list)
    crossings: int = 0
    hard: int = 0

    def record(self) -> Row:
        """The figures."""
        smallest, low, middle = (quantile(self.accepted, q) for q in (0.0, 0.15, 0.5))
        short = [sum(gap < SHORT_GAP for gap in gaps) for gaps in (self.accepted, self.refused)]
        return {
            "crossings": self.crossings,
            "accepted_least_s": smallest,
            "accepted_15_s": low,
            "accepted_50_s": middle,
            "refused_most_s": quantile(self.refused, 1.0),
            "short_accepted": round(short[0] / max(sum(short), 1), 2),
            "collisions_per_1000": round(1000.0 * len(self.impacts) / max(self.crossings, 1), 1),
            "impact_mps": round(statistics.mean(self.impacts), 1) if self.impacts else None,
            "hard_braking_per_1000": round(1000.0 * self.hard / max(self.crossings, 1), 1),
        }


def quantile(values: Sequence[float], share: float) -> float | None:
    """A value that so large a share of others do not exceed [s]; None of none."""
    ordered = sorted(values)
    return round(ordered[min(int(share * len(ordered)), len(ordered) - 1)], 1) if ordered else None


def departures(flow: float, duration: float, rng: np.random.Generator) -> Iterator[float]:
    """Times of Poisson arrivals, at least 1.5 s apart [s]."""
    time = 0.0
    while (time := time + 1.5 + float(rng.exponential(3600.0 / flow - 1.5))) < duration:
        yield time


def routes(folder: Path, duration: float, seed: int) -> Path:
    """The vehicles of one run."""
    rng = np.random.default_rng(seed)
    rows = [(time, "major", "WC CE") for time in departures(MAJOR_FLOW, duration, rng)]
    rows += [(time, "minor", "SC CN") for time in departures(MINOR_FLOW, duration, rng)]
    vehicles = "".join(
        f'<vehicle id="{kind}{n}" type="car" depart="{time:.1f}" departSpeed="max"><route edges="{edges}"/></vehicle>'
        for n, (time, kind, edges) in enumerate(sorted(rows))
    )
    path = folder / "crossing.rou.xml"
    # The ego, which a simulation must have, stands out of the way.
    path.write_text(
        '<routes><vType id="car" speedFactor="normc(1,0.1,0.8,1.2)"/>'
        '<vehicle id="ego" type="car" depart="0"><route edges="CS"/><stop lane="CS_0" endPos="250" duration="1e6"/>'
        f"</vehicle>{vehicles}</routes>",
        encoding="utf-8",
    )
    return path


def run(visibility: float, setup: TrafficSetup, duration: float, seed: int, seen: Crossings) -> None:
    """Drive one seed."""
    traffic = libsumo_traffic(setup)
    k = extinction_from_visibility(visibility)
    traffic.enter_fog(FieldAccess(FogField(k, (3000.0, 3000.0, 3000.0))))
    traffic.start(seed)
    major: dict[str, float] = {}
    minor: dict[str, float] = {}
    waiting: dict[str, float] = {}
    hard: set[str] = set()
    api = load_libsumo()
    try:
        for step in range(round(duration / STEP)):
            traffic.advance(Command())
            time = step * STEP
            enter(api, MAJOR_WAY, time, major)
            enter(api, MINOR_WAY, time, minor)
            near = api.lane.getLength("SC_0") - WAITING_PLACE
            for vehicle in api.lane.getLastStepVehicleIDs("SC_0"):
                if api.vehicle.getLanePosition(vehicle) > near:
                    waiting.setdefault(vehicle, time)
            hard.update(
                v for v in api.lane.getLastStepVehicleIDs("WC_0") if api.vehicle.getAcceleration(v) < -HARD - 0.1
            )
            snapshot = traffic.observe()
            seen.impacts += [hit.impact_speed for hit in snapshot.collisions] if snapshot else []
    finally:
        traffic.close()
    count(sorted(major.values()), minor, waiting, seen)
    seen.hard += len(hard)


def enter(api: Api, way: str, time: float, entered: dict[str, float]) -> None:
    """Note who has come onto the crossing."""
    for vehicle in api.edge.getLastStepVehicleIDs(way):
        entered.setdefault(vehicle, time)


def count(major: Sequence[float], minor: dict[str, float], waiting: dict[str, float], seen: Crossings) -> None:
    """Sort gaps into those that were accepted and those that were refused."""
    seen.crossings += len(minor)
    for before, after in itertools.pairwise(major):
        gap = after - before
        if any(before <= time < after for time in minor.values()):
            seen.accepted.append(gap)
        elif any(came <= before and minor.get(vehicle, math.inf) >= after for vehicle, came in waiting.items()):
            seen.refused.append(gap)


def measure(drivers: str, visibility: float, arguments: argparse.Namespace) -> Row:
    """One record."""
    seen, duration, is_sumo = Crossings(), 60.0 * arguments.minutes, drivers == SUMO
    for seed in range(1, arguments.seeds + 1):
        with tempfile.TemporaryDirectory() as name:
            setup = TrafficSetup(
                net=NET,
                routes=(routes(Path(name), duration, seed),),
                additional=(),
                ego="ego",
                step_length=STEP,
                keep_lane=(),
                warm_up_limit=10.0,
                advice_deceleration=2.0,
                reading_radius=10.0,
                sight=None if is_sumo else DriverSight(illuminance=10_000.0),
                drivers=DriverSetup(SPEED_CHOICES["unaffected" if is_sumo else drivers]()),
                after_collision=AfterCollision.REMOVE,
            )
            run(visibility, setup, duration, seed, seen)
    return {"drivers": drivers, "visibility_m": "inf" if math.isinf(visibility) else visibility, **seen.record()}


COLUMNS = {
    "crossings": ("crossings", "{}"),
    "accepted_least_s": ("accepted gaps: smallest", "{} s"),
    "accepted_15_s": ("15 %", "{} s"),
    "accepted_50_s": ("50 %", "{} s"),
    "refused_most_s": ("largest refused", "{} s"),
    "short_accepted": ("of gaps < 5 s accepted", "{:.0%}"),
    "collisions_per_1000": ("collisions in 1000", "{:.0f}"),
    "impact_mps": ("mean impact", "{} m/s"),
    "hard_braking_per_1000": ("braking > 4.5 m/s² in 1000", "{:.0f}"),
}
"""Headings of the docs' table and forms of its figures, by the record's keys."""


def table(records: Sequence[Row]) -> list[str]:
    """A line for each kind of drivers and visibility."""
    lines = []
    for row in records:
        who = "SUMO's own" if row["drivers"] == SUMO else f"`{row['drivers']}`"
        where = (
            "any" if row["drivers"] == SUMO else "∞" if row["visibility_m"] == "inf" else f"{row['visibility_m']:g} m"
        )
        figures = ["–" if row[key] is None else form.format(row[key]) for key, (_, form) in COLUMNS.items()]
        lines.append((who, where, *figures))
    return lines_of(("drivers", "V_met", *(heading for heading, _ in COLUMNS.values())), lines)


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        docs=("explanation/drivers.md", "junctions"),
        visibility=([math.inf, 60.0, 20.0], "V_met [m]"),
        seeds=(5, "seeds 1, 2, …"),
        minutes=(30.0, "simulated time of each seed"),
        drivers=(
            [SUMO, "unaffected", "observed"],
            "SUMO's own, or how drivers choose their speed",
            (SUMO, *SPEED_CHOICES),
        ),
    )
    cases = [
        (drivers, visibility)
        for drivers in given.drivers
        for visibility in (given.visibility[:1] if drivers == SUMO else given.visibility)
    ]
    publish(given, [measure(*case, given) for case in progress(cases, "cases")], table)


if __name__ == "__main__":
    main()
