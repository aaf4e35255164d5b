"""What rewards judge by."""

from typing import Any

import gymnasium
import numpy as np
import pytest

import fogsim
from fogsim.errors import InputError
from fogsim_envs.rewards import RewardWeights, advice_standard
from fogsim_envs.task import TaskWeights


def test_rewards_judge_by_what_the_scenarios_advice_counts_with() -> None:
    own = "{method: stopping_sight_distance, parameters: {reaction_time: 1.5, deceleration: 4.5}}"
    for advice, expected in ((own, (1.5, 4.5)), ("stopping_sight_distance", (2.5, 3.4)), ("none", (2.5, 3.4))):
        standard = advice_standard(fogsim.load_scenario("motorway_fog_bank", [f"advice={advice}"]))
        assert (standard.reaction_time, standard.deceleration) == expected


def test_weights_may_change_while_an_agent_learns() -> None:
    made: list[tuple[Any, Any, Any]] = [
        (
            gymnasium.make_vec("fogsim/FogAdvisoryBatch-v2", num_envs=2),
            np.array([[12, 0]] * 2),
            TaskWeights(progress=0.0),
        ),
        (gymnasium.make("fogsim/FogAdvisoryFast-v2"), [12, 0], TaskWeights(progress=0.0)),
        (gymnasium.make("fogsim/FogAdvisory-v0", image_size=(32, 16)), [12, 0], RewardWeights(progress=0.0)),
    ]
    for envs, action, weights in made:
        envs.reset(seed=1)
        for expected in (True, False):
            assert np.any(envs.step(action)[4]["reward_terms"]["progress"]) == expected
            envs.unwrapped.reward_weights = weights
        with pytest.raises(
            InputError, match=f"reward_weights: expected {type(weights).__name__}, got {{'progress': 0}}"
        ):
            envs.unwrapped.reward_weights = {"progress": 0}
        envs.close()
