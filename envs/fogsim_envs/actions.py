"""Actions as they come, taken as members of a space or refused by name."""

from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from fogsim.errors import InputError

ActionSpace = spaces.Discrete | spaces.MultiDiscrete | spaces.Box


def checked_action(action: object, space: spaces.Space[Any], name: str) -> NDArray[Any]:
    """An action as an array of its space's shape and type.

    Members are taken as libraries give them: numbers, lists and tuples, and arrays of any type of numbers, as far as
    nothing is lost (3.0 is a level, 3.5 is none).

    Parameters
    ----------
    action : array_like
        What came.
    space : gymnasium.spaces.Discrete or MultiDiscrete or Box
        The space of actions.
    name : str
        Whose action it is: the id of the environment, or the agent.

    Returns
    -------
    ndarray
        Of the space's shape and type: () for a `Discrete`. It is the caller's own.

    Raises
    ------
    InputError
        If it is no member of the space: of another shape, no number, NaN, or outside the limits.
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
        if not isinstance(space, spaces.Box) and (given != np.rint(given)).any():
            raise _refusal(action, space, name, "expected whole numbers")
    lowest, highest = _limits(space)
    # Whole numbers are compared as they came, as a short type would wrap; others as the space rounds them.
    member = given.astype(space.dtype) if isinstance(space, spaces.Box) else given
    if (member < lowest).any() or (member > highest).any():
        raise _refusal(action, space, name, f"expected {lowest.tolist()} to {highest.tolist()}")
    return given.astype(space.dtype)


def _numbers(action: object) -> NDArray[Any] | None:
    """What came as an array; None if it does not hold numbers."""
    try:
        given = np.asarray(action)
    except (TypeError, ValueError):
        return None
    return given if given.dtype.kind in "iuf" else None


def _limits(space: ActionSpace) -> tuple[NDArray[Any], NDArray[Any]]:
    """Lowest and highest member, entry by entry."""
    if isinstance(space, spaces.Box):
        return space.low, space.high
    first = np.asarray(space.start)
    count = space.n if isinstance(space, spaces.Discrete) else space.nvec
    return first, first + np.asarray(count) - 1


def _refusal(action: object, space: spaces.Space[Any], name: str, why: str) -> InputError:
    return InputError(f"action of {name}: no member of {space}: {why}; got {action!r}")
