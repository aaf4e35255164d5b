"""Finding tests: scenario files with expectations, and the runs of their cases."""

import hashlib
import json
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NoReturn

from fogsim.core.registry.user_code import MayImport, import_anything
from fogsim.errors import InputError, shown
from fogsim.scenario import Scenario, build
from fogsim.scenario.document import read_scenario_document
from fogsim.scenario.loading import SCENARIO_FILE, CountWatch, ScenarioCases, load_cases, scenario_file
from fogsim.scenario.variation import NONE_FAILS, Case, NoSuchCaseError, Verdict
from fogsim.scenario.written_form import deciding
from fogsim.study.plan import StudyRun, file_digests

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


_PATTERNS = ("*.fog.yaml", "*.fog.yml")
"""Names of test files; a folder's scenario.yaml is also one, if it has expectations."""

_EXPECT = "expect"
"""The block that makes a file a test."""


@dataclass(frozen=True, slots=True)
class FogTest:
    """A scenario file with expectations.

    Attributes
    ----------
    path : Path
        The file.
    name : str
        Name of the scenario.
    lines : mapping from str to str
        Selected expectations, and the line of each: ``file:line``.
    runs : tuple of StudyRun
        Selected cases.
    verdict : Verdict
        When all of them together pass.
    """

    path: Path
    name: str
    lines: Mapping[str, str]
    runs: tuple[StudyRun, ...]
    verdict: Verdict


def find_files(names: Iterable[str | Path]) -> list[Path]:
    """Test files in order, each once.

    Parameters
    ----------
    names : iterable of str or Path
        Files; folders, in which ``*.fog.yaml``, ``*.fog.yml`` and each ``scenario.yaml`` with ``expect`` are found at
        any depth; or names of the catalogue.

    Raises
    ------
    InputError
        If a name does not exist, or a file cannot be read.
    """
    found: dict[Path, Path] = {}
    for name in names:
        path = Path(name)
        for file in _in_folder(path) if path.is_dir() else [scenario_file(name)]:
            found.setdefault(file.resolve(), file)
    return list(found.values())


def _in_folder(folder: Path) -> Iterator[Path]:
    files = {file for one in _folders(folder) for name in (*_PATTERNS, SCENARIO_FILE) for file in one.glob(name)}
    for file in sorted(one for one in files if not one.is_dir() and not _is_hidden(one.relative_to(folder))):
        if file.name != SCENARIO_FILE or _EXPECT in read_scenario_document(file).data:
            yield file


def _folders(folder: Path) -> Iterator[Path]:
    """A folder and all within it, also through links, but for hidden ones and those that it is in."""
    for path, names, _ in os.walk(folder, onerror=_refuse_unreadable, followlinks=True):
        above = {one.resolve() for one in (Path(path), *Path(path).parents)}
        names[:] = [one for one in names if not one.startswith(".") and Path(path, one).resolve() not in above]
        yield Path(path)


def _refuse_unreadable(error: OSError) -> NoReturn:
    raise InputError(f"{error.filename}: cannot be read: {error.strerror}") from error


def _is_hidden(path: Path) -> bool:
    return any(part.startswith(".") for part in path.parts)


def collect(
    files: Sequence[Path],
    settings: Sequence[str] = (),
    case: str = "",
    keywords: Keywords | None = None,
    may_import: MayImport = import_anything,
    watch: CountWatch | None = None,
) -> list[FogTest]:
    """Tests of files; those without a selected expectation or case are left out.

    Parameters
    ----------
    files : sequence of Path
        From `find_files`.
    settings : sequence of str
        ``key.path=value`` each, replacing every file's values.
    case : str
        Selected cases, as for ``--case``; empty for all.
    keywords : Keywords or None
        Selected expectations.
    may_import : callable
        As in `load_scenario`.
    watch : callable or None
        As in `load_cases`.

    Raises
    ------
    InputError
        A line for each mistake of all files.
    """
    tests, mistakes, without_case = [], [], []
    for file in files:
        try:
            loaded = load_cases(file, settings, case, watch=watch, may_import=may_import, is_test=True)
        except NoSuchCaseError as error:
            without_case.append(str(error))
            continue
        except InputError as error:
            mistakes.append(str(error))
            continue
        name = loaded.cases[0][1].name
        lines = {
            one: loaded.document.where((_EXPECT, one))
            for one in loaded.document.data.get(_EXPECT) or {}
            if keywords is None or keywords.match(f"{file} {name} {one}")
        }
        if lines:
            whole = len(loaded.cases) == len(loaded.variation.cases)
            # A selection of cases shows no rate; none of them may fail.
            verdict = loaded.variation.verdict if whole else NONE_FAILS
            tests.append(FogTest(file, name, lines, tuple(_runs(file, loaded)), verdict))
    if len(without_case) == len(files):
        mistakes = without_case
    if mistakes:
        raise InputError("\n".join(mistakes))
    return tests


def _runs(file: Path, loaded: ScenarioCases) -> Iterator[StudyRun]:
    described: dict[int, str] = {}
    for number, (case, scenario) in enumerate(loaded.cases):
        # Cases that differ in their seed share a scenario.
        if id(scenario) not in described:
            described[id(scenario)] = _description(scenario)
        yield _run_of(file, number, case, scenario, described[id(scenario)])


def run_of(file: Path, number: int, case: Case, scenario: Scenario) -> StudyRun:
    """A case as a run, with the key of its result."""
    return _run_of(file, number, case, scenario, _description(scenario))


def _description(scenario: Scenario) -> str:
    return json.dumps([deciding(scenario), file_digests(scenario), build.own_methods(scenario)], sort_keys=True)


def _run_of(file: Path, number: int, case: Case, scenario: Scenario, description: str) -> StudyRun:
    text = f"{file.resolve()} {description} {case.label} {case.seed}"
    key = hashlib.sha256(text.encode()).hexdigest()[:20]
    return StudyRun(number, case.levels, case.seed, scenario, key)


def only_cases(tests: Iterable[FogTest], wanted: Mapping[Path, Sequence[str]]) -> list[FogTest]:
    """Tests reduced to some of their cases; those without any are left out.

    Parameters
    ----------
    tests : iterable of FogTest
        The tests.
    wanted : mapping from Path to sequence of str
        Labels of the cases of each file.
    """
    kept = []
    for test in tests:
        labels = wanted.get(test.path.resolve(), ())
        runs = tuple(run for run in test.runs if label_of(run) in labels)
        if runs:
            # A selection of cases shows no rate.
            verdict = test.verdict if len(runs) == len(test.runs) else NONE_FAILS
            kept.append(replace(test, runs=runs, verdict=verdict))
    return kept


def label_of(run: StudyRun) -> str:
    """A case as ``--case`` names it."""
    return ",".join(f"{name}={level}" for name, level in run.levels.items())
