"""Evaluation of policies, whatever the shape of ``info``, and what it refuses."""

import threading
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


def test_a_policy_with_a_memory_that_cannot_be_copied_is_refused_in_a_batch() -> None:
    class Locked:
        def __init__(self) -> None:
            self.lock = threading.Lock()

        def reset(self, seed: int) -> None: ...

        def __call__(self, observation: Any, info: Any) -> Any: ...

    with pytest.raises(InputError, match=r"policy: .* Locked cannot be copied: "):
        fogsim_envs.evaluate(Locked(), "fogsim/FogAdvisoryBatch-v2", seeds=[0, 1])
