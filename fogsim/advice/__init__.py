"""Belief to advised speed."""

from collections.abc import Callable

from fogsim.advice.protocol import Adviser
from fogsim.advice.sight_distance import FixedSpeed, NoAdvice, StoppingSightDistance
from fogsim.registry import Registry

ADVISERS: Registry[Callable[..., Adviser]] = Registry(
    "adviser", {"stopping_sight_distance": StoppingSightDistance, "fixed_speed": FixedSpeed, "none": NoAdvice}
)

__all__ = ["ADVISERS", "Adviser", "FixedSpeed", "NoAdvice", "StoppingSightDistance"]
