"""Many environments at once, each in a process of its own."""

import functools
import sys
from collections.abc import Mapping
from typing import Any

import gymnasium
from gymnasium.vector import AsyncVectorEnv


def make_vector(num_envs: int = 1, **kwargs: Any) -> AsyncVectorEnv:
    """Make a vector environment for `gymnasium.make_vec`, which by itself would put all of them into one process.

    Parameters
    ----------
    num_envs : int
        How many.
    **kwargs
        Arguments of each environment.
    """
    return _workers("fogsim_envs:fogsim/FogAdvisory-v0", num_envs, kwargs)


def make_highway_vector(num_envs: int = 1, **kwargs: Any) -> AsyncVectorEnv:
    """Make a vector environment of ``fogsim/FogHighway-v0``, as `make_vector` does of the other."""
    return _workers("fogsim_envs:fogsim/FogHighway-v0", num_envs, kwargs)


def _workers(environment: str, num_envs: int, arguments: Mapping[str, Any]) -> AsyncVectorEnv:
    make = functools.partial(gymnasium.make, environment, **arguments)
    # A GL context does not survive a fork: where one may exist, workers start from a clean server process.
    context = "forkserver" if "OpenGL" in sys.modules else None
    return AsyncVectorEnv([make] * num_envs, context=context)
