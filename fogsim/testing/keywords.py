"""Selection of expectations: words with ``and``, ``or``, ``not`` and parentheses, as in pytest's ``-k``."""

import re
from collections.abc import Callable
from dataclasses import dataclass

from fogsim.errors import InputError, shown

_TOKEN = re.compile(r"\s*([()]|[^\s()]+)")
_WORDS = ("and", "or", "not", "(", ")")

_Test = Callable[[str], bool]


@dataclass(frozen=True, slots=True)
class Keywords:
    """A condition on names; `match` evaluates it on a text with all names of an expectation."""

    written: str
    match: _Test


def parse_keywords(written: str) -> Keywords:
    """Parse a condition on names: a word matches if it is part of a name, in upper or lower case.

    Parameters
    ----------
    written : str
        Such as ``fog and not (night or truck)``.

    Raises
    ------
    InputError
        If it is malformed.
    """
    parser = _Parser(written)
    return Keywords(written, parser.whole())


class _Parser:
    def __init__(self, written: str) -> None:
        self._written = written
        self._left = _TOKEN.findall(written)

    def whole(self) -> _Test:
        test = self._either()
        if self._left:
            self._refuse(f"and, or, or the end, got {shown(self._left[0])}")
        return test

    def _either(self) -> _Test:
        test = self._both()
        while self._take("or"):
            test = _any_of(test, self._both())
        return test

    def _both(self) -> _Test:
        test = self._one()
        while self._take("and"):
            test = _all_of(test, self._one())
        return test

    def _one(self) -> _Test:
        if self._take("not"):
            test = self._one()
            return lambda names: not test(names)
        if self._take("("):
            test = self._either()
            if not self._take(")"):
                self._refuse("a closing parenthesis")
            return test
        if not self._left or self._left[0] in _WORDS:
            self._refuse(f"a word, got {shown(self._left[0]) if self._left else 'the end'}")
        word = self._left.pop(0).lower()
        return lambda names: word in names.lower()

    def _take(self, word: str) -> bool:
        if self._left[:1] != [word]:
            return False
        del self._left[0]
        return True

    def _refuse(self, expected: str) -> None:
        raise InputError(f"-k {shown(self._written)}: expected {expected}; write for example fog and not night")


def _any_of(first: _Test, second: _Test) -> _Test:
    return lambda names: first(names) or second(names)


def _all_of(first: _Test, second: _Test) -> _Test:
    return lambda names: first(names) and second(names)
