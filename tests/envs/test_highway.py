"""highway-env's environments in fog as Gymnasium and its users see them."""

import contextlib
import functools
import math
from collections.abc import Callable, Iterator
from typing import Any

import gymnasium
import highway_env  # noqa: F401 - registers its environments
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import TimeLimit

import fogsim_envs  # noqa: F401 - registers the environments
from fogsim.errors import InputError
from fogsim_envs.camera_wrapper import FogCameraWrapper
from fogsim_envs.vector import make_vector

ID = "fogsim/FogHighway-v0"
FEW = {"vehicles_count": 8}
QUICK = "estimators=[negru2013]"
SMALL: dict[str, Any] = {"config": FEW, "image_size": (64, 48), "overrides": [QUICK]}
SLOW, NO_ADVICE = np.array([2, 0]), np.array([12, 0])


@pytest.fixture(scope="module")
def env() -> Iterator[gymnasium.Env[Any, Any]]:
    made = gymnasium.make(ID, **SMALL)
    yield made
    made.close()


@pytest.mark.parametrize("continuous", [False, pytest.param(True, marks=pytest.mark.nightly)])
def test_gymnasiums_checker_finds_nothing(continuous: bool, caplog: pytest.LogCaptureFixture) -> None:
    env = gymnasium.make(ID, continuous=continuous, render_mode="rgb_array", **SMALL)
    check_env(env.unwrapped)
    env.close()
    env.close()
    assert not caplog.records


def test_fog_is_seen_and_told(env: gymnasium.Env[Any, Any]) -> None:
    clear = {"overrides": ["fog.visibility_m=inf"]}
    foggy, info = env.reset(seed=5)
    assert info["truth"]["visibility_m"] == pytest.approx(100.0)
    sunny, info = env.reset(seed=5, options=clear)
    assert info["truth"]["visibility_m"] == math.inf
    # Fog takes the contrast between the road below and the sky above.
    contrast = [float(np.ptp(picture["camera"].mean(axis=(1, 2)))) for picture in (foggy, sunny)]
    assert contrast[0] < 0.8 * contrast[1]
    assert not foggy["signs_mask"].any()


def test_the_step_is_highway_envs_own(env: gymnasium.Env[Any, Any]) -> None:
    with pytest.raises(InputError, match=r"clocks\.traffic_step_s: highway-env moves by 1 / simulation_frequency"):
        env.reset(options={"overrides": [f"clocks.traffic_step_s={1 / 30!r}"]})
    plain = gymnasium.make("highway-v0", config=FEW)
    with pytest.raises(InputError, match=r"clocks\.camera_period_s: there is a frame at the end of each step"):
        FogCameraWrapper(
            plain, image_size=(64, 48), overrides=["clocks.decision_period_s=9", "clocks.camera_period_s=3"]
        )
    plain.close()


def test_episodes_replay_and_do_not_disturb_each_other() -> None:
    one, other = (gymnasium.make(ID, **SMALL) for _ in range(2))
    try:
        alone = [one.reset(seed=9)[0], *(one.step(SLOW)[0] for _ in range(3))]
        pairs = [(one.reset(seed=9)[0], other.reset(seed=9)[0])]
        pairs += [(one.step(SLOW)[0], other.step(SLOW)[0]) for _ in range(3)]
    finally:
        one.close()
        other.close()
    for a, (b, c) in zip(alone, pairs, strict=True):
        assert all(np.array_equal(a[k], b[k]) and np.array_equal(a[k], c[k]) for k in a)


def test_an_environment_may_build_other_roads_at_every_reset() -> None:
    """Lanes of the oval are drawn by lot, with numbers that no seed sets."""
    env = gymnasium.make(
        ID, environment="racetrack-oval-v1", config={"length": 0, "other_vehicles": 0}, image_size=(64, 48)
    )
    ends = []
    for seed in range(3):
        env.reset(seed=seed)
        step: Any = env.unwrapped
        ends.append(float(np.abs(step._step.truth.route).max()))
        assert env.step(NO_ADVICE)[4]["route_position_m"] > 0.0
    env.close()
    assert len(set(ends)) > 1


def test_its_duration_truncates() -> None:
    env = gymnasium.make(ID, config={**FEW, "duration": 1.0}, image_size=(64, 48))
    env.reset(seed=1)
    ends = [env.step(NO_ADVICE)[2:4] for _ in range(2)]
    env.close()
    assert ends == [(False, False), (False, True)]


