"""Many environments at once, each in a process of its own; the loss of a process is reported.

`gymnasium.make_vec` runs all of them one after another (``vectorization_mode="sync"``) or in processes (``"async"``);
there a process that is killed shows as a bare ``BrokenPipeError``, and one that stands still is waited for for ever.
"""

import contextlib
import functools
import importlib
import multiprocessing
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Annotated, Any, Literal

import gymnasium
from gymnasium.vector import AsyncVectorEnv
from gymnasium.vector.async_vector_env import AsyncState

from fogsim.core.parameters import Range, checked_parameters
from fogsim.errors import SimulationError
from fogsim_envs.hosting import Timeout, checked_timeout

_TIMEOUT = 600.0
"""How long one step or reset of all may take unless something else is asked for [s]; the first may compile kernels."""

_CLOSE_TIMEOUT = 10.0


@checked_parameters
def make_vector(
    id: str = "fogsim/FogAdvisory-v0",  # noqa: A002 - as of `gymnasium.make_vec`
    num_envs: Annotated[int, Range(1, 10_000)] = 1,
    timeout: Timeout = _TIMEOUT,
    *,
    wrappers: Sequence[Callable[[gymnasium.Env[Any, Any]], gymnasium.Env[Any, Any]]] = (),
    context: Literal["fork", "spawn", "forkserver"] | None = None,
    **kwargs: Any,
) -> AsyncVectorEnv:
    """Make a vector environment that reports lost processes, unlike `gymnasium.make_vec` in its mode ``async``.

    Takes `timeout` [s].
    """
    limit, make = checked_timeout(timeout), functools.partial(_wrapped, id, tuple(wrappers), kwargs)
    # A GL context does not survive a fork.
    context = context or ("forkserver" if "OpenGL" in sys.modules else None)
    return _Workers([make] * num_envs, limit, context)


def _wrapped(
    environment: str,
    wrappers: Sequence[Callable[[gymnasium.Env[Any, Any]], gymnasium.Env[Any, Any]]],
    arguments: Mapping[str, Any],
) -> gymnasium.Env[Any, Any]:
    importlib.import_module("fogsim_envs")
    made: gymnasium.Env[Any, Any] = gymnasium.make(environment, **arguments)
    for wrapper in wrappers:
        made = wrapper(made)
    return made


class _Workers(AsyncVectorEnv):
    """Gymnasium's own, which by itself waits for ever for a worker that is stopped (`timeout` [s])."""

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
