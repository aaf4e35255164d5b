"""What simple policies are worth on fogsim/FogCorridor-v1: ``python benchmarks/corridor.py --episodes 6 [--json F]``.

Mean return and its terms over the same episodes of the split "test" for each policy, and the mean difference from dark
signs with its standard error; half an hour for 30 episodes.
"""

import argparse
import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fogsim_envs.corridor import FogCorridorEnv, parallel_env
from fogsim_envs.corridor.observation import SHOWN_SPEEDS

NONE = len(SHOWN_SPEEDS) - 1
_CHANCE = np.random.default_rng(0)


def rule_level(info: Mapping[str, Any]) -> int:
    """Level of what the scenario's adviser would show: the highest that is not above it."""
    advised = info["built_in_advice_mps"]
    below = [level for level, speed in enumerate(SHOWN_SPEEDS[:NONE]) if speed <= advised + 1e-6]
    return NONE if math.isinf(advised) else max(below, default=0)


POLICIES: Mapping[str, Callable[[Mapping[str, Any]], int]] = {
    "none": lambda _: NONE,
    "rule": rule_level,
    "60 km/h": lambda _: 1,
    "80 km/h": lambda _: 2,
    "40 km/h": lambda _: 0,
    "random": lambda _: int(_CHANCE.integers(len(SHOWN_SPEEDS))),
}


def episode_terms(env: FogCorridorEnv, level: Callable[[Mapping[str, Any]], int], seed: int) -> dict[str, float]:
    """Sums of the reward's terms over an episode."""
    _, infos = env.reset(seed=seed)
    sums: dict[str, float] = {}
    while env.agents:
        _, _, _, _, infos = env.step({agent: level(infos[agent]) for agent in env.agents})
        for name, value in infos[env.possible_agents[0]]["reward_terms"].items():
            sums[name] = sums.get(name, 0.0) + value
    return sums


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--episodes", type=int, default=6)
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    env = parallel_env(split="test")
    found: dict[str, Any] = {}
    dark = np.zeros(given.episodes)
    for name, level in POLICIES.items():
        episodes = [episode_terms(env, level, seed) for seed in range(given.episodes)]
        returns = np.array([sum(terms.values()) for terms in episodes])
        dark = returns if name == "none" else dark
        gain = returns - dark
        means = {term: float(np.mean([terms[term] for terms in episodes])) for term in episodes[0]}
        error = float(gain.std(ddof=1) / math.sqrt(len(gain))) if len(gain) > 1 else math.nan
        found[name] = {"return": float(returns.mean()), "gain": float(gain.mean()), "gain_error": error, **means}
        cells = [
            f"{found[name]['return']:.1f}",
            f"{gain.mean():+.1f} ± {error:.1f}",
            *(f"{v:.1f}" for v in means.values()),
        ]
        print("| " + " | ".join([name, *cells]) + " |", flush=True)
    env.close()
    if given.json:
        given.json.write_text(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
