"""Many environments at once, each in a process of its own."""

import contextlib
import functools
import multiprocessing
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import gymnasium
from gymnasium.vector import AsyncVectorEnv
from gymnasium.vector.async_vector_env import AsyncState

from fogsim.errors import SimulationError
from fogsim_envs.hosting import checked_timeout

TIMEOUT = 600.0
"""How long one step or reset of all may take unless something else is asked for [s]; the first may compile kernels."""

_CLOSE_TIMEOUT = 10.0


def make_vector(num_envs: int = 1, timeout: float = TIMEOUT, **kwargs: Any) -> AsyncVectorEnv:
    """Make a vector environment for `gymnasium.make_vec`, which by itself would put all of them into one process.

    Parameters
    ----------
    num_envs : int
        How many.
    timeout : float
        How long one step or reset of all may take [s], more than 0; ``inf`` for ever. Then all are ended with a
        `SimulationError`.
    **kwargs
        Arguments of each environment.
    """
    return _workers("fogsim_envs:fogsim/FogAdvisory-v0", num_envs, timeout, kwargs)


def make_highway_vector(num_envs: int = 1, timeout: float = TIMEOUT, **kwargs: Any) -> AsyncVectorEnv:
    """Make a vector environment of ``fogsim/FogHighway-v0``, as `make_vector` does of the other.

    Parameters
    ----------
    num_envs : int
        How many.
    timeout : float
        As of `make_vector` [s].
    **kwargs : object
        Arguments of each environment.
    """
    return _workers("fogsim_envs:fogsim/FogHighway-v0", num_envs, timeout, kwargs)


def _workers(environment: str, num_envs: int, timeout: float, arguments: Mapping[str, Any]) -> AsyncVectorEnv:
    make = functools.partial(gymnasium.make, environment, **arguments)
    # A GL context does not survive a fork: where one may exist, workers start from a clean server process.
    context = "forkserver" if "OpenGL" in sys.modules else None
    return _Workers([make] * num_envs, checked_timeout(timeout), context)


class _Workers(AsyncVectorEnv):
    """Gymnasium's own, which by itself waits for ever for a worker that is stopped.

    Parameters
    ----------
    makers : sequence of callable
        Make one environment each.
    timeout : float or None
        How long a step or reset of all may take [s]; None for ever.
    context : str or None
        How workers are started.
    """

    def __init__(
        self, makers: Sequence[Callable[[], gymnasium.Env[Any, Any]]], timeout: float | None, context: str | None
    ) -> None:
        self._timeout = timeout
        super().__init__(makers, context=context)

    def reset(self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None) -> Any:
        """Begin an episode in each; see `AsyncVectorEnv.reset`."""
        with self._limited():
            self.reset_async(seed=seed, options=options)
            return self.reset_wait(self._timeout)

    def step(self, actions: Any) -> Any:
        """Step each; see `AsyncVectorEnv.step`."""
        with self._limited():
            self.step_async(actions)
            return self.step_wait(self._timeout)

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Call a method of each; see `AsyncVectorEnv.call`."""
        with self._limited():
            self.call_async(name, *args, **kwargs)
            return self.call_wait(self._timeout)

    @contextlib.contextmanager
    def _limited(self) -> Iterator[None]:
        try:
            yield
        except multiprocessing.TimeoutError as error:
            self._abandon()
            raise SimulationError(
                f"the environments have not answered for {self._timeout:g} s, and were ended: one of their processes "
                "was stopped, or they need longer; the time is set by timeout=…"
            ) from error
        except (EOFError, BrokenPipeError, ConnectionResetError) as error:
            self._abandon()
            raise SimulationError("a process that ran an environment has ended; the others were ended, too") from error

    def _abandon(self) -> None:
        self.close(terminate=True)

    def close_extras(self, timeout: float | None = None, terminate: bool = False) -> None:
        """End the processes, those that do not answer by force; see `AsyncVectorEnv.close_extras`."""
        self._state = AsyncState.DEFAULT
        end = time.monotonic() + (0.0 if terminate else _CLOSE_TIMEOUT if timeout is None else timeout)
        for pipe in self.parent_pipes if not terminate else ():
            if pipe is not None:
                with contextlib.suppress(OSError):
                    pipe.send(("close", None))
        for process in self.processes:
            process.join(max(end - time.monotonic(), 0.0))
            # A stopped process would not take a mere request to end.
            process.kill()
            process.join()
        for pipe in self.parent_pipes:
            if pipe is not None:
                pipe.close()
