"""Many environments at once, each in a process of its own; the loss of a process is reported.

`gymnasium.make_vec` runs all of them one after another (``vectorization_mode="sync"``) or in processes (``"async"``);
there a process that is killed shows as a bare ``BrokenPipeError``, and one that stands still is waited for for ever.
"""

import contextlib
import functools
import importlib
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any, Concatenate, Literal, ParamSpec, TypeVar, cast

import gymnasium
import numpy as np
from gymnasium.vector import AsyncVectorEnv, AutoresetMode
from gymnasium.vector.async_vector_env import AsyncState

from fogsim.core.parameters import Range, checked_parameters
from fogsim.errors import SimulationError
from fogsim_envs.hosting import Timeout, checked_timeout

_TIMEOUT = 600.0
"""How long one step or reset of all may take unless something else is asked for [s]; the first may compile kernels."""

_CLOSE_TIMEOUT = 10.0

_P = ParamSpec("_P")
_T = TypeVar("_T")


@checked_parameters
def make_vector(
    id: str = "fogsim/FogAdvisory-v0",  # noqa: A002 - as of `gymnasium.make_vec`
    num_envs: Annotated[int, Range(1, 10_000)] = 1,
    timeout: Timeout = _TIMEOUT,
    *,
    wrappers: Sequence[Callable[[gymnasium.Env[Any, Any]], gymnasium.Env[Any, Any]]] = (),
    context: Literal["fork", "spawn", "forkserver"] | None = None,
    autoreset_mode: AutoresetMode | Literal["NextStep", "SameStep", "Disabled"] = AutoresetMode.NEXT_STEP,
    **kwargs: Any,
) -> AsyncVectorEnv:
    """Make a vector environment that reports lost processes, unlike `gymnasium.make_vec` in its mode ``async``."""
    limit, make = checked_timeout(timeout), functools.partial(_wrapped, id, tuple(wrappers), kwargs)
    # A GL context does not survive a fork.
    context = context or ("forkserver" if "OpenGL" in sys.modules else None)
    return _Workers([make] * num_envs, limit, context, AutoresetMode(autoreset_mode))


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


def _reporting(method: Callable[Concatenate["_Workers", _P], _T]) -> Callable[Concatenate["_Workers", _P], _T]:
    """A method that speaks to the workers; if one is lost or has failed, all are ended."""

    @functools.wraps(method)
    def reporting(self: "_Workers", *args: _P.args, **kwargs: _P.kwargs) -> _T:
        try:
            return method(self, *args, **kwargs)
        except (EOFError, BrokenPipeError, ConnectionResetError) as error:
            self._abandon()
            raise SimulationError("a process that ran an environment has ended; the others were ended, too") from error
        except BaseException:
            # Gymnasium ends the worker of an environment that has failed, and leaves None in its place.
            if None in self.parent_pipes:
                self._abandon()
            raise

    return cast("Callable[Concatenate[_Workers, _P], _T]", reporting)


class _Workers(AsyncVectorEnv):
    """Gymnasium's own, which by itself waits for ever for a worker that is stopped (`timeout` [s])."""

    def __init__(
        self,
        makers: Sequence[Callable[[], gymnasium.Env[Any, Any]]],
        timeout: float | None,
        context: str | None,
        autoreset_mode: AutoresetMode,
    ) -> None:
        # Processes that begin import everything first.
        self._timeout = None if timeout is None else max(timeout, _TIMEOUT)
        super().__init__(makers, context=context, autoreset_mode=autoreset_mode)
        self._timeout = timeout

    @_reporting
    def reset_async(self, seed: Any = None, options: dict[str, Any] | None = None) -> None:
        """Ask each to begin an episode; see `AsyncVectorEnv.reset_async`."""
        super().reset_async(seed=int(seed) if isinstance(seed, np.integer) else seed, options=options)

    reset_wait = _reporting(AsyncVectorEnv.reset_wait)
    step_async = _reporting(AsyncVectorEnv.step_async)
    step_wait = _reporting(AsyncVectorEnv.step_wait)
    call_async = _reporting(AsyncVectorEnv.call_async)
    call_wait = _reporting(AsyncVectorEnv.call_wait)

    @_reporting
    def set_attr(self, name: str, values: Any) -> None:
        """Set an attribute of each; see `AsyncVectorEnv.set_attr`."""
        self._wait_for_all()
        super().set_attr(name, values)

    @_reporting
    def _check_spaces(self) -> None:
        self._wait_for_all()
        super()._check_spaces()  # type: ignore[no-untyped-call] # Gymnasium's own

    def _wait_for_all(self) -> None:
        """Ask each for something before a request whose answers Gymnasium awaits without a limit."""
        self.call("render_mode")

    def _poll_pipe_envs(self, timeout: float | None = None) -> bool:
        has_answers = super()._poll_pipe_envs(self._timeout if timeout is None else timeout)
        if timeout is None and not has_answers:
            self._abandon()
            raise SimulationError(
                f"the environments have not answered for {self._timeout:g} s, and were ended: one of their processes "
                "was stopped, or they need longer; the time is set by timeout=…"
            )
        return has_answers

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
