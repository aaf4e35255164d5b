"""Evaluation of policies, whatever the shape of ``info``, and what it refuses."""

from typing import Any

import gymnasium
import pytest

import fogsim_envs
from fogsim.errors import InputError

FAST = "fogsim/FogAdvisoryFast-v2"


def test_a_flat_info_gives_the_same_evaluation() -> None:
    for policy in ("oracle", "rule"):
        nested, flat = (fogsim_envs.evaluate(policy, FAST, [0], flat_info=one) for one in (False, True))
        assert flat.mean == nested.mean
        assert flat.metrics == nested.metrics != {}


def test_what_evaluate_cannot_run_is_refused() -> None:
    batch: Any = gymnasium.make_vec("fogsim/FogAdvisoryBatch-v2", num_envs=2)
    for env, message in [
        (batch, "expected an id, a gymnasium.Env or a pettingzoo.ParallelEnv"),
        ("fogsim_envs:fogsim/FogHighway-v0", "expected version 1 or later"),
    ]:
        with pytest.raises(InputError, match=f"env_id: {message}"):
            fogsim_envs.evaluate("none", env, [0])


class Sign:
    """A corridor of one sign and one period, in which vehicles collide."""

    possible_agents = agents = ("sign_0",)

    def action_space(self, _: str) -> gymnasium.spaces.Discrete:
        return gymnasium.spaces.Discrete(6)

    def reset(self, **_: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        return {"sign_0": None}, {"sign_0": {}}

    def step(self, _: Any) -> tuple[dict[str, Any], ...]:
        self.agents = ()
        return {"sign_0": None}, {"sign_0": 0.0}, {}, {}, {"sign_0": {"reward_terms/collision": 0.0, "collisions": 1.0}}


def test_a_collision_counts_whatever_its_weight() -> None:
    assert fogsim_envs.evaluate("none", Sign(), [0]).struck == 1.0
