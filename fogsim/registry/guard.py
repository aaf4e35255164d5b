"""The one guard around users' methods: whatever they raise becomes an error that names the method and their line."""

import functools
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fogsim.errors import MethodError
from fogsim.interruption import time_limit
from fogsim.registry.user_code import described


@functools.cache
def guarded(cls: type, who: str, methods: tuple[str, ...], limit: float | None = None) -> type:
    """Subclass of a user's class whose constructor and given methods raise nothing but MethodError.

    KeyboardInterrupt passes, so that Ctrl-C ends a run. SystemExit does not: the exit code of FogSim's commands comes
    from the outcomes of their runs.

    Parameters
    ----------
    cls : type
        The class.
    who : str
        Names the method in messages, such as "estimator 'mine:Fade'".
    methods : tuple of str
        Methods that FogSim calls; those that the class lacks are ignored.
    limit : float or None
        Longest time that one call may take [s]; None for any.
    """
    file = _source(cls)
    makes_itself = cls.__init__ is object.__init__ and cls.__new__ is not object.__new__
    names = ["__new__" if makes_itself else "__init__", *(one for one in methods if callable(getattr(cls, one, None)))]
    about = {"__module__": cls.__module__, "__qualname__": cls.__qualname__, "__doc__": cls.__doc__}
    made: type = type(cls)(
        cls.__name__, (cls,), about | {name: _guarded_attribute(cls, name, who, file, limit) for name in names}
    )
    return made


def _source(cls: type) -> Path | None:
    try:
        return Path(inspect.getfile(cls))
    except (TypeError, OSError):
        return None


def _guarded_attribute(cls: type, name: str, who: str, file: Path | None, limit: float | None) -> Any:
    call = getattr(cls, name)
    title = f"{who}: {'its constructor' if name.startswith('__') else f'{name}()'}"
    guard = _guarded_call(call, title, file, _definition(call) or str(file), limit)
    # Only a plain function is given the instance; a static or class method is bound already.
    is_plain = not isinstance(inspect.getattr_static(cls, name), staticmethod | classmethod)
    return guard if is_plain else staticmethod(guard)


def _definition(call: Any) -> str:
    """Where a function is defined, for errors in calling it; empty where Python does not know."""
    code = getattr(inspect.unwrap(call), "__code__", None)
    return "" if code is None else f"{code.co_filename}:{code.co_firstlineno}"


def _guarded_call(
    call: Callable[..., Any], title: str, file: Path | None, otherwise: str, limit: float | None
) -> Callable[..., Any]:
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
            raise MethodError(f"{title} failed: {described(error, file, otherwise)}") from error

    return guard
