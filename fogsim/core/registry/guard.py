"""The guard around users' methods: their errors become one error that names the method and their line."""

import contextlib
import faulthandler
import functools
import inspect
import signal
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType
from typing import Any

from fogsim.core.registry.user_code import described, working_directory_kept
from fogsim.errors import InputError, MethodError


class TimeLimitError(BaseException):
    """A call took too long; `except Exception` in the called code does not catch it."""


_GRACE = 5.0
"""Grace period after a limit before a process ends in which compiled code blocks the error [s]."""


@contextlib.contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Raise TimeLimitError in a block that takes longer, each time the limit passes; main thread only.

    Where compiled code prevents the error, the process ends.
    """
    if threading.current_thread() is not threading.main_thread():
        raise InputError("a time limit for methods needs the main thread of Python; run without one, or run there")

    def give_up(_: int, __: FrameType | None) -> None:
        raise TimeLimitError(f"took longer than {seconds:g} s")

    before = signal.signal(signal.SIGALRM, give_up)
    faulthandler.dump_traceback_later(seconds + _GRACE, exit=True, file=2)
    signal.setitimer(signal.ITIMER_REAL, seconds, seconds)
    try:
        yield
    except KeyboardInterrupt:
        # Its alarm, which repeats a lost signal, continues.
        raise
    except BaseException:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        raise
    else:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    finally:
        faulthandler.cancel_dump_traceback_later()
        signal.signal(signal.SIGALRM, before)


@functools.cache
def guarded(cls: type, who: str, methods: tuple[str, ...], limit: float | None = None) -> type:
    """Subclass of a user's class that raises only MethodError from its attributes and `methods`.

    KeyboardInterrupt passes, so that Ctrl-C ends a run. SystemExit does not: exit codes come from the outcomes of runs.
    `who` names the class in messages ("estimator 'mine:Fade'"); `limit` bounds each call [s].
    """
    guard = functools.partial(guarded_call, file=_source(cls), limit=limit)
    # A named tuple, for example, is made by __new__ and inherits an __init__ without arguments.
    own = [name for name in ("__init__", "__new__") if getattr(cls, name) is not getattr(object, name)]
    constructor = own[0] if own else "__init__"
    body: dict[str, Any] = {"__module__": cls.__module__, "__qualname__": cls.__qualname__, "__doc__": cls.__doc__}
    body[constructor] = guard(getattr(cls, constructor), f"{who}: its constructor")
    for name in dir(cls):
        found = inspect.getattr_static(cls, name)
        if isinstance(found, property) and found.fget is not None:
            body[name] = found.getter(guard(found.fget, f"{who}: {name}"))
        elif name in methods and callable(getattr(cls, name)):
            call = guard(getattr(cls, name), f"{who}: {name}()")
            # Only a plain function gets the instance; static and class methods are bound already.
            body[name] = staticmethod(call) if isinstance(found, staticmethod | classmethod) else call
    made: type = type(cls)(cls.__name__, (cls,), body)
    return made


def _source(cls: type) -> Path | None:
    try:
        return Path(inspect.getfile(cls))
    except (TypeError, OSError):
        return None


def _definition(call: Any) -> str:
    """Source file of a function, for call errors; empty if Python does not know it."""
    code = getattr(inspect.unwrap(call), "__code__", None)
    return "" if code is None else f"{code.co_filename}:{code.co_firstlineno}"


def guarded_call(call: Callable[..., Any], title: str, file: Path | None, limit: float | None) -> Callable[..., Any]:
    """A call that raises only MethodError, with the line in `file`, and KeyboardInterrupt; `limit` bounds it [s]."""

    @functools.wraps(call)
    def guard(*arguments: Any, **options: Any) -> Any:
        try:
            with working_directory_kept(), contextlib.nullcontext() if limit is None else time_limit(limit):
                return call(*arguments, **options)
        except (KeyboardInterrupt, MethodError):
            raise
        except BaseException as error:
            raise MethodError(f"{title} failed: {described(error, file, _definition(call))}") from error

    return guard
