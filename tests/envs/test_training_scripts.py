"""What training scripts and libraries do with every environment: statistics, vectors, pickles, stored infos."""

import pickle
from typing import Any

import gymnasium
import numpy as np
import pytest
from early_motorway import EARLY
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers import RecordEpisodeStatistics

import fogsim_envs  # noqa: F401 - registers
from fogsim.errors import InputError
from fogsim_envs.corridor import parallel_env

LATEST = ("FogAdvisoryFast-v2", "FogAdvisory-v2", "FogDrive-v2", "FogHighway-v1")
ALL = (*LATEST, "FogAdvisoryFast-v1", "FogAdvisory-v1", "FogDrive-v1", "FogAdvisory-v0", "FogHighway-v0")
RESERVED = {"episode", "final_obs", "final_info", "TimeLimit.truncated", "terminal_observation", "is_success"}


def made(name: str, steps: int = 2, **arguments: Any) -> gymnasium.Env:
    small: dict[str, Any] = {} if "Fast" in name else {"image_size": (64, 48)}
    if name == "FogAdvisory-v0":
        small["overrides"] = [EARLY]
    return gymnasium.make(f"fogsim/{name}", max_episode_steps=steps, **small, **arguments)


def tree(info: Any) -> Any:
    return {key: tree(value) for key, value in info.items()} if isinstance(info, dict) else type(info)


@pytest.mark.filterwarnings("ignore:.*out of date")
@pytest.mark.parametrize(
    ("name", "mode"),
    [*((name, AutoresetMode.NEXT_STEP) for name in (*LATEST, "FogAdvisory-v0")), (LATEST[0], AutoresetMode.SAME_STEP)],
)
def test_statistics_of_episodes_in_a_vector(name: str, mode: AutoresetMode) -> None:
    envs = SyncVectorEnv([lambda: RecordEpisodeStatistics(made(name))], autoreset_mode=mode)
    _, info = envs.reset(seed=1)
    assert not RESERVED & info.keys()
    lengths: list[int] = []
    for _ in range(6):
        *_, infos = envs.step(envs.action_space.sample())
        over = infos.get("final_info", infos)
        lengths += over["episode"]["l"].tolist() if "episode" in over else []
    envs.close()
    assert lengths[:2] == [2, 2]


@pytest.mark.parametrize("name", LATEST)
def test_infos_have_one_tree_and_are_numbers_on_request(name: str) -> None:
    env = made(name, 4)
    _, first = env.reset(seed=1)
    with pytest.raises(InputError, match=r"only before its first reset\(\)"):
        pickle.dumps(env.unwrapped)
    later = [env.step(env.action_space.sample())[-1] for _ in range(4)]
    assert all(tree(info) == tree(first) for info in later)
    assert first["reward_terms"].keys() == later[0]["reward_terms"].keys()
    env.close()
    flat = made(name, 4, flat_info=True)
    _, info = flat.reset(seed=1)
    assert {type(value) for value in info.values()} == {float}
    assert {"truth/visibility_m", "reward_terms/progress", "ending"} <= info.keys()
    flat.close()


@pytest.mark.filterwarnings("ignore:.*out of date")
def test_environments_pickle_before_the_reset_and_say_why_not_after() -> None:
    for name in ALL:
        env = made(name).unwrapped
        pickle.loads(pickle.dumps(env))  # noqa: S301 - our own
    env.reset(seed=1)
    with pytest.raises(InputError, match=r"only before its first reset\(\)"):
        pickle.dumps(env)
    env.close()


def test_corridors_pickle_and_their_infos_are_numbers() -> None:
    env = pickle.loads(pickle.dumps(parallel_env(overrides=["duration_s=150"])))  # noqa: S301 - our own
    _, first = env.reset(seed=1)
    *_, infos = env.step(dict.fromkeys(env.agents, np.int64(0)))
    for agent, info in infos.items():
        assert tree(info) == tree(first[agent])
        assert {type(value) for value in info.values()} == {float}
    assert set(env.drawn) == {"settings", "driver", "light", "script", "seed"}
    env.close()
