"""highway-env's environments as the traffic: how the ego gets on along its route, and what fog does at junctions.

Each environment is driven without advice and with 20 and 80 km/h advised, until the ego arrives, collides, or 60 s are
over. ``gain_m`` is the most that the place on the route gained in a step on the way driven, ``back_m`` the most that it
lost, ``slowest_mps`` and ``fastest_mps`` the ego's speeds (none is driven backwards), ``arrived`` and ``collided``
shares of the runs. Fog is clear air unless ``--visibility`` is given: then drivers see no farther.

    python benchmarks/highway_roads.py [--json] [--env intersection-v1 …] [--seeds 5] [--visibility 2000 20 …]
"""

import argparse
import json
import math
import warnings
from typing import Any

import gymnasium

from fogsim.atmosphere import FieldAccess, airlight_from_illuminance
from fogsim.traffic import DriverSight
from fogsim.traffic.highway import HighwayTraffic
from fogsim.units import KMH_PER_MPS, extinction_from_visibility
from fogsim.values import Command, FogField, SpeedAdvice, TrafficSnapshot

ENVIRONMENTS = (
    "highway-v0", "highway-fast-v0", "merge-v1", "merge-generic-v1", "roundabout-v1", "roundabout-generic-v1",
    "intersection-v0", "intersection-v1", "racetrack-v1", "racetrack-large-v1", "racetrack-oval-v1", "exit-v1",
    "two-way-v0", "u-turn-v1", "lane-keeping-v0",
)  # fmt: skip
ADVISED_KMH = (math.inf, 20.0, 80.0)
LONGEST, MARGIN, DAY = 60.0, 5.0, 10_000.0


def run(name: str, seed: int, advised: float, visibility: float) -> dict[str, float]:
    """Figures of one run."""
    made: Any = gymnasium.make(f"highway_env:{name}", config={"neighbour_vehicles_connected_lanes": True})
    traffic = HighwayTraffic(made.unwrapped, DriverSight(DAY))
    if math.isfinite(visibility):
        field = FogField(extinction_from_visibility(visibility), airlight_from_illuminance(DAY))
        traffic.enter_fog(FieldAccess(field))
    traffic.start(seed)
    command = Command(SpeedAdvice(advised / KMH_PER_MPS))
    before = seen(traffic)
    speeds, gains, losses = [speed_of(before)], [0.0], [0.0]
    arrived = collided = False
    for _ in range(round(LONGEST / traffic.step_length)):
        traffic.advance(command)
        after = seen(traffic)
        moved = after.route_position - before.route_position
        speeds.append(speed_of(after))
        gains.append(moved - max(speeds[-2:]) * traffic.step_length)
        losses.append(-moved)
        before = after
        arrived = after.route_position >= after.route_length - MARGIN
        collided = any("ego" in (c.collider, c.victim) for c in after.collisions)
        if arrived or collided:
            break
    traffic.close()
    return {
        "gain_m": max(gains),
        "back_m": max(losses),
        "slowest_mps": min(speeds),
        "fastest_mps": max(speeds),
        "arrived": arrived,
        "collided": collided,
    }


def seen(traffic: HighwayTraffic) -> TrafficSnapshot:
    """The traffic now; the ego never leaves it."""
    snapshot = traffic.observe()
    if snapshot is None:
        raise RuntimeError("the ego is gone")
    return snapshot


def speed_of(snapshot: TrafficSnapshot) -> float:
    """Speed of the ego [m/s]."""
    return float(snapshot.state.speed[snapshot.ego])


def measure(name: str, seeds: int, advised: float, visibility: float) -> dict[str, Any]:
    """One record."""
    runs = [run(name, seed, advised, visibility) for seed in range(1, seeds + 1)]
    worst = {key: max(r[key] for r in runs) for key in ("gain_m", "back_m", "fastest_mps")}
    return {
        "env": name,
        "visibility_m": visibility if math.isfinite(visibility) else None,
        "advised_kmh": advised if math.isfinite(advised) else None,
        "runs": seeds,
        **{key: round(value, 3) for key, value in worst.items()},
        "slowest_mps": round(min(r["slowest_mps"] for r in runs), 3),
        "arrived": round(sum(r["arrived"] for r in runs) / seeds, 2),
        "collided": round(sum(r["collided"] for r in runs) / seeds, 2),
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print a list of flat records")
    parser.add_argument("--env", action="append", choices=ENVIRONMENTS, help="which environment (default: all)")
    parser.add_argument("--seeds", type=int, default=3, help="runs of each")
    parser.add_argument("--visibility", type=float, nargs="+", default=[math.inf], help="V_met in m")
    arguments = parser.parse_args()
    # Gymnasium says so of all versions but the last.
    warnings.filterwarnings("ignore", message=".*is out of date")
    records = []
    for name in arguments.env or ENVIRONMENTS:
        for visibility in arguments.visibility:
            for advised in ADVISED_KMH:
                records.append(measure(name, arguments.seeds, advised, visibility))
                if not arguments.json:
                    print(*(f"{key} {value}" for key, value in records[-1].items()), sep="  ", flush=True)
    if arguments.json:
        print(json.dumps(records, indent=2))


if __name__ == "__main__":
    main()
