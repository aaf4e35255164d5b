"""Evaluation of policies, whatever the shape of ``info``, and what it refuses."""

import json
import sys
import threading
from typing import Any, ClassVar

import gymnasium
import pytest

import fogsim_envs
from fogsim.errors import InputError
from fogsim_envs.advisory import FogAdvisoryEnv
from fogsim_envs.baselines import baseline
from fogsim_envs.task import TaskWeights

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
        (gymnasium.wrappers.TimeLimit(FogAdvisoryEnv(), 2), "expected version 1 or later"),
    ]:
        with pytest.raises(InputError, match=f"env_id: {message}"):
            fogsim_envs.evaluate("none", env, [0])


class Drive(gymnasium.Env[Any, Any]):
    """Two steps; in the first the ego strikes somebody, and drives on."""

    observation_space = action_space = gymnasium.spaces.Discrete(2)

    def reset(self, **_: Any) -> tuple[int, dict[str, Any]]:
        self._faults = ["", "ego"]
        return 0, {}

    def step(self, _: Any) -> tuple[int, float, bool, bool, dict[str, Any]]:
        fault = self._faults.pop()
        return 0, 1.0, not self._faults, False, {"fault": fault, "metrics": {"least_gap_m": float("nan")}}


class Foggy(Drive):
    """A drive in which only time is paid for."""

    action_space = gymnasium.spaces.Discrete(39)
    reward_weights = TaskWeights(overdriving=0.0)

    def __init__(self) -> None:
        self.actions: list[int] = []

    def reset(self, **options: Any) -> tuple[int, dict[str, Any]]:
        return super().reset(**options)[0], self._seen

    def step(self, action: Any) -> tuple[int, float, bool, bool, dict[str, Any]]:
        self.actions.append(int(action))
        state, reward, terminated, truncated, info = super().step(action)
        return state, reward, terminated, truncated, info | self._seen

    _seen: ClassVar = {"truth": {"visibility_m": 200.0, "visibility_ahead_m": 40.0}, "speed_limit_mps": 36.0}


def test_the_oracle_goes_by_the_weights_of_the_reward() -> None:
    env = Foggy()
    fogsim_envs.evaluate("oracle", env, [0])
    env.reward_weights = TaskWeights()
    fogsim_envs.evaluate("oracle", env, [0])
    freely, carefully = env.actions[0], env.actions[-1]
    assert (freely, carefully < freely) == (3 * 12, True)


def test_a_baseline_of_other_actions_is_refused() -> None:
    for space in (gymnasium.spaces.Discrete(6), gymnasium.spaces.Box(0.0, 1.0, (2,))):
        env = Foggy()
        env.action_space = space
        with pytest.raises(InputError, match=r"policy: .* of fogsim/FogAdvisory, one of Discrete\(39\), .* got 'rule'"):
            fogsim_envs.evaluate("rule", env, [0])


def test_chance_needs_no_signs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "fogsim_envs.corridor.baselines", None)
    policy = baseline("random", gymnasium.spaces.Discrete(18))
    policy.reset(3)
    assert {int(policy(None, {})) for _ in range(200)} == set(range(18))


def test_who_strikes_somebody_and_drives_on_has_struck() -> None:
    assert fogsim_envs.evaluate(lambda *_: 0, Drive(), [0]).struck == 1.0


def test_an_evaluation_is_json_whatever_is_undefined() -> None:
    written = fogsim_envs.evaluate(lambda *_: 0, Drive(), [0]).as_json()
    (episode,) = json.loads(written, parse_constant=pytest.fail)["episodes"]
    assert (episode["value"], episode["time"], episode["metrics"]) == (2.0, None, {"least_gap_m": None})


def test_arguments_are_refused_for_an_environment_that_is_there() -> None:
    with pytest.raises(InputError, match="seed, split: only an environment that is made here, by its id, takes"):
        fogsim_envs.evaluate("random", Drive(), seed=[3], split="test")


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
