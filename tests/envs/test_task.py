"""The task of versions 1 and 2: episodes that differ, a reward that cannot be farmed, and what stands in for frames."""

import contextlib
import dataclasses
import importlib
import inspect
import math
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import FlattenObservation

import fogsim_envs
from fogsim.advice.agent import AGENT_STATE, agent_state, clipped, scaled_visibility
from fogsim.errors import InputError
from fogsim.metrics import DEFAULT_STANDARD
from fogsim.scenario import load_scenario
from fogsim.scenario.fog import Fog
from fogsim.values import Collision, Command, Ending, Estimate, Leader, SignSighting, Step
from fogsim_envs.advising import AdvisingEnv
from fogsim_envs.rewards import RewardWeights
from fogsim_envs.spaces import action_space
from fogsim_envs.task import FogAdvisoryV1Env, FogDistribution, ScenarioDistribution, TaskWeights
from fogsim_envs.task.episodes import fog_setting
from fogsim_envs.task.fast import _WITHOUT_FRAMES, FAST_FOG, FAST_ROAD, FAST_SCENARIO
from fogsim_envs.task.observation import (
    STATE_FEATURES,
    first_valid_estimate,
    leading_estimate,
    task_observation,
    task_space,
    task_state,
)
from fogsim_envs.task.rewards import Way, fault, task_terms
from fogsim_envs.task.sampling import MOTORWAY, EpisodeChoice, EpisodeSource

FAST = "fogsim/FogAdvisoryFast-v1"
NO_ADVICE = np.array([12, 0])
ROAD = str(Path(__file__).resolve().parents[1] / "data" / "road")
WAY = Way(length=2000.0, limit=36.0, duration=200.0)
WEIGHTS = TaskWeights()


# What has an environment of its own comes before those that share one: next to it, it would run in another process.


def test_a_number_is_a_pair_of_levels() -> None:
    assert gymnasium.make(FAST, discrete=True).action_space == gymnasium.spaces.Discrete(39)
    found: list[Any] = []
    for options, actions in (({"discrete": True}, (16, 5)), ({}, ([5, 1], [1, 2]))):
        with gymnasium.make(FAST, **options) as env:
            env.reset(seed=2)
            rewards = [env.step(action)[1] for action in actions]  # type: ignore[arg-type]  # of either kind
            found.append((rewards, fogsim_envs.evaluate("rule", env, [4]).mean))
    assert found[0] == found[1]


def test_a_frame_is_observed_and_an_unknown_mode_refused() -> None:
    env = gymnasium.make("fogsim/FogAdvisory-v1", image_size=(64, 48), render_mode="rgb_array")
    observation, _ = env.reset(seed=1, options={"overrides": ["light.illuminance_lx=5000"]})
    assert env.observation_space.contains(observation)
    observation, reward, *_, info = env.step(NO_ADVICE)
    assert env.observation_space.contains(observation)
    assert reward == pytest.approx(sum(info["reward_terms"].values()))
    assert observation["camera"].shape == (48, 64, 3)
    assert info["cost"] >= 0.0
    picture: Any = env.render()
    assert picture.ndim == 3
    # So few pixels tell the estimators nothing.
    assert [env.step(NO_ADVICE)[-1]["warning"] for _ in range(6)] == [*[""] * 4, *["cannot_see"] * 2]
    env.close()
    with pytest.raises(InputError, match=r"did you mean 'state'\?"):
        gymnasium.make("fogsim/FogAdvisory-v1", observation="states")


def test_an_episode_ends_with_a_studys_metrics() -> None:
    with gymnasium.make(FAST, metrics=True) as env:
        _, info = env.reset(seed=1, options={"visibility": 100.0})
        names, over = list(info["metrics"]), False
        while not over:
            assert list(info["metrics"]) == names
            assert all(math.isnan(value) for value in info["metrics"].values())
            _, _, terminated, truncated, info = env.step(NO_ADVICE)
            over = terminated or truncated
        found = info["metrics"]
        assert list(found) == names
        assert found["duration_s"] == info["time_s"]
        assert found["ego_collisions"] == 0.0
        assert found["minimum_visibility_m"] == pytest.approx(100.0, rel=0.02)
        assert math.isnan(found["mean_advised_speed_mps"])
        rule = fogsim_envs.evaluate("rule", env, [1, 2])
    mean, low, high = rule.metrics["mean_speed_mps"]
    assert low <= mean <= high
    assert mean == pytest.approx(np.mean([episode.metrics["mean_speed_mps"] for episode in rule.episodes]))


