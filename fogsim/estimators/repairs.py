"""Errors of a paper's method that are mended, each by its name: a method keeps its own mechanism, with or without."""

from collections.abc import Collection, Sequence
from enum import StrEnum
from typing import Literal, Self, TypeVar

from fogsim.errors import InputError


class Repair(StrEnum):
    """Base of a method's repairs: a name, and what is wrong in the paper and right with the repair."""

    # paper, corrected: what the paper has, and what the repair does instead
    paper: str
    corrected: str

    def __new__(cls, name: str, paper: str, corrected: str) -> Self:
        """Make a repair of its name and what it is about."""
        one = str.__new__(cls, name)
        one._value_, one.paper, one.corrected = name, paper, corrected
        return one


R = TypeVar("R", bound=Repair)


def chosen(
    kind: type[R], repairs: Literal["all", "none"] | Sequence[R], *, as_published: bool, published: Collection[R] = ()
) -> frozenset[R]:
    """Repairs that a method makes."""
    if not as_published:
        return frozenset(kind if repairs == "all" else () if repairs == "none" else map(kind, repairs))
    if repairs not in ("all", "none"):
        raise InputError(f"as_published=True makes no repairs; leave it out, or repairs, got {list(repairs)!r}")
    return frozenset(published if repairs == "all" else ())