def reset_with(*overrides: str, steps: int = 0, advised: Any = NO_ADVICE, **config: Any) -> list[Any]:
    """Vehicles of an environment after some steps."""
    env = gymnasium.make(ID, config={**FEW, **config}, image_size=(64, 48), overrides=(QUICK, *overrides))
    env.reset(seed=6)
    for _ in range(steps):
        env.step(advised)
    environment: Any = env.unwrapped
    vehicles = list(environment._simulation._environment.road.vehicles)
    env.close()
    return vehicles


def test_the_scenarios_drivers_drive_here_too() -> None:
    """Within 40 m one stops from (−2.5 + √(2.5² + 2 · 40 / 3.4)) · 3.4 = 10.05 m/s."""
    foggy = ("fog.visibility_m=40", "drivers.speed_spread=0")
    careful = reset_with(*foggy, "drivers.speed_choice=within_sight", steps=16)
    heedless = reset_with(*foggy, "drivers.speed_choice=unaffected", steps=16)
    assert [v.target_speed for v in careful[1:]] == pytest.approx([10.05] * 8, abs=0.01)
    assert min(v.target_speed for v in heedless[1:]) > 20.0


@pytest.mark.parametrize(("rate", "obeyed"), [(0.0, 0), (1.0, 8)])
def test_advice_to_all_reaches_those_who_comply(rate: float, obeyed: int) -> None:
    told = ("fog.visibility_m=inf", "drivers.advised=all", f"drivers.compliance.rate={rate}")
    vehicles = reset_with(*told, steps=24, advised=np.array([1, 0]))
    assert sum(v.target_speed == pytest.approx(30 / 3.6) for v in vehicles[1:]) == obeyed
    assert vehicles[0].target_speed == pytest.approx(30 / 3.6)


def test_the_scenarios_events_happen_here_too() -> None:
    events = "traffic.events=[{kind: break_down, vehicle: lead, at_time_s: 0.5, lamps: false}]"
    one_lane = {"lanes_count": 1, "vehicles_count": 2}
    assert reset_with(events, steps=20, **one_lane)[1].speed == 0.0
    assert reset_with(steps=20, **one_lane)[1].speed > 15.0


@pytest.mark.parametrize("make", [gymnasium.make_vec, make_vector])
def test_vector_environments(make: Callable[..., Any]) -> None:
    """Gymnasium's, one after another in this process, and ours in processes of their own do the same."""
    one_step = functools.partial(TimeLimit, max_episode_steps=1)
    with contextlib.closing(make(ID, num_envs=2, wrappers=[one_step], **SMALL)) as envs:
        observation, _ = envs.reset(seed=[3, 3])
        assert np.array_equal(observation["camera"][0], observation["camera"][1])
        assert observation["state"][0, 0] > 0.0
        assert envs.step(np.array([[2, 0], [12, 0]]))[3].tolist() == [True, True]


def test_bad_arguments() -> None:
    with pytest.raises(InputError, match=r"traffic\.ego: .*highway-env's own here.*got 'veh0'"):
        gymnasium.make(ID, overrides=["traffic.ego=veh0"])
    unknown = "traffic.events=[{kind: lamps_fail, vehicle: led, at_time_s: 0}]"
    env = gymnasium.make(ID, config=FEW, image_size=(64, 48), overrides=[unknown])
    with pytest.raises(InputError, match=r"no vehicle 'led' in HighwayEnv; did you mean 'lead'"):
        env.reset(seed=1)
    env.close()
    with pytest.raises(InputError, match="environment of highway-env"):
        FogCameraWrapper(gymnasium.make("CartPole-v1"))
    with pytest.raises(InputError, match="FogCameraWrapper needs frames, and renderer: none draws none"):
        FogCameraWrapper(gymnasium.make("highway-v0", config=FEW), overrides=["renderer=none", "estimators=[]"])