def test_baselines_are_evaluated() -> None:
    found = fogsim_envs.evaluate("oracle", FAST, seeds=range(2), discount=0.99)
    assert len(found.episodes) == 2
    assert found.low <= found.mean <= found.high
    assert "episodes" in str(found)
    seen = []

    def spy(observation: Any, info: dict[str, Any]) -> Any:
        seen.append(info["built_in_advice_mps"])
        return NO_ADVICE

    assert fogsim_envs.evaluate(spy, FAST, seeds=[0]).episodes[0].steps == len(seen)
    shifted = [dataclasses.replace(one, value=one.value - 2.0) for one in found.episodes]
    assert found.minus(dataclasses.replace(found, episodes=tuple(shifted))) == pytest.approx((2.0, 2.0, 2.0))
    with pytest.raises(InputError, match=r"of the seeds \[0, 1\], got \[0\]"):
        found.minus(dataclasses.replace(found, episodes=found.episodes[:1]))
    with pytest.raises(InputError, match="did you mean 'oracle'"):
        fogsim_envs.evaluate("oracles", FAST, seeds=[0])
    with pytest.raises(InputError, match="at least one"):
        fogsim_envs.evaluate("none", FAST, seeds=[])
    with pytest.raises(InputError, match="given twice"):
        fogsim_envs.evaluate("none", FAST, seeds=[0, 0])


def test_baselines_that_advise_are_refused_where_the_agent_drives() -> None:
    for name, arguments in [("fixed", {}), ("none", {"continuous": True}), ("rule", {"discrete": True})]:
        with pytest.raises(InputError, match=f"the agent of FogDrive drives, .* got '{name}'"):
            fogsim_envs.evaluate(name, "fogsim/FogDrive-v2", [0], image_size=(64, 48), **arguments)


@pytest.fixture
def fast() -> Iterator[gymnasium.Env[Any, Any]]:
    made = gymnasium.make(FAST, render_mode="rgb_array")
    yield made
    made.close()


@pytest.fixture(scope="module")
def step() -> Step:
    with contextlib.closing(gymnasium.make(FAST)) as made:
        made.reset(seed=3, options={"visibility": 60.0})
        return made.unwrapped._current


def _moved(step: Step, distance: float, seconds: float, **changes: Any) -> Step:
    position, time = step.route_position + distance, step.time + seconds
    return dataclasses.replace(step, route_position=position, time=time, **changes)


def _at(step: Step, speed: float, acceleration: float = 0.0) -> Step:
    speeds, accelerations = step.traffic.speed.copy(), step.traffic.acceleration.copy()
    speeds[step.ego], accelerations[step.ego] = speed, acceleration
    traffic = dataclasses.replace(step.traffic, speed=speeds, acceleration=accelerations)
    return dataclasses.replace(step, traffic=traffic, collisions=(), leader=None)


def test_gymnasiums_checker_finds_nothing(fast: gymnasium.Env[Any, Any]) -> None:
    check_env(fast.unwrapped, skip_render_check=True)


def test_every_version_1_takes_the_same_keywords() -> None:
    keywords = {
        name: set(inspect.signature(_class_of(name)).parameters)
        for name in (
            FAST,
            *(f"fogsim/Fog{one}" for one in ("Advisory-v1", "Advisory-v2", "Highway-v1", "Drive-v1", "Drive-v2")),
        )
    }
    shared = keywords["fogsim/FogAdvisory-v1"]
    assert shared == keywords["fogsim/FogAdvisory-v2"] == keywords["fogsim/FogDrive-v2"]
    assert shared == keywords["fogsim/FogDrive-v1"] == keywords[FAST] - {"surrogate"}
    # Roads and traffic are highway-env's.
    assert shared - {"scenario"} <= keywords["fogsim/FogHighway-v1"]


