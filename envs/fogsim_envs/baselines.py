"""Policies to compare an agent with: nothing, one speed, FogSim's own rule, what knows the truth, and chance."""

import copy
import math
from collections.abc import Callable, Mapping
from typing import Any, Protocol

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from fogsim.core.kinematics import stopping_sight_distance
from fogsim.core.registry import Registry, make
from fogsim.errors import InputError
from fogsim.metrics import DEFAULT_STANDARD
from fogsim.units import KMH_PER_MPS
from fogsim.values import Lamp
from fogsim_envs.infos import numbers_of
from fogsim_envs.spaces import ACTION_LEVELS, ADVISED_SPEEDS, LAMP_MODES, action_of, action_space
from fogsim_envs.task.drive import FogDriveEnv
from fogsim_envs.task.rewards import FRONT_FOG_LAMP_VISIBILITY, REAR_FOG_LAMP_VISIBILITY, TaskWeights

Info = Mapping[str, Any]


class Policy(Protocol):
    """Chooses actions."""

    def __call__(self, observation: Any, info: Info) -> NDArray[Any]:
        """Choose the next action."""

    def reset(self, seed: int) -> None:
        """Forget earlier episodes."""


class _Unremembering:
    """A policy that remembers nothing, in an action space of advice and lamps."""

    def __init__(self, action_space: spaces.Space[Any]) -> None:
        self._space = action_space

    def reset(self, seed: int) -> None:
        """Do nothing: there is nothing to forget; see `Policy.reset`."""

    def action(self, speed: float, lamps: Lamp) -> NDArray[Any]:
        """The action nearest to an advice, not above it, with lamps (`speed` [m/s])."""
        action = action_of(speed, lamps, isinstance(self._space, spaces.Box))
        is_flat = isinstance(self._space, spaces.Discrete)
        return np.asarray(np.ravel_multi_index(tuple(action), ACTION_LEVELS)) if is_flat else action


class NoAdvice(_Unremembering):
    """Advise nothing, with dipped head lamps: what happens when drivers are left alone."""

    def __call__(self, observation: Any, info: Info) -> NDArray[Any]:  # noqa: ARG002 - the protocol's parameters
        """Choose; see `Policy`."""
        return self.action(math.inf, LAMP_MODES[0])


class FixedSpeed(_Unremembering):
    """Advise one speed always (`speed` [m/s])."""

    def __init__(self, action_space: spaces.Space[Any], speed: float = 50.0 / KMH_PER_MPS) -> None:
        super().__init__(action_space)
        self._speed = speed

    def __call__(self, observation: Any, info: Info) -> NDArray[Any]:  # noqa: ARG002 - the protocol's parameters
        """Choose; see `Policy`."""
        return self.action(self._speed, LAMP_MODES[0])


class _BuiltInRule(_Unremembering):
    """What the scenario's own adviser and lighting policy say, by the belief in the loop."""

    def __call__(self, observation: Any, info: Info) -> NDArray[Any]:  # noqa: ARG002 - the protocol's parameters
        """Choose; see `Policy`."""
        return self.action(info["built_in_advice_mps"], Lamp(info["built_in_lamps"]))


class _Oracle(_Unremembering):
    """Knows the sight ahead and minimises the reward's cost a metre; blind to what others will do: no upper bound."""

    def __init__(self, action_space: spaces.Space[Any], weights: TaskWeights | None = None) -> None:
        super().__init__(action_space)
        self._weights = weights or TaskWeights()

    def __call__(self, observation: Any, info: Info) -> NDArray[Any]:  # noqa: ARG002 - the protocol's parameters
        """Choose; see `Policy`."""
        truth, limit = numbers_of(info, "truth"), info["speed_limit_mps"]
        speeds = [*(speed for speed in ADVISED_SPEEDS if speed < limit), limit]
        # Off the lanes there is no limit, and no way to drive.
        sight, moves = truth["visibility_ahead_m"], math.isfinite(limit)
        best = min(speeds, key=lambda speed: self._cost(speed, sight, limit)) if moves else limit
        lamps = LAMP_MODES[0]
        if truth["visibility_m"] < FRONT_FOG_LAMP_VISIBILITY:
            lamps |= Lamp.FRONT_FOG
        if truth["visibility_m"] < REAR_FOG_LAMP_VISIBILITY:
            lamps |= Lamp.REAR_FOG
        return self.action(math.inf if best == limit else best, lamps)

    def _cost(self, speed: float, sight: float, limit: float) -> float:
        """Cost of the way at one speed [points]."""
        standard = DEFAULT_STANDARD
        needed = stopping_sight_distance(speed, standard.reaction_time, standard.deceleration)
        return self._weights.time * limit / speed + self._weights.overdriving * max(0.0, 1.0 - sight / needed)


class _RandomActions:
    """Any action, as likely as any other."""

    def __init__(self, action_space: spaces.Space[Any]) -> None:
        # Episodes of a batch have one space, and each has numbers of its own.
        self._space = copy.deepcopy(action_space)

    def reset(self, seed: int) -> None:
        """Begin the numbers of an episode; see `Policy.reset`."""
        self._space.seed(seed)

    def __call__(self, observation: Any, info: Info) -> NDArray[Any]:  # noqa: ARG002 - the protocol's parameters
        """Choose; see `Policy`."""
        return np.asarray(self._space.sample())


BASELINES: Registry[Callable[..., Policy]] = Registry(
    "baseline",
    {"none": NoAdvice, "fixed": FixedSpeed, "rule": _BuiltInRule, "oracle": _Oracle, "random": _RandomActions},
)
"""Baselines by name."""


def baseline(name: str, action_space: spaces.Space[Any], weights: TaskWeights | None = None) -> Policy:
    """Make a baseline for an environment that pays by some weights."""
    known = {"weights": weights} if name == "oracle" else {}
    return make(BASELINES, name, action_space, **known)


def reward_weights(env: Any) -> TaskWeights | None:
    """Weights by which an environment or a batch pays; None where they are not the task's."""
    weights = getattr(env.unwrapped, "reward_weights", None)
    return weights if isinstance(weights, TaskWeights) else None


_ADVISING = (spaces.Discrete(math.prod(ACTION_LEVELS)), action_space(continuous=False), action_space(continuous=True))
"""Spaces of advice and lamps."""


def check_baseline(name: str, env: gymnasium.Env[Any, Any]) -> None:
    """Refuse a baseline that advises speeds where the agent does something else, or by other numbers."""
    if name == "random":
        return
    if isinstance(env.unwrapped, FogDriveEnv):
        raise InputError(
            f"policy: the agent of FogDrive drives, and baselines other than 'random' advise speeds; got {name!r}"
        )
    if env.action_space not in _ADVISING:
        raise InputError(
            "policy: baselines other than 'random' take the actions of fogsim/FogAdvisory, one of "
            f"{', '.join(map(str, _ADVISING))}; got {name!r} for {env.action_space}"
        )
