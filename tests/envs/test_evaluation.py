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
