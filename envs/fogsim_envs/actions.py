"""Actions and options of `reset` as they come: taken as what they are to be, or refused by name."""

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from fogsim.core.parameters import parameter_mistakes
from fogsim.errors import InputError, shown

T = TypeVar("T")

ActionSpace = spaces.Discrete | spaces.MultiDiscrete | spaces.Box


def checked_action(action: object, space: spaces.Space[Any], name: str) -> NDArray[Any]:
    """An action as an array of its space's shape and type, the caller's own.

    Members are taken as libraries give them: numbers, lists and tuples, and arrays of any type of numbers, as far as
    nothing is lost (3.0 is a level, 3.5 is none).
    """
    if not isinstance(space, ActionSpace):
        raise InputError(f"action of {name}: {space} has no check; expected a Discrete, MultiDiscrete or Box")
    given = _numbers(action)
    if given is None:
        raise _refusal(action, space, name, "expected numbers")
    if given.shape != space.shape:
        raise _refusal(action, space, name, f"expected the shape {space.shape}, got {given.shape}")
    if given.dtype.kind == "f":
        if not np.isfinite(given).all():
            raise _refusal(action, space, name, "expected finite numbers")
        if np.dtype(space.dtype).kind != "f" and (given != np.rint(given)).any():
            raise _refusal(action, space, name, "expected whole numbers")
    if not _is_within(given, space):
        lowest, highest = _limits(space)
        raise _refusal(action, space, name, f"expected {lowest.tolist()} to {highest.tolist()}")
    return given.astype(space.dtype)


def checked_options(kind: Callable[..., T], given: Mapping[str, Any] | None) -> T:
    """Options of ``reset`` as one value."""
    known = {} if given is None else given
    mistakes = [f"options[{name!r}]: {mistake}" for name, mistake in parameter_mistakes(kind, known, classes=True)]
    if mistakes:
        raise InputError("reset(): " + "; ".join(mistakes))
    return kind(**known)


def _numbers(action: object) -> NDArray[Any] | None:
    """What came as an array; None if it does not hold numbers."""
    try:
        given = np.asarray(action)
    except (TypeError, ValueError):
        return None
    return given if given.dtype.kind in "iuf" else None


def _is_within(given: NDArray[Any], space: ActionSpace) -> bool:
    """Whether finite numbers of the space's shape are within its limits."""
    if isinstance(space, spaces.Box):
        # Compared as the space rounds them.
        member = given.astype(space.dtype)
        return bool((member >= space.low).all() and (member <= space.high).all())
    # Few whole numbers, compared as they came: a short type would wrap.
    count = space.n if isinstance(space, spaces.Discrete) else space.nvec
    limits = zip(np.ravel(space.start).tolist(), np.ravel(count).tolist(), strict=True)
    return all(0 <= one - first < number for one, (first, number) in zip(given.ravel().tolist(), limits, strict=True))


def _limits(space: ActionSpace) -> tuple[NDArray[Any], NDArray[Any]]:
    """Lowest and highest member, entry by entry."""
    if isinstance(space, spaces.Box):
        return space.low, space.high
    first = np.asarray(space.start)
    count = space.n if isinstance(space, spaces.Discrete) else space.nvec
    return first, first + np.asarray(count) - 1


def _refusal(action: object, space: spaces.Space[Any], name: str, why: str) -> InputError:
    return InputError(f"action of {name}: no member of {space}: {why}; got {shown(action)}")
