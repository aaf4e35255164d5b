"""Lamps that follow the belief by night, against an oracle's: the same policy, drive and seed, informed by the truth.

`informed` is the share of decisions whose belief says enough to act on, `differs` the share of time in which the lamps
are not the oracle's, `high beams` that of the oracle's time with high beams in which the belief lights them too, and
`uninformed` how many decisions light high beams or fog lamps on a belief that says too little (never, if all is well).
The first two seconds of a run, in which nothing has been seen yet, count. The ego drives at a fixed speed, so that both
runs of a pair meet the same traffic.

    python benchmarks/night_lamps.py [--json] [--docs] [--seeds 3] [--policy gallen2014]
"""

import argparse
import json
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

from docs_table import write_table

import fogsim
from fogsim.lighting import LIGHTING_POLICIES
from fogsim.values import Lamp, Step

SPEED = 15.0  # [m/s]
CASES = {
    "clear_night": ("20 km",),
    "rural_night_fog": ("70 m", "200 m", "2000 m"),
    "rural_night_alone": ("80 m",),
    "rural_night_oncoming": ("120 m",),
    "tail_lamp_failure": ("100 m",),
    "night_motorway_fog": ("150 m, bank of 100 m",),
    "street_lit_town": ("100 m",),
}
OPTIONAL_LAMPS = Lamp.HIGH_BEAM | Lamp.FRONT_FOG | Lamp.REAR_FOG


def settings(scenario: str, visibility: str) -> Iterator[str]:
    """Overrides of a scenario: its fog, a fixed speed, and nothing that the lamps do not need."""
    yield from ("expect={}", "vary={}", "end_on_collision=false")
    yield f"advice={{method: fixed_speed, parameters: {{speed: {SPEED}}}}}"
    if scenario == "rural_night_fog":
        yield from (f"fog.visibility_m={visibility.removesuffix(' m')}", "timeline=[]", "duration_s=30")
    if scenario in ("clear_night", "night_motorway_fog"):
        yield "duration_s=60"


def drive(scenario: str, visibility: str, policy: str, informed_by: str, seed: int) -> list[Step]:
    """Steps of one run."""
    lighting = f"lighting={{method: {policy}, informed_by: {informed_by}}}"
    loaded = fogsim.load_scenario(scenario, [*settings(scenario, visibility), lighting])
    return list(fogsim.run(loaded, seed=seed))


def record(scenario: str, visibility: str, policy: str, seeds: int) -> dict[str, Any]:
    """What was found in the pairs of runs of a case."""
    count = differ = informed = both = oracles = uninformed = 0
    for seed in range(seeds):
        runs = [drive(scenario, visibility, policy, informed_by, seed) for informed_by in ("belief", "truth")]
        for ours, true in zip(*runs, strict=False):
            count += 1
            differ += ours.command.lamps != true.command.lamps
            oracles += Lamp.HIGH_BEAM in true.command.lamps
            both += Lamp.HIGH_BEAM in ours.command.lamps and Lamp.HIGH_BEAM in true.command.lamps
        for before, after in pairwise(runs[0]):
            informed += before.belief.is_informed()
            decided = after.command is not before.command
            uninformed += decided and not before.belief.is_informed() and bool(after.command.lamps & OPTIONAL_LAMPS)
    return {
        "scenario": scenario,
        "visibility": visibility,
        "policy": policy,
        "frames": count,
        "informed_pct": 100.0 * informed / max(count - seeds, 1),
        "differs_pct": 100.0 * differ / max(count, 1),
        "high_beams_pct": 100.0 * both / oracles if oracles else None,
        "uninformed_lit": uninformed,
    }


def docs_table(found: list[dict[str, Any]]) -> list[str]:
    """Lines of the table of docs/explanation/night.md."""
    heads = ["scenario", "V_met", "frames", "informed [%]", "differs [%]", "high beams [%]", "uninformed"]
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for one in found:
        high = "–" if one["high_beams_pct"] is None else f"{one['high_beams_pct']:.0f}"
        lines.append(
            f"| {one['scenario']} | {one['visibility']} | {one['frames']} | {one['informed_pct']:.0f} "
            f"| {one['differs_pct']:.1f} | {high} | {one['uninformed_lit']} |"
        )
    frames = sum(one["frames"] for one in found)
    differ = sum(one["differs_pct"] * one["frames"] for one in found) / frames
    return [*lines, f"| all | | {frames} | | {differ:.1f} | | {sum(one['uninformed_lit'] for one in found)} |"]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print a list of flat records")
    parser.add_argument("--docs", action="store_true", help="write the table of docs/explanation/night.md")
    parser.add_argument("--seeds", type=int, default=3, help="pairs of runs of each case")
    parser.add_argument("--policy", choices=sorted(LIGHTING_POLICIES), default="gallen2014")
    arguments = parser.parse_args()
    found = [
        record(scenario, visibility, arguments.policy, arguments.seeds)
        for scenario, visibilities in CASES.items()
        for visibility in visibilities
    ]
    if arguments.docs:
        write_table("explanation/night.md", "night lamps", docs_table(found))
    print(json.dumps(found, indent=2) if arguments.json else "\n".join(docs_table(found)))


if __name__ == "__main__":
    main()
