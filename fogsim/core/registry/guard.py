"""The guard around users' methods: their errors become one error that names the method and their line."""

import functools
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fogsim.core.registry.time_limit import time_limit
from fogsim.core.registry.user_code import described
from fogsim.errors import MethodError


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
            if limit is None:
                return call(*arguments, **options)
            with time_limit(limit):
                return call(*arguments, **options)
        except (KeyboardInterrupt, MethodError):
            raise
        except BaseException as error:
            raise MethodError(f"{title} failed: {described(error, file, _definition(call))}") from error

    return guard
