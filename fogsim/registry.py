"""A registry: one mapping from names to factories per kind; docs, command line and schema read it."""

import inspect
from collections.abc import Callable, Iterator, Mapping
from typing import TypeVar

from fogsim.errors import InputError, UnknownNameError
from fogsim.parameters import parameter_mistakes

T = TypeVar("T")


class Registry(Mapping[str, T]):
    """Named factories of one kind; a duplicate is refused and an unknown name answers with the known ones.

    Parameters
    ----------
    kind : str
        What the names stand for, as it is to appear in messages ("estimator").
    entries : mapping
        The factories by name.
    """

    def __init__(self, kind: str, entries: Mapping[str, T]) -> None:
        self.kind = kind
        self._entries = dict(entries)

    def register(self, name: str, factory: T) -> None:
        """Add a factory under a new name.

        Parameters
        ----------
        name : str
            A name that is free.
        factory : callable
            What makes one of the kind.

        Raises
        ------
        ValueError
            If the name is taken.
        """
        if name in self._entries:
            raise ValueError(f"{self.kind} {name!r} is registered already")
        self._entries[name] = factory

    def __getitem__(self, name: str) -> T:
        try:
            return self._entries[name]
        except (KeyError, TypeError):
            raise UnknownNameError(self.kind, name, self._entries) from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._entries)

    def __len__(self) -> int:
        return len(self._entries)

    def __contains__(self, name: object) -> bool:
        return name in self._entries


def parameters(factory: Callable[..., object]) -> dict[str, object]:
    """Names and defaults of the parameters that a factory may be given by keyword and need not be given.

    Parameters
    ----------
    factory : callable
        A class or function.
    """
    return {
        parameter.name: parameter.default
        for parameter in inspect.signature(factory).parameters.values()
        if parameter.default is not parameter.empty
    }


def make(registry: Registry[Callable[..., T]], name: str, *arguments: object, **options: object) -> T:
    """Call a registered factory.

    Parameters
    ----------
    registry : Registry
        The registry.
    name : str
        A name in it.
    *arguments : object
        What every factory of the kind is given.
    **options : object
        Parameters of this one.

    Raises
    ------
    UnknownNameError
        If the registry has no such name.
    InputError
        If the factory has no such parameter, or its annotations do not allow the value.
    """
    factory = registry[name]
    by_place = list(inspect.signature(factory).parameters)[: len(arguments)]
    mistakes = [f"{option}: {told}" for option, told in parameter_mistakes(factory, options, by_place)]
    if mistakes:
        raise InputError(f"{registry.kind} {name!r}: " + "; ".join(mistakes))
    return factory(*arguments, **options)
