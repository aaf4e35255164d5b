"""Arguments as plain data, as `gymnasium.envs.registration.EnvSpec.from_json` has them."""

import dataclasses
import functools
import inspect
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar, get_args

from gymnasium.envs.registration import EnvSpec

from fogsim.errors import InputError

E = TypeVar("E", bound=type)


def takes_plain_data(environment: E) -> E:
    """Decorator of an environment: an argument that is an instance of a dataclass may be the mapping of its values.

    Its ``spec`` has paths as text, so that `EnvSpec.to_json`, which Minari calls after the last episode, takes them.
    """
    call = environment.__init__  # type: ignore[misc]  # that of this class

    @functools.wraps(call)
    def checked(self: Any, *arguments: Any, **options: Any) -> None:
        known = inspect.signature(call).parameters
        made = {k: _made(k, known[k].annotation, v) if k in known else v for k, v in options.items()}
        call(self, *arguments, **made)

    environment.__init__ = checked  # type: ignore[misc]
    environment.spec = property(lambda self: self.__dict__.get("spec"), _keep_spec)  # type: ignore[attr-defined]
    return environment


def _keep_spec(self: Any, spec: EnvSpec | None) -> None:
    if spec is not None:
        spec.kwargs = {name: _without_paths(value) for name, value in spec.kwargs.items()}
    self.__dict__["spec"] = spec


def _without_paths(value: Any) -> Any:
    if isinstance(value, list | tuple):
        return [_without_paths(one) for one in value]
    return str(value) if isinstance(value, Path) else value


def _made(name: str, annotation: Any, value: Any) -> Any:
    among = get_args(annotation) or (annotation,)
    if isinstance(value, list):
        # JSON has a named tuple as a list.
        named = (one for one in among if hasattr(one, "_fields") and len(one._fields) == len(value))
        return next((one(*value) for one in named), value)
    kinds = [one for one in among if isinstance(one, type) and dataclasses.is_dataclass(one)]
    if not (kinds and isinstance(value, Mapping) and all(isinstance(key, str) for key in value)):
        return value
    try:
        return kinds[0](**{key: tuple(one) if isinstance(one, list) else one for key, one in value.items()})
    except InputError as error:
        raise InputError(f"{name}: {error}") from error
