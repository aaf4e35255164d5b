"""A registry: one mapping from names to factories per kind; docs, command line and schema read it."""

from collections.abc import Iterator, Mapping
from typing import TypeVar

from fogsim.errors import UnknownNameError

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
