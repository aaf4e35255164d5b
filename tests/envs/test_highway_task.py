"""fogsim/FogHighway-v1: the task of version 1 on highway-env's roads."""

import warnings
from collections.abc import Iterator
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import fogsim_envs  # noqa: F401 - registers the environments
from fogsim.errors import InputError, UnknownNameError

ID = "fogsim/FogHighway-v1"
SMALL: dict[str, Any] = {"config": {"vehicles_count": 8}, "image_size": (64, 48)}
NO_ADVICE = np.array([12, 0])


@pytest.fixture
def env() -> Iterator[gymnasium.Env[Any, Any]]:
    made = gymnasium.make(ID, way=100.0, **SMALL)
    yield made
    made.close()


def test_gymnasiums_checker_finds_nothing(caplog: pytest.LogCaptureFixture) -> None:
    env = gymnasium.make(ID, observation="state", **SMALL)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped, skip_render_check=True)
    env.close()
    assert not caplog.records


def test_the_way_ends_with_the_arrival_and_is_worth_its_points(env: gymnasium.Env[Any, Any]) -> None:
    env.reset(seed=1, options={"visibility": float("inf")})
    terms: dict[str, float] = {}
    over = False
    while not over:
        _, _, over, truncated, info = env.step(NO_ADVICE)
        assert not truncated
        for name, value in info["reward_terms"].items():
            terms[name] = terms.get(name, 0.0) + value
    assert info["ending"] == "arrived"
    assert terms["progress"] == pytest.approx(40.0, rel=0.15)
    assert terms["arrival"] == 10.0


def test_episodes_differ_repeat_and_are_told(env: gymnasium.Env[Any, Any]) -> None:
    observation, info = env.reset(seed=3)
    other, _ = env.reset(seed=4)
    again, told = env.reset(seed=3)
    assert told["episode"] == info["episode"]
    np.testing.assert_equal(again, observation)
    assert not np.array_equal(other["camera"], observation["camera"])
    assert not observation["signs_mask"].any()
    assert all(one.startswith(("light.", "camera.told.", "fog=")) for one in info["episode"]["settings"])


def test_what_does_not_fit_is_refused(env: gymnasium.Env[Any, Any]) -> None:
    with pytest.raises(InputError, match=r"options\['scenario'\]: roads and traffic are highway-env's own"):
        env.reset(seed=1, options={"scenario": "motorway_fog_bank"})
    with pytest.raises(UnknownNameError, match="did you mean 'visibility'"):
        env.reset(seed=1, options={"visiblity": 60.0})
    with pytest.raises(InputError, match="way: expected more than 0 m"):
        gymnasium.make(ID, way=0.0)
    with pytest.raises(InputError, match="an id of highway-env"):
        gymnasium.make(ID, environment="CartPole-v1")