def _class_of(name: str) -> Any:
    module, _, own = str(gymnasium.spec(name).entry_point).partition(":")
    return getattr(importlib.import_module(module), own)


@pytest.mark.parametrize(
    "name",
    ["FogAdvisory-v1", "FogAdvisoryFast-v1", "FogHighway-v1", "FogAdvisory-v2", "FogAdvisoryFast-v2", "FogDrive-v2"],
)
def test_a_version_says_when_it_is_over_and_solved_and_what_has_changed(name: str) -> None:
    spec = gymnasium.spec(f"fogsim/{name}")
    assert spec.max_episode_steps is not None
    # Of 40 points, which a drive at the limit with nothing amiss is worth.
    assert 0.0 < spec.reward_threshold < 40.0
    kind = gymnasium.envs.registration.load_env_creator(str(spec.entry_point))
    assert f"### Version history\n    * {name[-2:]}: " in (kind.__doc__ or "")


@pytest.mark.parametrize(("mode", "size"), [("state", 22), ("camera", 64 * 48 * 3)])
def test_what_is_flattened_has_no_pixels_among_numbers(mode: str, size: int) -> None:
    env = gymnasium.make("fogsim/FogAdvisory-v1", observation=mode, image_size=(64, 48))
    assert FlattenObservation(env).observation_space.shape == (size,)
    env.close()


def test_episodes_differ_and_come_again(fast: gymnasium.Env[Any, Any]) -> None:
    first, info = fast.reset(seed=7)
    other = fast.reset()[1]
    again, same = fast.reset(seed=7)
    assert info["drawn"] == same["drawn"] != other["drawn"]
    np.testing.assert_array_equal(first, again)
    moved = fast.step(NO_ADVICE)[0]
    for seed in (8, None):
        repeated, drawn = fast.reset(seed=seed, options={"episode": info["drawn"]})
        assert drawn["drawn"] == info["drawn"]
        np.testing.assert_array_equal(first, repeated)
        np.testing.assert_array_equal(moved, fast.step(NO_ADVICE)[0])


def test_an_episode_without_a_seed_gets_another_run(fast: gymnasium.Env[Any, Any]) -> None:
    drawn = fast.reset(seed=7)[1]["drawn"]
    unseeded = {name: value for name, value in drawn.items() if name != "seed"}
    again = fast.reset(seed=8, options={"episode": unseeded})[1]["drawn"]
    assert again["settings"] == drawn["settings"]
    assert again["seed"] != drawn["seed"]


def test_a_scenario_in_place_of_the_own_road_is_run_as_it_is(fast: gymnasium.Env[Any, Any]) -> None:
    with_frames = EpisodeSource(None, None, None, (), "train")
    for source, name, overrides in [(fast.unwrapped._source, ROAD, _WITHOUT_FRAMES), (with_frames, "clear_day", ())]:
        for visibility, more in [(None, ()), (60.0, ("fog.visibility_m=60.0",))]:
            choice = EpisodeChoice(scenario=name, visibility=visibility)
            _, drawn = source.draw(np.random.default_rng(0), choice)
            assert drawn.scenario == load_scenario(name, [*overrides, *more])
    assert fast.reset(seed=1, options={"scenario": ROAD})[1]["drawn"]["settings"] == []
    given = EpisodeSource(None, None, FogDistribution(), (), "train")
    settings = given.draw(np.random.default_rng(0), EpisodeChoice(scenario="clear_day"))[1].episode.settings
    assert [one.partition("=")[0] for one in settings] == ["fog"]


def test_what_the_caller_fixes(fast: gymnasium.Env[Any, Any]) -> None:
    _, info = fast.reset(seed=2, options={"visibility": 45.0, "driver": "too_fast"})
    fog = next(setting for setting in info["drawn"]["settings"] if setting.startswith("fog="))
    assert "45.0" in fog
    assert info["drawn"]["driver"] == "too_fast"
    fast.reset(seed=2, options={"overrides": ["fog={visibility_m: 70}"]})
    assert fast.unwrapped._current.truth.visibility == pytest.approx(70.0)


