"""The environments as Gymnasium and its users see them."""

import contextlib
import math
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pygame
import pytest
from early_motorway import EARLY
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import RecordEpisodeStatistics

import fogsim
import fogsim_envs  # noqa: F401 - registers the environments
from fogsim.errors import InputError
from fogsim.values import Truth
from fogsim_envs.rendering import StepRenderer
from fogsim_envs.spaces import ADVISED_SPEEDS, LAMP_MODES, command_of, observe

ID = "fogsim/FogAdvisory-v0"
ROAD = str(Path(__file__).resolve().parents[1] / "data" / "road")
"""A scenario in which the ego is there at once: the motorway fills for three minutes first."""
SMALL: dict[str, Any] = {
    "image_size": (64, 48),
    "overrides": ("clocks.camera_period_s=0.5", "estimators=[negru2013]"),
}


@pytest.mark.parametrize("continuous", [False, pytest.param(True, marks=pytest.mark.nightly)])
def test_gymnasiums_checker_finds_nothing(continuous: bool, caplog: pytest.LogCaptureFixture) -> None:
    env = gymnasium.make(ID, scenario=ROAD, continuous=continuous, render_mode="rgb_array", **SMALL)
    check_env(env.unwrapped)
    env.close()
    env.close()
    assert not caplog.records


def test_two_environments_in_one_process_do_not_disturb_each_other() -> None:
    one, other = (gymnasium.make(ID, scenario=ROAD, **SMALL) for _ in range(2))
    try:
        alone = [one.reset(seed=9)[0], *(one.step(np.array([6, 0]))[0] for _ in range(3))]
        first = one.reset(seed=9)[0]
        second = other.reset(seed=9)[0]
        together = [first, *(one.step(np.array([6, 0]))[0] for _ in range(3))]
        hosted = [second, *(other.step(np.array([6, 0]))[0] for _ in range(3))]
    finally:
        one.close()
        other.close()
    for a, b, c in zip(alone, together, hosted, strict=True):
        assert all(np.array_equal(a[k], b[k]) and np.array_equal(a[k], c[k]) for k in a)


@pytest.mark.parametrize(
    ("setting", "step"), [("clocks.camera_period_s=0.1", 0.5), ("clocks.decision_period_s=1", 1.0)]
)
def test_an_override_of_a_clock_does_what_it_says_and_nothing_else(setting: str, step: float) -> None:
    """A step stays one decision period long, and in the next episode is as long as before."""
    env = gymnasium.make(ID, scenario=ROAD, **SMALL)
    for options, length in (({"overrides": [setting]}, step), (None, 0.5)):
        env.reset(seed=5, options=options)
        assert env.step(np.array([12, 0]))[4]["time_s"] == pytest.approx(length)
        assert env.unwrapped.metadata["render_fps"] == pytest.approx(1.0 / length)
    env.close()


def test_time_truncates_and_tells_what_has_not_been_played() -> None:
    late = "traffic.events=[{kind: brake, vehicle: lead, at_time_s: 300}]"
    overrides = (*SMALL["overrides"], "duration_s=2", late)
    env = gymnasium.make(ID, scenario=ROAD, image_size=(64, 48), overrides=overrides)
    env.reset(seed=1)
    steps = [env.step(np.array([12, 0])) for _ in range(4)]
    with pytest.raises(gymnasium.error.ResetNeeded, match="the episode is over"):
        env.step(np.array([12, 0]))
    env.close()
    assert [step[2:4] for step in steps] == [(False, False)] * 3 + [(False, True)]
    assert [len(step[4]["unplayed"]) for step in steps] == [0, 0, 0, 1]
    assert steps[-1][4]["unplayed"][0].startswith("traffic.events.0 (brake of lead at_time_s=300): its time")


