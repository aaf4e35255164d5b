"""Arguments as plain data, as `gymnasium.envs.registration.EnvSpec.from_json` has them."""

import dataclasses
import functools
import inspect
from collections.abc import Mapping
from typing import Any, TypeVar, get_args

from fogsim.errors import InputError

E = TypeVar("E", bound=type)


def takes_plain_data(environment: E) -> E:
    """Decorator of an environment: an argument that is an instance of a dataclass may be the mapping of its values."""
    call = environment.__init__  # type: ignore[misc]  # that of this class

    @functools.wraps(call)
    def checked(self: Any, *arguments: Any, **options: Any) -> None:
        known = inspect.signature(call).parameters
        made = {k: _made(k, known[k].annotation, v) if k in known else v for k, v in options.items()}
        call(self, *arguments, **made)

    environment.__init__ = checked  # type: ignore[misc]
    return environment


def _made(name: str, annotation: Any, value: Any) -> Any:
    among = get_args(annotation) or (annotation,)
    kinds = [one for one in among if isinstance(one, type) and dataclasses.is_dataclass(one)]
    if not (kinds and isinstance(value, Mapping) and all(isinstance(key, str) for key in value)):
        return value
    try:
        return kinds[0](**{key: tuple(one) if isinstance(one, list) else one for key, one in value.items()})
    except InputError as error:
        raise InputError(f"{name}: {error}") from error