def test_options_that_are_none(fast: gymnasium.Env[Any, Any]) -> None:
    for options, message in [
        ({"visibilty": 60}, "did you mean 'visibility'"),
        ({"visibility": -5}, "a number ≥ 1 m"),
        ({"visibility": True}, "a number ≥ 1 m"),
        ({"overrides": "fog.visibility_m=70"}, "must be a list"),
        ({"driver": "reckless"}, "unknown driver"),
        ({"episode": {"fog": 1}}, r"info\['drawn'\]"),
    ]:
        with pytest.raises(InputError, match=message):
            fast.reset(options=options)


@pytest.mark.parametrize(("distribution", "drawn"), [(None, 5), (ScenarioDistribution(), 5), ([MOTORWAY], 1)])
def test_fog_is_drawn_unless_scenarios_bring_their_own(distribution: Any, drawn: int) -> None:
    source, rng = EpisodeSource(None, distribution, None, (), "train"), np.random.default_rng(0)
    fogs = {repr(source.draw(rng, EpisodeChoice())[1].scenario.fog) for _ in range(5)}
    assert len(fogs) == drawn


def test_fog_is_drawn_from_its_ranges() -> None:
    rng = np.random.default_rng(1)
    fogs = [FogDistribution().draw(rng) for _ in range(400)]
    clear = [fog for fog in fogs if fog.get("visibility_m") == "inf"]
    densest = [fog["banks"][0]["visibility_m"] if "banks" in fog else fog["visibility_m"] for fog in fogs
               if fog not in clear]  # fmt: skip
    assert len(clear) == pytest.approx(40, abs=15)
    assert 25.0 <= min(densest) < 40.0
    assert 700.0 < max(densest) <= 1000.0
    # Log-uniform: half of them below the geometric mean.
    assert np.mean(np.array(densest) < math.sqrt(25.0 * 1000.0)) == pytest.approx(0.5, abs=0.08)
    load_scenario(MOTORWAY, [fog_setting(next(fog for fog in fogs if len(fog.get("banks", ())) == 2))])


def test_edges_of_banks_never_meet() -> None:
    near = FogDistribution(clear_share=0.0, even_share=0.0, ahead=(1.0, 100.0), bank_edge=(250.0, 300.0))
    rng = np.random.default_rng(1)
    double = [fog for fog in (Fog.model_validate(near.draw(rng)) for _ in range(60)) if len(fog.banks) == 2]
    gaps = [two.start_m - one.end_m for one, two in (fog.banks for fog in double)]
    # Of half an edge each, and no more than that where a bank is drawn to be nearer.
    assert min(gaps) == pytest.approx(251.0, abs=25.0)


@pytest.mark.parametrize(
    ("light", "prepared"), [({"day": 1.0, "night": 0.0}, False), ({"day": 0.9, "dusk": 0.1}, True)]
)
def test_a_night_that_may_come_is_prepared(light: dict[str, float], prepared: bool) -> None:
    assert EpisodeSource(None, ScenarioDistribution(light=light), None, (), "train").may_be_dark is prepared


def test_a_drive_at_the_limit_is_worth_forty(step: Step) -> None:
    clear = dataclasses.replace(step.truth, extinction=0.0, extinction_ahead=0.0)
    before = dataclasses.replace(_at(step, 36.0), truth=clear, speed_limit=36.0, command=Command())
    after = _moved(before, 18.0, 0.5)
    steps = WAY.length / 18.0
    terms = task_terms(before, after, WAY, WEIGHTS)
    last = task_terms(before, dataclasses.replace(after, ending=Ending.ARRIVED), WAY, WEIGHTS)
    assert steps * sum(terms.values()) + last["arrival"] == pytest.approx(40.0)
    # Who drives twice as fast as allowed gains nothing by the way, and saves no more than the time.
    faster = task_terms(before, _moved(before, 36.0, 0.5), WAY, WEIGHTS)
    assert faster["progress"] == pytest.approx(terms["progress"])


