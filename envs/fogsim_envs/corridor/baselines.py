"""Policies of one message sign to compare agents with; all signs follow the same one, each on its observation."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from fogsim.core.registry import Registry
from fogsim.units import KMH_PER_MPS
from fogsim_envs.corridor.observation import SHOWN_SPEEDS

DARK = len(SHOWN_SPEEDS) - 1
"""Level that shows nothing."""

_SAME_SPEED = 1e-6
"""Speeds that differ by less are the same [m/s]."""


def level_of(speed: float) -> int:
    """Level that shows a speed, or the next lower one (`speed` [m/s])."""
    below = [level for level, shown in enumerate(SHOWN_SPEEDS[:DARK]) if shown <= speed + _SAME_SPEED]
    return DARK if math.isinf(speed) else max(below, default=0)


class SignPolicy:
    """A policy of one sign that remembers nothing."""

    def __init__(self, choose: Callable[[Mapping[str, Any]], int]) -> None:
        self._choose = choose

    def reset(self, seed: int) -> None:
        """Do nothing: there is nothing to forget; see `fogsim_envs.baselines.Policy.reset`."""

    def __call__(self, observation: Any, info: Mapping[str, Any]) -> NDArray[Any]:  # noqa: ARG002 - the protocol's
        """Choose; see `fogsim_envs.baselines.Policy`."""
        return np.array(self._choose(info))


class RandomSign:
    """Any level, as likely as any other."""

    def __init__(self, action_space: spaces.Discrete) -> None:
        self._levels = int(action_space.n)
        self.reset(0)

    def reset(self, seed: int) -> None:
        """Begin the numbers of an episode; see `fogsim_envs.baselines.Policy.reset`."""
        self._rng = np.random.default_rng(seed)

    def __call__(self, observation: Any, info: Mapping[str, Any]) -> NDArray[Any]:  # noqa: ARG002 - the protocol's
        """Choose; see `fogsim_envs.baselines.Policy`."""
        return np.array(self._rng.integers(self._levels))


def _fixed(action_space: spaces.Discrete) -> SignPolicy:  # noqa: ARG001 - as the others are made
    return SignPolicy(lambda _: level_of(60.0 / KMH_PER_MPS))


def _none(action_space: spaces.Discrete) -> SignPolicy:  # noqa: ARG001 - as the others are made
    return SignPolicy(lambda _: DARK)


def _rule(action_space: spaces.Discrete) -> SignPolicy:  # noqa: ARG001 - as the others are made
    return SignPolicy(lambda info: level_of(info["built_in_advice_mps"]))


SIGN_BASELINES: Registry[Callable[..., SignPolicy | RandomSign]] = Registry(
    "baseline of FogCorridor", {"none": _none, "fixed": _fixed, "rule": _rule, "random": RandomSign}
)
"""Baselines by name: dark signs, 60 km/h, what the scenario's adviser says by a meter without errors, and chance."""
