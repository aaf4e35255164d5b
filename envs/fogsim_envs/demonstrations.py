"""Episodes of the baselines as a data set for learning from demonstrations: ``python -m fogsim_envs.demonstrations``.

The data set is one of Minari (https://minari.farama.org), in Minari's own place (``MINARI_DATASETS_PATH``).
"""

import argparse
import math
import re
from typing import Annotated, Any

import gymnasium

from fogsim.core.parameters import Range, checked_parameters
from fogsim.errors import FogSimError, InputError, MissingDependencyError, shown
from fogsim_envs.baselines import BASELINES, baseline, check_baseline, reward_weights

_DATA_SET = re.compile(r"([-\w][-\w/]*[-\w]/)?[-\w]+-v\d+")
"""Ids that Minari takes; it checks them only when all episodes have been driven."""


@checked_parameters
def record_demonstrations(
    name: str, env_id: str, episodes: Annotated[int, Range(1, math.inf)], data_set: str, **arguments: Any
) -> Any:
    """Run a baseline, and keep its episodes as a data set."""
    if _DATA_SET.fullmatch(data_set) is None:
        raise InputError(f"data_set: expected an id such as 'fogsim/advisory/rule-v1', got {shown(data_set)}")
    minari = _import_minari()
    if data_set in minari.list_local_datasets():
        raise InputError(f"data set {data_set!r} already exists: choose another id, or minari delete {data_set}")
    # Otherwise it keeps frames as JPEG, which has other contrasts.
    env = minari.DataCollector(gymnasium.make(env_id, **arguments), jpeg_encoding=False)
    try:
        check_baseline(name, env)
        policy = baseline(name, env.action_space, reward_weights(env))
        for seed in range(episodes):
            policy.reset(seed)
            observation, info = env.reset(seed=seed)
            over = False
            while not over:
                observation, _, terminated, truncated, info = env.step(policy(observation, info))
                over = terminated or truncated
            print(f"\r{seed + 1} of {episodes} episodes", end="", flush=True)  # noqa: T201 - a command's progress
        print()  # noqa: T201
        return env.create_dataset(
            dataset_id=data_set,
            algorithm_name=f"FogSim's baseline {name}",
            description=f"{episodes} episodes of {env_id}, seeds 0 to {episodes - 1}",
        )
    finally:
        env.close()


def _import_minari() -> Any:
    try:
        import minari  # noqa: PLC0415 - an extra
    except ImportError as error:
        raise MissingDependencyError(f"data sets need Minari ({error}): pip install 'fogsim[rl]'") from error
    return minari


def main() -> None:
    """Run it from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--policy", default="rule", help=f"one of {', '.join(BASELINES)}")
    parser.add_argument("--env", default="fogsim_envs:fogsim/FogAdvisoryFast-v2")
    parser.add_argument("--episodes", type=int, default=100)
    parser.add_argument("--id", default="", help="id of the data set [fogsim/advisory/POLICY-v1]")
    asked = parser.parse_args()
    try:
        record_demonstrations(asked.policy, asked.env, asked.episodes, asked.id or f"fogsim/advisory/{asked.policy}-v1")
    except (FogSimError, gymnasium.error.Error) as error:
        parser.exit(2, f"error: {error}\n")


if __name__ == "__main__":
    main()
