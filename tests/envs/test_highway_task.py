"""fogsim/FogHighway-v1: the task of version 1 on highway-env's roads."""

import dataclasses
from collections.abc import Iterator
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import fogsim_envs  # noqa: F401 - registers the environments
from fogsim.errors import InputError
from fogsim_envs.task.highway import HighwayDistribution

ID = "fogsim/FogHighway-v1"
SMALL: dict[str, Any] = {"config": {"vehicles_count": 8}, "image_size": (64, 48)}
NO_ADVICE = np.array([12, 0])
_DRAWN = ("light.", "camera.told.", "traffic.events=", "fog=")


@pytest.fixture
def env() -> Iterator[gymnasium.Env[Any, Any]]:
    made = gymnasium.make(ID, way=100.0, **SMALL)
    yield made
    made.close()


def test_gymnasiums_checker_finds_nothing(caplog: pytest.LogCaptureFixture) -> None:
    # On a short road by day, what is drawn anew for each of the checker's resets is soon made.
    settings: dict[str, Any] = {"observation": "state", "image_size": (64, 48)}
    env = gymnasium.make(ID, environment="lane-keeping-v0", overrides=["light.illuminance_lx=5000"], **settings)
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
    assert told["drawn"] == info["drawn"]
    np.testing.assert_equal(again, observation)
    assert not np.array_equal(other["camera"], observation["camera"])
    assert not observation["signs_mask"].any()
    assert all(one.startswith(_DRAWN) for one in info["drawn"]["settings"])


def test_scripts_lights_and_drivers_are_drawn_by_their_weights() -> None:
    night = HighwayDistribution(light={"night": 1.0}, scripts={"braking_lead": 1.0}, drivers={"too_fast": 1.0})
    rng = np.random.default_rng(1)
    episodes = [night.draw(rng) for _ in range(5)]
    assert {(one.light, one.script, one.driver) for one in episodes} == {("night", "braking_lead", "too_fast")}
    assert len({one.settings for one in episodes}) == 5
    assert all(one.settings[-1].startswith('traffic.events=[{"kind": "brake", "vehicle": "lead"') for one in episodes)
    free = dataclasses.replace(night, scripts={"standing_vehicle": 1.0}).draw(rng)
    assert free.script == "free"
    assert all(one.startswith(_DRAWN) for one in free.settings)


def test_a_braking_leader_is_played(env: gymnasium.Env[Any, Any]) -> None:
    episode = HighwayDistribution(scripts={"braking_lead": 1.0}).draw(np.random.default_rng(1))
    _, info = env.reset(seed=1, options={"episode": episode})
    assert info["drawn"]["script"] == "braking_lead"
    with pytest.raises(InputError, match="road: roads and vehicles are highway-env's own"):
        env.reset(seed=1, options={"overrides": ["road={template: motorway, length_m: 1000}"]})


def test_what_does_not_fit_is_refused(env: gymnasium.Env[Any, Any]) -> None:
    with pytest.raises(InputError, match=r"options\['scenario'\]: roads and traffic are highway-env's own"):
        env.reset(seed=1, options={"scenario": "motorway_fog_bank"})
    with pytest.raises(InputError, match="did you mean 'visibility'"):
        env.reset(seed=1, options={"visiblity": 60.0})
