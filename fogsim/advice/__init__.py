"""Belief to advised speed."""

from collections.abc import Callable

from fogsim.advice.protocol import Adviser
from fogsim.advice.sight_distance import NoAdvice, StoppingSightDistance
from fogsim.registry import Registry

ADVISERS: Registry[Callable[..., Adviser]] = Registry(
    "adviser", {"stopping_sight_distance": StoppingSightDistance, "none": NoAdvice}
)

__all__ = ["ADVISERS", "Adviser", "NoAdvice", "StoppingSightDistance"]