def test_rendering_shows_the_frame_beside_a_panel_in_an_array_and_in_a_window(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    settings: dict[str, Any] = {"scenario": ROAD, **SMALL, "disable_env_checker": True}
    env = gymnasium.make(ID, render_mode="rgb_array", **settings)
    env.reset(seed=1)
    picture: Any = env.render()
    env.close()
    assert picture.dtype == np.uint8
    assert picture.shape[1] > 640
    env = gymnasium.make(ID, render_mode="human", **settings)
    env.reset(seed=1)
    shown = pygame.surfarray.array3d(pygame.display.get_surface()).swapaxes(0, 1)
    assert env.render() is None
    env.close()
    assert np.array_equal(shown, picture)
    assert not pygame.display.get_init()


def test_a_window_needs_a_display(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    with pytest.raises(InputError, match="render_mode: 'human' opens a window, and there is no display here"):
        gymnasium.make(ID, scenario=ROAD, render_mode="human", **SMALL)
    # Gymnasium's checker tries all that an environment has.
    env = gymnasium.make(ID, scenario=ROAD, **SMALL)
    assert env.metadata["render_modes"] == ["rgb_array"]
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.unwrapped.step(np.array([0, 0]))
    monkeypatch.setenv("SDL_VIDEODRIVER", "no such driver")
    with pytest.raises(InputError, match=r"could not open a window: .*; take 'rgb_array'"):
        StepRenderer("human", "x").show(_a_step(env), 2.0)
    env.close()
    with pytest.raises(InputError, match="unknown render_mode 'ansi'"):
        StepRenderer("ansi", "x")


@pytest.mark.parametrize(("continuous", "bad"), [(False, [13, 0]), (True, [0.0, math.nan])])
def test_actions_outside_the_space_are_refused(continuous: bool, bad: list[float]) -> None:
    env = gymnasium.make(ID, scenario=ROAD, continuous=continuous, **SMALL)
    env.reset(seed=1)
    with pytest.raises(InputError, match=r"^action of fogsim/FogAdvisory-v0: no member of .*; got \["):
        env.step(bad)
    # What was refused has not happened.
    assert env.step(np.zeros(2))[4]["time_s"] == pytest.approx(0.5)
    env.close()


def test_a_loaded_scenario_serves_as_well() -> None:
    env = gymnasium.make(ID, scenario=fogsim.load_scenario(ROAD, ["fog.visibility_m=120"]), **SMALL)
    assert env.reset(seed=1)[1]["truth"]["visibility_m"] == pytest.approx(120.0)
    env.close()


def test_vector_environments_run_in_processes_of_their_own() -> None:
    with contextlib.closing(
        gymnasium.make_vec(
            ID,
            num_envs=2,
            vectorization_mode="async",
            vector_kwargs={"shared_memory": False},
            wrappers=[RecordEpisodeStatistics],
            scenario=ROAD,
            **SMALL,
        )
    ) as envs:
        observation, _ = envs.reset(seed=[3, 3])
        assert observation["camera"].shape == (2, 48, 64, 3)
        assert np.array_equal(observation["camera"][0], observation["camera"][1])
        observation, rewards, *_ = envs.step(np.array([[2, 0], [12, 0]]))
        assert rewards.shape == (2,)


@pytest.fixture
def env() -> Iterator[gymnasium.Env[Any, Any]]:
    made = gymnasium.make(ID, image_size=(64, 48), overrides=("clocks.camera_period_s=0.5", EARLY))
    yield made
    made.close()


def test_an_episode_and_its_info(env: gymnasium.Env[Any, Any]) -> None:
    observation, info = env.reset(seed=5)
    assert env.observation_space.contains(observation)
    assert info["truth"]["visibility_m"] == pytest.approx(2000.0, rel=0.01)
    observation, reward, terminated, truncated, info = env.step(np.array([3, 1]))
    assert env.observation_space.contains(observation)
    assert reward == pytest.approx(sum(info["reward_terms"].values()))
    assert set(info["reward_terms"]) == {
        "progress", "visibility_margin", "conflict", "discomfort", "collision", "lamps",
    }  # fmt: skip
    assert not terminated
    assert not truncated
    assert info["time_s"] == pytest.approx(0.5)


def test_the_action_reaches_the_road(env: gymnasium.Env[Any, Any]) -> None:
    def speed_after(level: int) -> float:
        env.reset(seed=5)
        for _ in range(12):
            *_, info = env.step(np.array([level, 0]))
        return float(info["speed_mps"])

    slow, free = speed_after(2), speed_after(len(ADVISED_SPEEDS))
    assert slow < 20.0 < free


def test_truth_is_not_in_the_observation(env: gymnasium.Env[Any, Any]) -> None:
    """The same frame and sensors under another truth give the same observation."""
    step = _a_step(env)
    lie = replace(step, truth=Truth(0.3, 0.4), view=None, traffic=None, leader=None, collisions=())
    for key, value in observe(step).items():
        assert np.array_equal(value, observe(lie)[key])


def test_the_driver_is_warned_of_fog_whatever_the_agent_advises(env: gymnasium.Env[Any, Any]) -> None:
    info = env.reset(seed=1, options={"overrides": ["fog.visibility_m=40"]})[1]
    given = [info["warning"], *(env.step(np.array([len(ADVISED_SPEEDS), 0]))[-1]["warning"] for _ in range(3))]
    assert given == [None, "fog_ahead", "fog_ahead", "fog_ahead"]


def test_overrides_for_one_episode(env: gymnasium.Env[Any, Any]) -> None:
    info = env.reset(seed=1, options={"overrides": ["fog.visibility_m=80"]})[1]
    assert info["truth"]["visibility_m"] == pytest.approx(80.0)
    assert env.reset(seed=1)[1]["truth"]["visibility_m"] == pytest.approx(2000.0, rel=0.01)
    with pytest.raises(InputError, match="must not change the camera"):
        env.reset(options={"overrides": ["camera.width=128"]})


def test_the_reward_counts_with_the_reaction_time_of_the_advice(env: gymnasium.Env[Any, Any]) -> None:
    """At 26 m/s one needs some 150 m or 330 m, of 100 m that are seen."""
    margins = []
    for reaction_time in (2.0, 9.0):
        advice = f"advice={{method: stopping_sight_distance, parameters: {{reaction_time: {reaction_time}}}}}"
        env.reset(seed=5, options={"overrides": ["fog.visibility_m=100", advice]})
        info = env.step(np.array([12, 0]))[4]
        speed = info["speed_mps"]
        needed = speed * reaction_time + speed**2 / 6.8
        margins.append(info["reward_terms"]["visibility_margin"])
        assert margins[-1] == pytest.approx(-2.0 * (1.0 - 100.0 / needed), rel=1e-3)
    assert margins[1] < margins[0] < 0.0


def test_a_window_that_another_closed_is_opened_again(
    env: gymnasium.Env[Any, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    step, first, second = _a_step(env), StepRenderer("human", "first"), StepRenderer("human", "second")
    first.show(step, 2.0)
    size = pygame.display.get_surface().get_size()
    second.show(step, 2.0)
    first.close()
    second.show(step, 2.0)
    pygame.display.set_mode((64, 48))
    second.show(step, 2.0)
    assert pygame.display.get_surface().get_size() == size
    second.close()


def _a_step(env: gymnasium.Env[Any, Any]) -> Any:
    env.reset(seed=1)
    environment: Any = env.unwrapped
    return environment._step


def test_actions() -> None:
    assert command_of((0, 2), continuous=False).advice.speed == pytest.approx(20 / 3.6)
    assert command_of((12, 0), continuous=False).advice.speed == math.inf
    assert command_of((0, 2), continuous=False).lamps == LAMP_MODES[2]
    assert command_of((-1.0, -1.0), continuous=True).advice.speed == pytest.approx(20 / 3.6)
    assert command_of((1.0, 1.0), continuous=True).advice.speed == math.inf
    assert command_of((0.0, 0.0), continuous=True).lamps == LAMP_MODES[1]
