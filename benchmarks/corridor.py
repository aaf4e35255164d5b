"""What simple policies are worth on fogsim/FogCorridor-v1.

Mean return with its 95 % interval and its terms over the same episodes of the split "test" for each policy, and what
was gained over dark signs in the same episodes, too; half an hour for 30 episodes.

    python benchmarks/corridor.py [--episodes 6] [--json] [--policy rule …]
"""

import argparse
import json
from collections.abc import Callable
from typing import Any

import numpy as np

from fogsim.units import KMH_PER_MPS
from fogsim_envs import Evaluation, evaluate
from fogsim_envs.corridor import parallel_env
from fogsim_envs.corridor.baselines import SIGN_BASELINES, level_of


def always(kmh: float) -> Callable[[Any, Any], int]:
    """A policy that shows one speed."""
    return lambda _observation, _info: level_of(kmh / KMH_PER_MPS)


POLICIES: dict[str, Any] = {
    **{name: name for name in SIGN_BASELINES},
    "40 km/h": always(40.0),
    "80 km/h": always(80.0),
}


def record(name: str, found: Evaluation, dark: Evaluation) -> dict[str, Any]:
    """Figures of a policy."""
    gain, gain_low, gain_high = found.minus(dark)
    terms = {term: float(np.mean([one.terms[term] for one in found.episodes])) for term in found.episodes[0].terms}
    figures = {
        "return": found.mean,
        "low": found.low,
        "high": found.high,
        "gain": gain,
        "gain_low": gain_low,
        "gain_high": gain_high,
        "collided": found.struck,
        **terms,
    }
    return {"policy": name, "episodes": len(found.episodes), **{key: round(one, 2) for key, one in figures.items()}}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=6)
    parser.add_argument("--policy", action="append", choices=POLICIES, help="which policy (default: all)")
    parser.add_argument("--json", action="store_true", help="print a list of flat records")
    asked = parser.parse_args()
    env = parallel_env(split="test")
    seeds = range(asked.episodes)
    dark = evaluate("none", env, seeds)
    records = []
    for name in asked.policy or POLICIES:
        found = dark if name == "none" else evaluate(POLICIES[name], env, seeds)
        records.append(record(name, found, dark))
        if not asked.json:
            print(*(f"{key} {value}" for key, value in records[-1].items()), sep="  ", flush=True)
    env.close()
    if asked.json:
        print(json.dumps(records, indent=2))


if __name__ == "__main__":
    main()
