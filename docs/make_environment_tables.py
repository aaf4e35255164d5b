"""Write the tables of docs/reference/environments.md that are measured.

What each baseline is worth:

    python docs/make_environment_tables.py [--episodes 50] [--ids fogsim/FogAdvisory-v2 …]

``--agent NAME=FILE`` adds a row for an agent of Stable-Baselines3 (a .zip file of its PPO).
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import Any

import numpy as np
from page_tables import lines_of, write_table

from fogsim.units import KMH_PER_MPS
from fogsim.values import Lamp
from fogsim_envs import Evaluation, evaluate
from fogsim_envs.baselines import BASELINES
from fogsim_envs.evaluation import bootstrap_interval
from fogsim_envs.spaces import action_of

PAGE = "reference/environments.md"
DISCOUNTS = (1.0, 0.99)
CRAWLING = "crawling"
"""Name of 20 km/h always, the least that can be advised: what an agent would do that found standing to pay."""


def rows(env_id: str, episodes: int, agents: dict[str, str]) -> list[list[str]]:
    """A row for each policy, two at a time."""
    names = {**{name: name for name in BASELINES}, CRAWLING: CRAWLING, **agents}
    with ProcessPoolExecutor(max_workers=2) as pool:
        return list(pool.map(partial(_row, env_id=env_id, episodes=episodes), names, names.values()))


def _row(name: str, given: str, *, env_id: str, episodes: int) -> list[str]:
    policy = _policy(given)
    state = {"observation": "state"} if not isinstance(policy, str) and "Fast" not in env_id else {}
    found = evaluate(policy, env_id, seeds=range(episodes), discount=DISCOUNTS[1], **state)
    whole = np.array([sum(episode.terms.values()) for episode in found.episodes])
    return [
        name,
        _interval(whole.mean(), *bootstrap_interval(whole)),
        _interval(found.mean, found.low, found.high),
        f"{found.arrived:.0%}".replace("%", " %"),
        f"{found.struck:.0%}".replace("%", " %"),
        *(f"{_mean_term(found, term):.1f}" for term in ("time", "overdriving", "rear_fog_lamp")),
        f"{np.mean([episode.time for episode in found.episodes]):.0f} s",
    ]


def _policy(given: str) -> Any:
    if given == CRAWLING:
        return lambda _, info: action_of(20.0 / KMH_PER_MPS, Lamp(info["built_in_lamps"]), continuous=False)
    return given if given in BASELINES else _loaded(given)


def _interval(mean: float, low: float, high: float) -> str:
    return f"{mean:.1f} ({low:.1f} … {high:.1f})"


def _mean_term(found: Evaluation, term: str) -> float:
    return float(np.mean([episode.terms[term] for episode in found.episodes]))


def main() -> None:
    """Write the tables that the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=50)
    parser.add_argument("--ids", nargs="*", default=["fogsim/FogAdvisory-v2", "fogsim/FogAdvisoryFast-v2"])
    parser.add_argument("--agent", action="append", default=[], help="NAME=FILE of an agent of Stable-Baselines3's PPO")
    asked = parser.parse_args()
    agents = {name: path for name, _, path in (one.partition("=") for one in asked.agent)}
    heads = ("policy", "return, γ = 1", "γ = 0.99", "arrived", "struck", "time", "overdriving", "rear lamp", "duration")
    for env_id in asked.ids:
        write_table(PAGE, f"returns {env_id}", lines_of(heads, rows(env_id, asked.episodes, agents)))


def _loaded(path: str) -> Any:
    from stable_baselines3 import PPO  # noqa: PLC0415 - an extra

    return PPO.load(path)


if __name__ == "__main__":
    main()
