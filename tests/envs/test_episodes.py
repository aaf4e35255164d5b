"""Episodes that are drawn: repeated, and of splits."""

import copy
import json
from typing import Any

import gymnasium
import numpy as np
import pytest

from fogsim.errors import InputError, LeftOutWarning
from fogsim.scenario import Scenario, catalogue, load_scenario
from fogsim_envs.batch import RuleConstants
from fogsim_envs.rewards import RewardWeights
from fogsim_envs.task import FogDistribution, ScenarioDistribution, TaskWeights
from fogsim_envs.task.sampling import MOTORWAY, EpisodeChoice, EpisodeSource


def test_a_repeated_episode_is_of_the_same_scenario() -> None:
    scenarios = [load_scenario(MOTORWAY, [f"duration_s={10 + i}"]) for i in range(8)]
    source, rng = EpisodeSource(None, scenarios, None, (), "train"), np.random.default_rng(0)
    seed, drawn = source.draw(rng, EpisodeChoice())
    # A vector environment has an array of seeds.
    for given in (seed, np.int64(seed)):
        again, repeated = source.draw(rng, EpisodeChoice(episode={**drawn.episode.as_info(), "seed": given}))
        assert (again, repeated.scenario) == (seed, drawn.scenario)
        assert json.loads(json.dumps(repeated.episode.as_info()))["seed"] == seed


def test_numpys_numbers_draw_the_same_episodes() -> None:
    def drawn(number: Any, scenario: str | None) -> Scenario:
        fog = None if scenario else FogDistribution(bank_length=(number, number), clear_share=0.0, even_share=0.0)
        scenes = (
            ScenarioDistribution(pitch_error=number / 1024, focal_length_error=number / 1024)
            if scenario is None
            else None
        )
        source = EpisodeSource(scenario, scenes, fog, (), "train")
        return source.draw(np.random.default_rng(0), EpisodeChoice(visibility=number))[1].scenario

    for scenario in (None, "clear_day"):
        expected = drawn(2.0, scenario)
        assert all(drawn(one(2), scenario) == expected for one in (np.float64, np.float32, np.int64))


def test_cases_that_are_left_out_are_named() -> None:
    source = EpisodeSource("patchy_fog", None, None, (), "train")
    with pytest.warns(LeftOutWarning, match=r"strength=0.4,run=0 is the first of 4 cases; vary\.NAME=\[VALUE\]"):
        assert source.first_scenario() == load_scenario("patchy_fog")
    EpisodeSource("patchy_fog", None, None, ("vary={strength: [0.7], run: 1 seed}",), "train").first_scenario()


def test_splits_share_no_seed() -> None:
    drawn = {}
    for split in ("train", "test"):
        source, rng = EpisodeSource(MOTORWAY, None, None, (), split), np.random.default_rng(0)
        drawn[split] = {source.draw(rng, EpisodeChoice())[0] for _ in range(100)}
    assert not drawn["train"] & drawn["test"]
    with pytest.raises(InputError, match="unknown split"):
        EpisodeSource(None, None, None, (), "validation")


def test_distributions_survive_the_json_of_a_specification() -> None:
    given = {
        "fog_distribution": FogDistribution(clear_share=0.5),
        "scenario_distribution": ScenarioDistribution(lanes=(2,)),
        "reward_weights": TaskWeights(),
    }
    spec = copy.copy(gymnasium.spec("fogsim/FogAdvisoryFast-v1"))  # the registry's own is that of all tests
    spec.kwargs = given
    read = type(spec).from_json(spec.to_json())
    source = gymnasium.make(read).unwrapped._source
    assert (source._given_fog, source._scenes) == (given["fog_distribution"], given["scenario_distribution"])
    batch = gymnasium.make_vec("fogsim/FogAdvisoryBatch-v2", num_envs=2, rule=RuleConstants(0.05, hold=1.0))
    again = gymnasium.make_vec(type(spec).from_json(batch.spec.to_json()))
    assert again.unwrapped._rule == batch.unwrapped._rule


def test_paths_survive_the_json_of_an_environment() -> None:
    file = catalogue()["motorway_fog_bank"]
    for given in ({"scenario": file}, {"scenario_distribution": [file], "image_size": None}):
        env = gymnasium.make("fogsim/FogAdvisoryFast-v2", **given)
        again = gymnasium.make(type(env.spec).from_json(env.spec.to_json()))
        assert again.unwrapped._source._scenarios == (str(file),)
        assert copy.deepcopy(env).spec == env.spec
    env = gymnasium.make("fogsim/FogAdvisory-v0", scenario=file, reward_weights=RewardWeights(progress=2.0))
    again = gymnasium.make(type(env.spec).from_json(env.spec.to_json()))
    assert again.unwrapped.reward_weights == RewardWeights(progress=2.0)


def test_what_may_be_drawn_may_be_arrays() -> None:
    arrays: Any = {"lanes": np.array([2, 3]), "demand": np.array([300.0])}
    both = ScenarioDistribution(lanes=(2, 3), demand=(300.0,)), ScenarioDistribution(**arrays)
    assert len({one.draw(np.random.default_rng(1)) for one in both}) == 1


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: FogDistribution(visibility=(100.0, 50.0)), "FogDistribution.visibility"),
        (lambda: ScenarioDistribution(light={"noon": 1.0}), "unknown name 'noon'"),
        (lambda: ScenarioDistribution(scripts={"lead": 0.0}), "not all 0"),
        (lambda: ScenarioDistribution(lanes=()), "at least one"),
    ],
)
def test_distributions_that_are_none(make: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()