def test_standing_pays_nothing_and_an_early_end_saves_no_time(step: Step) -> None:
    before = dataclasses.replace(_at(step, 0.0), command=Command())
    stands = task_terms(before, _moved(before, 0.0, 0.5), WAY, WEIGHTS)
    assert stands["progress"] == 0.0
    assert sum(stands.values()) < 0.0
    ego, other = step.traffic.ids[step.ego], "other"
    struck = (Collision(step.time, other, ego, 10.0),)
    hit = _moved(before, 0.0, 0.5, collisions=struck, ending=Ending.COLLISION)
    terms = task_terms(before, hit, WAY, WEIGHTS)
    assert fault(hit) == "other"
    assert terms["collision"] == 0.0
    remaining = (WAY.duration - hit.time) / WAY.time_at_limit
    assert terms["time"] == pytest.approx(stands["time"] - WEIGHTS.time * remaining)


def test_who_strikes_pays(step: Step) -> None:
    ego = step.traffic.ids[step.ego]
    before = _at(step, 20.0)
    strikes = _moved(before, 10.0, 0.5, collisions=(Collision(step.time, ego, "other", 10.0),))
    assert fault(strikes) == "ego"
    assert task_terms(before, strikes, WAY, WEIGHTS)["collision"] == -WEIGHTS.collision
    assert not fault(before)


def test_a_collision_in_any_frame_of_a_decision_period_counts(fast: gymnasium.Env[Any, Any], step: Step) -> None:
    fast.reset(seed=3)
    hit = Collision(step.time, step.traffic.ids[step.ego], "lead", 5.0)
    frames = [_moved(step, 0.0, 0.1 * n, collisions=(hit,) if n == 2 else ()) for n in (1, 2, 3)]

    def advance(_: Command, periods: int = 1) -> Step:
        *_, last = some = [next(left) for _ in range(periods)]
        return dataclasses.replace(last, collisions=sum((one.collisions for one in some), ()))

    def env(**others: Any) -> Any:
        simulation = SimpleNamespace(advance=advance)
        return SimpleNamespace(_simulation=simulation, _frames=3, _advice=fast.unwrapped._advice, **others)

    driver, left = SimpleNamespace(follow=lambda asked, _: asked), iter(frames)
    own = env(_own=Command(), _driver=driver, _completed=lambda one: one, _is_measured=False)
    after = FogAdvisoryV1Env._drive(own, step)
    assert (after.time, fault(after)) == (frames[-1].time, "ego")
    task = {"reward_weights": RewardWeights(), "_standard": DEFAULT_STANDARD, "_show": lambda _: None}
    spaces = {"spec": None, "action_space": action_space(continuous=False), "_continuous": False}
    left = iter(frames)
    *_, info = AdvisingEnv.step(env(_step=step, **task, **spaces), NO_ADVICE)
    assert (info["collisions"], info["reward_terms"]["collision"]) == (1, -50.0)


def test_overdriving_and_conflicts_by_hand(step: Step) -> None:
    before = dataclasses.replace(_at(step, 20.0), command=Command())
    foggy = dataclasses.replace(before.truth, extinction=math.log(20.0) / 50.0, extinction_ahead=math.log(20.0) / 50.0)
    after = dataclasses.replace(_moved(before, 10.0, 0.5), truth=foggy, leader=Leader("a", 30.0, 5.0))
    terms = task_terms(before, after, WAY, WEIGHTS)
    needed = 20.0 * 2.5 + 20.0**2 / (2 * 3.4)
    assert terms["overdriving"] == pytest.approx(-150.0 * 10.0 / 2000.0 * (1.0 - 50.0 / needed), rel=1e-3)
    assert terms["conflict"] == pytest.approx(-2.0 * 0.5 * (1.0 - (30.0 / 15.0) / 3.0))
    # The rear fog lamp is rightly dark at 50 m or more, the front fog lamps are not lit though they should be.
    assert terms["front_fog_lamp"] < 0.0


def test_the_map_rides_along_as_a_channel_or_an_entry(step: Step) -> None:
    sign = SignSighting("a", "stop", 0.0, 30.0, -3.0, 0.9)
    seen = dataclasses.replace(step, observation=dataclasses.replace(step.observation, signs=(sign,)))
    camera = step.truth.camera
    channel = task_observation(seen, None, "camera+sign_map", Command(), 100.0, 500.0)
    assert task_space("camera+sign_map", camera).contains(channel)
    np.testing.assert_array_equal(channel[:, :, :3], step.observation.image)
    assert set(np.unique(channel[:, :, 3])) == {0, 225}
    whole = task_observation(seen, None, "dict+sign_map", Command(), 100.0, 500.0)
    assert task_space("dict+sign_map", camera).contains(whole)
    np.testing.assert_array_equal(whole["sign_map"][:, :, 1], channel[:, :, 3])