@pytest.mark.parametrize(("name", "config"), [("highway-v0", FEW), ("roundabout-v1", {})])
def test_the_wrapper_adds_a_camera(name: str, config: dict[str, Any]) -> None:
    plain = gymnasium.make(name, config=config)
    env = FogCameraWrapper(
        gymnasium.make(name, config=config), image_size=(64, 48), drivers=False, visibility=np.int64(100)
    )
    observation, info = env.reset(seed=4)
    expected, _ = plain.reset(seed=4)
    for _ in range(3):
        assert env.observation_space.contains(observation)
        assert np.array_equal(observation["highway"], expected)
        assert info["truth"]["visibility_m"] == pytest.approx(100.0)
        observation, reward, *ends, info = env.step(1)
        expected, *same = plain.step(1)
        assert [reward, *ends] == same[:3]
    env.close()
    env.close()
    plain.close()


def test_the_wrappers_drivers_do_not_see_through_fog() -> None:
    def front(visibility: float) -> Any:
        env = FogCameraWrapper(
            gymnasium.make("highway-v0", config=FEW), image_size=(64, 48), visibility=visibility, overrides=[QUICK]
        )
        env.reset(seed=4)
        road: Any = env.unwrapped.road  # type: ignore[attr-defined]
        found = [road.neighbour_vehicles(v)[0] for v in road.vehicles]
        env.close()
        return sum(f is not None for f in found)

    assert front(15.0) < front(math.inf)


@pytest.mark.parametrize(("drivers", "slower"), [(True, True), (False, False)])
def test_the_wrappers_drivers_choose_their_speed_and_play_the_script(drivers: bool, slower: bool) -> None:
    settings = (
        "drivers.speed_choice=within_sight",
        "traffic.events=[{kind: brake, vehicle: IDMVehicle 8, at_time_s: 1, to_speed_kmh: 18}]",
    )
    plain = gymnasium.make("highway-v0", config=FEW)
    env = FogCameraWrapper(plain, image_size=(64, 48), visibility=40.0, drivers=drivers, overrides=settings)
    env.reset(seed=4)
    road: Any = env.unwrapped.road  # type: ignore[attr-defined]
    for _ in range(6):
        env.step(1)
    speeds = [v.speed for v in road.vehicles[1:]]
    env.close()
    assert speeds[-1] == pytest.approx(5.0)
    assert (max(speeds[:-1]) < 16.0) == slower


def test_the_wrapper_needs_a_reset() -> None:
    env = FogCameraWrapper(gymnasium.make("highway-v0", config=FEW, disable_env_checker=True), image_size=(64, 48))
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(1)
    env.close()


def test_the_wrapper_takes_what_python_and_numpy_give() -> None:
    plain = gymnasium.make("highway-v0", config={**FEW, "simulation_frequency": np.int64(15)})
    env: Any = FogCameraWrapper(plain, image_size=(64, 48), overrides=(text for text in [QUICK]))
    again: Any = gymnasium.make(env.spec)
    for one in (env, again):
        assert one.reset(seed=np.int64(3))[1]["truth"]["visibility_m"] == pytest.approx(100.0)
        one.close()


def test_the_wrapper_looks_as_often_as_the_environment_acts_after_every_reset() -> None:
    env: Any = FogCameraWrapper(gymnasium.make("highway-v0", config=FEW), image_size=(64, 48), overrides=[QUICK])
    for rate in (1, 5):
        env.reset(seed=3, options={"config": {"policy_frequency": rate}})
        env.step(1)
        assert env._step.time == pytest.approx(1.0 / rate)
        assert env._config.periods.camera_period == pytest.approx(1.0 / rate)
    env.close()


@pytest.mark.parametrize("number", [np.int64, np.float64, np.float32])
def test_frequencies_may_be_numpys(number: Callable[[int], Any]) -> None:
    with contextlib.closing(
        gymnasium.make(ID, config={**FEW, "simulation_frequency": number(15)}, image_size=(64, 48))
    ):
        pass


@pytest.mark.parametrize("number", [math.inf, np.float32(math.nan)])
def test_a_configuration_has_finite_numbers(number: float) -> None:
    with pytest.raises(InputError, match=r"config\['vehicles_density'\] must be a finite number, got .*(inf|nan)"):
        gymnasium.make(ID, config={"vehicles_density": number})


def test_the_space_is_that_of_an_observation_that_a_reset_changes() -> None:
    plain = gymnasium.make("highway-v0", config=FEW)
    with contextlib.closing(FogCameraWrapper(plain, image_size=(64, 48), overrides=[QUICK])) as env:
        for kind in ("TimeToCollision", "Kinematics"):
            observation, _ = env.reset(seed=1, options={"config": {"observation": {"type": kind}}})
            assert env.observation_space.contains(observation)
