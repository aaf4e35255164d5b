"""What simple policies are worth on fogsim/FogCorridor-v1.

Mean return with its 95 % interval and its terms over the same episodes of the split "test" for each policy, and what
was gained over dark signs in the same episodes, too; half an hour for 30 episodes.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from harness import Row, lines_of, parse_options, publish

from fogsim.units import KMH_PER_MPS
from fogsim_envs import Evaluation, evaluate
from fogsim_envs.corridor import parallel_env
from fogsim_envs.corridor.baselines import SIGN_BASELINES, level_of


def always(kmh: float) -> Callable[[Any, Any], int]:
    """A policy that shows one speed."""
    return lambda _observation, _info: level_of(kmh / KMH_PER_MPS)


POLICIES: dict[str, Any] = {**{name: name for name in SIGN_BASELINES}, "40 km/h": always(40.0), "80 km/h": always(80.0)}


def record(name: str, found: Evaluation, dark: Evaluation) -> Row:
    """Figures of a policy."""
    gain, gain_low, gain_high = found.minus(dark)
    terms = {term: float(np.mean([one.terms[term] for one in found.episodes])) for term in found.episodes[0].terms}
    figures = {"return": found.mean, "low": found.low, "high": found.high}
    figures |= {"gain": gain, "gain_low": gain_low, "gain_high": gain_high, "collided": found.struck, **terms}
    return {"policy": name, "episodes": len(found.episodes), **{key: round(one, 2) for key, one in figures.items()}}


TERMS = ("delay", "overdriving", "conflict", "collision")


def cells(record: Row) -> tuple[str, ...]:
    """A record in cells of the docs' table."""
    returned = f"{record['return']:.1f} ({record['low']:.1f} … {record['high']:.1f})"
    gain = f"{record['gain']:+.1f} ({record['gain_low']:+.1f} … {record['gain_high']:+.1f})"
    terms = (f"{record[term]:.1f}" for term in TERMS)
    return (record["policy"], returned, gain, f"{100 * record['collided']:.0f} %", *terms)


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        docs=("reference/environments.md", "returns fogsim/FogCorridor-v1"),
        episodes=(6, "episodes"),
        policy=(list(POLICIES), "which policies", POLICIES),
    )
    env = parallel_env(split="test")
    seeds = range(given.episodes)
    dark = evaluate("none", env, seeds)
    found = {name: dark if name == "none" else evaluate(POLICIES[name], env, seeds) for name in given.policy}
    env.close()
    records = [record(name, one, dark) for name, one in found.items()]
    heads = ("policy", "return", "gain over dark signs", "episodes with collisions", *TERMS)
    best = sorted(records, key=lambda one: -one["return"])
    publish(given, records, docs=lambda _: lines_of(heads, map(cells, best)))


if __name__ == "__main__":
    main()