def test_version_2_drives_by_day_and_night_with_signs() -> None:
    env: Any = gymnasium.make(
        "fogsim/FogAdvisory-v2",
        fog_distribution=FogDistribution(visibility=(100.0, 100.0), clear_share=0.0, even_share=1.0),
        scenario_distribution=ScenarioDistribution(light={"night": 1.0}, scripts={"free": 1.0}),
        overrides=["actors.ego.position_m=450"],
    )
    valid, signs = 0, 0
    observation, _ = env.reset(seed=0)
    for _ in range(6):
        valid += int(observation["state"][9])
        signs += int(observation["signs_mask"].sum())
        observation, *_ = env.step([12, 0])
    env.close()
    assert valid >= 5
    assert signs >= 1


def test_the_observed_estimate_of_version_2_is_the_first_valid_one() -> None:
    silent, one, other = Estimate.invalid("a", "dark"), Estimate("b", 0.02, 0.002), Estimate("c", 0.03, 0.001)
    assert first_valid_estimate((silent, one, other)) is one
    assert first_valid_estimate((silent,)) is None
    assert leading_estimate((silent, one)) is silent


@pytest.mark.nightly
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("policy", ["rule", "fixed", "oracle"])
def test_returns_without_frames_are_those_with_frames(policy: str) -> None:
    """Version 2 with frames and without, in the same fog, light and traffic: means within each other's intervals."""
    alike: dict[str, Any] = {
        "fog_distribution": FAST_FOG,
        "scenario_distribution": FAST_SCENARIO,
        "observation": "state",
    }
    overrides = (*FAST_ROAD, "camera.width=160", "camera.height=120")
    real = fogsim_envs.evaluate(policy, "fogsim/FogAdvisory-v2", range(40), overrides=overrides, **alike)
    drawn = fogsim_envs.evaluate(policy, "fogsim/FogAdvisoryFast-v2", range(40))
    assert real.low <= drawn.mean <= real.high
    assert drawn.low <= real.mean <= drawn.high


def test_state_says_nothing_of_the_truth(step: Step) -> None:
    other = dataclasses.replace(step.truth, extinction=0.5, extinction_ahead=0.4)
    mine = task_state(step, leading_estimate(step.estimates), Command(), 100.0, 500.0)
    np.testing.assert_array_equal(
        mine,
        task_state(dataclasses.replace(step, truth=other), leading_estimate(step.estimates), Command(), 100.0, 500.0),
    )
    told = dict(zip(STATE_FEATURES, mine.tolist(), strict=True))
    assert told["speed_limit"] == pytest.approx(130.0 / 3.6 / 25.0 - 1.0, rel=1e-4)
    assert told["distance_to_go"] == pytest.approx(500.0 / 2500.0 - 1.0)
    assert told["lanes"] in (pytest.approx(0.4), pytest.approx(0.6))
    belief = [told[f"belief_{name}"] for name in ("5_percent", "25_percent", "median", "75_percent", "95_percent")]
    assert belief == sorted(belief)
    assert told["ambient_light"] == pytest.approx(
        math.log10(step.observation.light.illuminance) / 3.0 - 2.0 / 3.0, abs=1e-6
    )
    sensorless = dataclasses.replace(step, observation=dataclasses.replace(step.observation, light=None))
    assert task_state(sensorless, None, Command(), 100.0, 500.0)[-1] == 1.0
    known = [STATE_FEATURES.index(name) for name in AGENT_STATE]
    np.testing.assert_array_equal(mine[known], clipped(agent_state(step.observation, step.belief)))
    assert [scaled_visibility(one) for one in (0.0, 10.0, 100.0, 1000.0, math.inf)] == [-1.0, -1.0, 0.0, 1.0, 1.0]


def test_without_frames_the_road_is_drawn_from_above(fast: gymnasium.Env[Any, Any]) -> None:
    fast.reset(seed=3)
    picture = fast.render()
    assert picture.shape == (480, 1024, 3)
    assert picture.std() > 5.0
