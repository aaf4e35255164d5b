"""Write the tables of docs/reference/environments.md that are measured.

What each baseline is worth, and how near the surrogate is:

    python docs/make_environment_tables.py [--episodes 50] [--ids fogsim/FogAdvisory-v1 …] [--density] [--surrogate]
        [--corridor]

Half an hour for all. ``--agent NAME=FILE`` adds a row for an agent of Stable-Baselines3 (a .zip file of its PPO).
"""

import argparse
import json
import math
import subprocess
import sys
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import Any

import numpy as np
from page_tables import ROOT, lines_of, write_table

from fogsim.units import KMH_PER_MPS
from fogsim.values import Lamp
from fogsim_envs import Evaluation, evaluate
from fogsim_envs.baselines import BASELINES
from fogsim_envs.evaluation import bootstrap_interval
from fogsim_envs.spaces import action_of

DISCOUNTS = (1.0, 0.99)
DENSITIES = {300.0: "300 vehicles/h", 2100.0: "2100 vehicles/h"}
CORRIDOR_TERMS = ("delay", "overdriving", "conflict", "collision")
CRAWLING = "crawling"
"""Name of 20 km/h always, the least that can be advised: what an agent would do that found standing to pay."""


def rows(env_id: str, episodes: int, agents: dict[str, str]) -> list[str]:
    """A row for each policy, two at a time."""
    names = {**{name: name for name in BASELINES}, CRAWLING: CRAWLING, **agents}
    with ProcessPoolExecutor(max_workers=2) as pool:
        return list(pool.map(partial(_row, env_id=env_id, episodes=episodes), names, names.values()))


def _row(name: str, given: str, *, env_id: str, episodes: int) -> str:
    policy = _policy(given)
    state = {"observation": "state"} if not isinstance(policy, str) and "Fast" not in env_id else {}
    found = evaluate(policy, env_id, seeds=range(episodes), discount=DISCOUNTS[1], **state)
    whole = [sum(episode.terms.values()) for episode in found.episodes]
    cells = [
        name,
        _interval(np.array(whole)),
        f"{found.mean:.1f} ({found.low:.1f} … {found.high:.1f})",
        f"{found.arrived:.0%}".replace("%", " %"),
        f"{found.struck:.0%}".replace("%", " %"),
        *(f"{_mean_term(found, term):.1f}" for term in ("time", "overdriving", "rear_fog_lamp")),
        f"{np.mean([episode.time for episode in found.episodes]):.0f} s",
    ]
    return "| " + " | ".join(cells) + " |"


def _policy(given: str) -> Any:
    if given == CRAWLING:
        return lambda _, info: action_of(20.0 / KMH_PER_MPS, Lamp(info["built_in_lamps"]), continuous=False)
    return given if given in BASELINES else _loaded(given)


def _interval(values: np.ndarray) -> str:
    low, high = bootstrap_interval(values)
    return f"{values.mean():.1f} ({low:.1f} … {high:.1f})"


def _mean_term(found: Evaluation, term: str) -> float:
    return float(np.mean([episode.terms[term] for episode in found.episodes]))


def density_rows(env_id: str, episodes: int) -> list[str]:
    """A row for each baseline, a column for each density."""
    written = []
    for name in BASELINES:
        cells = []
        for demand in DENSITIES:
            found = evaluate(name, env_id, seeds=range(episodes), overrides=[f"demand.same_way_vph={demand!r}"])
            cells.append(f"{found.mean:.1f} ({found.low:.1f} … {found.high:.1f})")
        written.append("| " + " | ".join([name, *cells]) + " |")
    return written


def surrogate_rows(episodes: int) -> list[str]:
    """A row for each light and class of visibility."""
    return ["| " + " | ".join(_surrogate_cells(record)) + " |" for record in _measured("surrogate", episodes)]


def corridor_rows(episodes: int) -> list[str]:
    """A row for each policy of message signs, the best first."""
    records = sorted(_measured("corridor", episodes), key=lambda record: -record["return"])
    return ["| " + " | ".join(_corridor_cells(record)) + " |" for record in records]


def _measured(benchmark: str, episodes: int) -> list[dict[str, Any]]:
    command = [sys.executable, f"benchmarks/{benchmark}.py", "--json", "--episodes", str(episodes)]
    done = subprocess.run(  # noqa: S603 - our own program
        command, cwd=ROOT, capture_output=True, text=True, check=True
    )
    return list(json.loads(done.stdout))


def _corridor_cells(record: dict[str, Any]) -> list[str]:
    gain = [f"{record[name]:+.1f}" for name in ("gain", "gain_low", "gain_high")]
    return [
        record["policy"],
        f"{record['return']:.1f} ({record['low']:.1f} … {record['high']:.1f})",
        f"{gain[0]} ({gain[1]} … {gain[2]})",
        f"{100 * record['collided']:.0f} %",
        *(f"{record[term]:.1f}" for term in CORRIDOR_TERMS),
    ]


def _surrogate_cells(record: dict[str, Any]) -> list[str]:
    above = record["visibility_to_m"]
    errors = [record[name] for name in ("median_error", "surrogate_median_error", "distance")]
    return [
        record["light"],
        f"{record['visibility_from_m']:.0f} … " + ("∞" if above is None else f"{above:.0f}") + " m",
        str(record["estimates"]),
        f"{100 * record['valid_share']:.0f} / {100 * record['surrogate_valid_share']:.0f} %",
        "–" if errors[0] is None else f"{math.exp(errors[0]):.2f} / {math.exp(errors[1]):.2f}",
        "–" if errors[2] is None else f"{errors[2]:.2f}",
    ]


def write(name: str, headings: Sequence[str], body: Iterable[str]) -> None:
    """Put a table into the page."""
    write_table("reference/environments.md", name, [*lines_of(headings, ()), *body])


def main() -> None:
    """Write the tables that the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=50)
    parser.add_argument("--ids", nargs="*", default=["fogsim/FogAdvisory-v1", "fogsim/FogAdvisoryFast-v1"])
    parser.add_argument("--density", action="store_true", help="the table over densities, too")
    parser.add_argument("--surrogate", action="store_true", help="the table of the surrogate's errors, too")
    parser.add_argument("--corridor", action="store_true", help="the table of FogCorridor's policies, too")
    parser.add_argument("--agent", action="append", default=[], help="NAME=FILE of an agent of Stable-Baselines3's PPO")
    asked = parser.parse_args()
    agents = {name: path for name, _, path in (one.partition("=") for one in asked.agent)}
    header = [
        "policy",
        "return, γ = 1",
        "γ = 0.99",
        "arrived",
        "struck",
        "time",
        "overdriving",
        "rear lamp",
        "duration",
    ]
    for env_id in asked.ids:
        write(f"returns {env_id}", header, rows(env_id, asked.episodes, agents))
    if asked.density:
        fast = "fogsim/FogAdvisoryFast-v1"
        write("densities", ["policy", *DENSITIES.values()], density_rows(fast, asked.episodes))
    if asked.surrogate:
        ratio = "median k / true k: real / drawn"
        header = ["light", "visibility ahead", "estimates", "valid: real / drawn", ratio, "KS distance"]
        write("surrogate", header, surrogate_rows(asked.episodes))
    if asked.corridor:
        header = ["policy", "return", "gain over dark signs", "episodes with collisions", *CORRIDOR_TERMS]
        write("returns fogsim/FogCorridor-v1", header, corridor_rows(asked.episodes))


def _loaded(path: str) -> Any:
    from stable_baselines3 import PPO  # noqa: PLC0415 - an extra

    return PPO.load(path)


if __name__ == "__main__":
    main()
