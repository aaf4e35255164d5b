"""What fog and advice do to safety: collisions of the motorway's traffic around its standing lead vehicle.

Traffic alone, without a camera: for each visibility, protocol, policy and seed, the motorway in homogeneous fog, where
the lead stands in the middle lane for 90 s. Policies: ``none`` (drivers are left alone, with the speed choice given),
``oracle`` (every driver is advised the speed from which one can stop within the true visibility, hears it in the car or
as they enter, and complies without delay). Protocols:

- ``from_the_beginning``: the ego and the lead ahead of it are the first vehicles, so that advice is in force while the
  road fills behind them and the other way; after 120 s the lead stops, after 240 s the run ends.
- ``full_road``: the scenario's own demand. The road has filled for 180 s when the ego comes and advice begins, for all
  on it and for all who enter; after 160 s the run ends.

Collisions of the whole run count. Intervals are 95 % bootstrap intervals of the mean over seeds.
"""

import itertools
import math
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from harness import ROOT, Row, lines_of, mean, parse_options, progress, publish

import fogsim
from fogsim.atmosphere import FieldAccess
from fogsim.scenario import Scenario, build
from fogsim.traffic import BrakeEvent, TrafficSetup, Trigger, libsumo_traffic
from fogsim.traffic.drivers.speed_choice import within_sight
from fogsim.values import Collision, Command, SpeedAdvice

FILLING, STANDING = 120, 90
"""Time before the lead stops where it comes first, and time for which it stands [s]."""

SECONDS = {"from_the_beginning": 240, "full_road": 160}
"""Time of a run by protocol [s]."""

DEMAND = ROOT / "scenarios" / "motorway_fog_bank" / "motorway.rou.xml"


def early_ego(folder: Path) -> Path:
    """The motorway's demand with the lead and the ego departing first, so that advice holds while the road fills."""
    demand = DEMAND.read_text(encoding="utf-8")
    for name, written, wanted in (("lead", "177", "0"), ("ego", "180", "3")):
        line = next(row for row in demand.splitlines() if f'<vehicle id="{name}"' in row)
        demand = demand.replace(line, line.replace(f'depart="{written}"', f'depart="{wanted}"'))
    path = folder / "early.rou.xml"
    path.write_text(demand, encoding="utf-8")
    return path


def motorway(visibility: float, protocol: str, speed_choice: str, folder: Path) -> tuple[Scenario, TrafficSetup]:
    """The scenario, and the traffic with the lead's stop."""
    early = protocol == "from_the_beginning"
    settings = [
        f"fog.visibility_m={visibility}",
        f"drivers.speed_choice={speed_choice}",
        "drivers.compliance.delay_s=0",
        f"traffic.events.0.hold_s={STANDING}",
        *([f"traffic.routes=[{early_ego(folder)}]"] if early else []),
    ]
    scenario = fogsim.load_scenario("motorway_fog_bank", settings)
    setup = build.traffic_setup(scenario)
    stop = BrakeEvent("lead", Trigger(at_time=FILLING), deceleration=6.0, hold=STANDING)
    return scenario, replace(setup, events=(stop,)) if early else setup


def one_run(visibility: float, protocol: str, oracle: bool, speed_choice: str, seed: int) -> list[Collision]:
    """Collisions of one run."""
    with tempfile.TemporaryDirectory() as folder:
        scenario, setup = motorway(visibility, protocol, speed_choice, Path(folder))
        traffic = libsumo_traffic(setup)
        # Homogeneous fog lies everywhere: the route that banks are laid along does not matter.
        traffic.enter_fog(FieldAccess(build.world_config(scenario).fog.along(np.zeros((2, 3)))))
        advice = SpeedAdvice(within_sight(visibility))
        command = Command(advice, advice_reach=math.inf) if oracle else Command()
        collisions: list[Collision] = []
        try:
            traffic.start(seed)
            for _ in range(round(SECONDS[protocol] / setup.step_length)):
                snapshot = traffic.observe()
                if snapshot is None:
                    break
                collisions += snapshot.collisions
                traffic.advance(command)
        finally:
            traffic.close()
        return collisions


def measure(protocol: str, speed_choice: str, visibility: float, oracle: bool, seeds: int) -> Row:
    """One record over all seeds."""
    runs = [one_run(visibility, protocol, oracle, speed_choice, seed) for seed in range(seeds)]
    counts = np.array([len(run) for run in runs])
    rng = np.random.default_rng(0)
    means = rng.choice(counts, (10_000, seeds)).mean(axis=1)
    impacts = [c.impact_speed for run in runs for c in run]
    return {
        "visibility": visibility,
        "protocol": protocol,
        "policy": "oracle" if oracle else "none",
        "speed_choice": speed_choice,
        "seeds": seeds,
        "collisions_mean": round(float(counts.mean()), 3),
        "collisions_low": round(float(np.percentile(means, 2.5)), 3),
        "collisions_high": round(float(np.percentile(means, 97.5)), 3),
        "runs_with_collision": int((counts > 0).sum()),
        "impact_speed_mean": mean(impacts, 2),
    }


def table(records: Sequence[Row]) -> list[str]:
    """A line for each visibility, choice of speed and protocol, without and with advice."""
    headings = ("advice begins", "drivers", "V_met", "left alone", "mean impact", "advised")
    lines = []
    for alone, advised in zip(records[::2], records[1::2], strict=True):
        impact = alone["impact_speed_mean"]
        begins = "with the run" if alone["protocol"] == "from_the_beginning" else "on a full road"
        choice = f"`{alone['speed_choice']}`"
        impact = "–" if impact is None else f"{impact:.1f} m/s"
        lines.append((begins, choice, f"{alone['visibility']:g} m", counts(alone), impact, counts(advised)))
    return lines_of(headings, lines)


def counts(record: Row) -> str:
    """Collisions of a run with their interval, and in how many runs there was one."""
    if not record["runs_with_collision"]:
        return "0, no run"
    low, middle, high = (record[f"collisions_{name}"] for name in ("low", "mean", "high"))
    return f"{middle:.1f} ({low:.1f} … {high:.1f}), {record['runs_with_collision']} of {record['seeds']} runs"


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        docs=("explanation/drivers.md", "collisions"),
        seeds=(8, "seeds for each visibility and policy"),
        visibility=([20.0, 40.0, 60.0], "visibilities [m]"),
        protocol=(list(SECONDS), "when advice begins", SECONDS),
        speed_choice=(["observed", "unaffected"], "how fast drivers drive in fog by themselves"),
    )
    cases = list(itertools.product(given.protocol, given.speed_choice, given.visibility, (False, True)))
    publish(given, [measure(*case, given.seeds) for case in progress(cases, "cases")], table)


if __name__ == "__main__":
    main()
