"""What it costs that drivers do not see through what stands next to the road, with some hundred vehicles.

A winding road of 4 km in air of 5 km, by day, without anything next to it and with walls (60 m each). Rows: vehicles
on the road, the drivers' perception and the whole step of 0.1 s (perception, SUMO, reading) [ms], and what walls add to
perception, over the step without a camera and over one with a frame of 320 × 240 pixels each 0.1 s.

    python benchmarks/obstructions.py [--json] [--walls 20] [--seconds 20] [--flow 1500]
"""

import argparse
import json
import statistics
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import fogsim
from fogsim.traffic.sumo_drivers.drivers_perception import DriversPerception
from fogsim.values import Lamp

ROAD = """name: winding
duration: 600 s
clocks: {{camera_period: 0.1 s, decision_period: 0.5 s}}
renderer: {renderer}
camera: {{width: 320, height: 240}}
road: {{template: rural, length: 4 km, obstructions: [{walls}]}}
demand: {{same_way: {flow} veh/h, oncoming: {flow} veh/h}}
actors: {{ego: {{position: 500 m, speed: 60 km/h}}}}
fog: {{visibility: 5 km}}
sut: {{estimators: [{estimators}], advice: none}}
traffic: {{reading_radius: 2500 m}}
"""

_spent = 0.0


def timed_perception() -> None:
    """Have all time that perception takes added up."""
    update = DriversPerception.update

    def timed(self: DriversPerception, ego: str | None, ego_lamps: Lamp, dark: frozenset[str]) -> None:
        global _spent  # noqa: PLW0603 - one clock for the one thing that is measured
        begun = time.perf_counter()
        update(self, ego, ego_lamps, dark)
        _spent += time.perf_counter() - begun

    DriversPerception.update = timed  # type: ignore[method-assign]


def measure(walls: int, flow: float, renderer: str, steps: int) -> tuple[list[float], list[float], int]:
    """Times of perception and of whole steps [s], and vehicles on the road at the end."""
    spacing = 3600.0 / max(walls, 1)
    places = [(100.0 + spacing * n, ("left", "right")[n % 2]) for n in range(walls)]
    written = ", ".join(
        f"{{kind: wall, at: {at:.0f} m, length: 60 m, side: {side}, distance: 1 m}}" for at, side in places
    )
    estimators = "" if renderer == "none" else "joint_road"
    perception, whole = list[float](), list[float]()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "scenario.yaml")
        text = ROAD.format(renderer=renderer, walls=written, flow=f"{flow:g}", estimators=estimators)
        file.write_text(text, encoding="utf-8")
        with fogsim.ClosedLoop(fogsim.load_scenario(file)) as loop:
            step = loop.start(1)
            for number in range(steps + 20):
                spent, begun = _spent, time.perf_counter()
                step = loop.advance(step.command)
                if number >= 20:
                    whole.append(time.perf_counter() - begun)
                    perception.append(_spent - spent)
            return perception, whole, len(step.traffic.ids)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--walls", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--flow", type=float, default=1500.0)
    given = parser.parse_args(arguments)
    timed_perception()
    steps = round(10.0 * given.seconds)
    found: dict[str, dict[str, float]] = {}
    for name, renderer, walls in (
        ("no walls", "none", 0),
        ("walls", "none", given.walls),
        ("walls, frames", "cpu", given.walls),
    ):
        perception, whole, vehicles = measure(walls, given.flow, renderer, steps)
        found[name] = {
            "vehicles": vehicles,
            "perception_ms": 1e3 * statistics.fmean(perception),
            "step_ms": 1e3 * statistics.fmean(whole),
        }
    added = found["walls"]["perception_ms"] - found["no walls"]["perception_ms"]
    for name in ("walls", "walls, frames"):
        found[name]["added_share"] = added / found[name]["step_ms"]
    if given.json:
        print(json.dumps(found, indent=2))
        return
    for name, numbers in found.items():
        print(f"{name}: " + ", ".join(f"{key} {value:.3g}" for key, value in numbers.items()))


if __name__ == "__main__":
    main()
