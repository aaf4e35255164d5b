"""Running tests: cases in parallel, results in files, and resuming an earlier call."""

import contextlib
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, Field, ValidationError

from fogsim.conditions import FindingVerdict
from fogsim.core.files.atomic import partial_path, write_json
from fogsim.core.files.output_targets import refuse_unwritable_folder
from fogsim.core.files.readers import read_json
from fogsim.core.files.writer_lock import LOCK_NAME, WriterLock
from fogsim.errors import InputError
from fogsim.recorders.manifest import versions
from fogsim.scenario.variation import NONE_FAILS
from fogsim.study.execution import Engine
from fogsim.study.plan import StudyRun
from fogsim.testing.collection import FogTest, label_of
from fogsim.testing.judgement import Judgement, Outcome, judge
from fogsim.testing.results import CaseResult, completed_result, read_result

Watch = Callable[[int, int], None]
"""Called at the beginning and after each case, with the numbers of completed and failed cases."""

SessionKind = Literal["tests", "campaign"]
"""What a directory holds results of."""

_COMMANDS: Mapping[SessionKind, str] = {"tests": "test", "campaign": "campaign"}
_DECIDING = ("fogsim", "libsumo")
"""Distributions whose results of different versions are not mixed, as in studies."""

_SESSION = "session.json"
_RESULTS = "results"


@dataclass(frozen=True, slots=True)
class FileOutcome:
    """Result of a test.

    Attributes
    ----------
    test : FogTest
        The test.
    results : tuple of CaseResult
        Its cases with results.
    judgements : tuple of Judgement
        Result of each clause of its expectations.
    """

    test: FogTest
    results: tuple[CaseResult, ...]
    judgements: tuple[Judgement, ...]

    @property
    def broken(self) -> list[CaseResult]:
        """Cases whose runs failed."""
        return [one for one in self.results if one.message is not None]

    @property
    def is_passed(self) -> bool:
        """Whether everything passed."""
        return not self.broken and all(one.outcome is Outcome.PASSED for one in self.judgements)

    @property
    def duration(self) -> float:
        """Total time of its runs [s]."""
        return sum(one.duration for one in self.results)


class _FirstFailure(Exception):  # noqa: N818 - no error: what ends a session with -x
    """A case has failed."""


def _unwatched(_: int, __: int) -> None:
    """Show nothing."""


def run_tests(
    tests: Sequence[FogTest],
    out: Path,
    engine: Engine,
    *,
    resume: bool = False,
    first_failure_ends: bool = False,
    watch: Watch = _unwatched,
) -> list[FileOutcome]:
    """Run all cases of tests, and judge them.

    Parameters
    ----------
    tests : sequence of FogTest
        From `collect`.
    out : Path
        Directory of the results.
    engine : Engine
        Engine for the cases, with `check_outcome` as its work.
    resume : bool
        Whether results of an interrupted earlier call count; those of other scenarios, seeds or versions, and of
        failed runs, do not.
    first_failure_ends : bool
        Whether to stop at the first case that fails.
    watch : callable
        Called at the beginning and after each case.

    Returns
    -------
    list of FileOutcome
        In the order of the tests; after a first failure only completed cases.

    Raises
    ------
    InputError
        If the directory holds something else or a campaign, or is written by another process.
    OSError
        If a result cannot be written.
    KeyboardInterrupt
        On Ctrl-C: completed cases are kept, for `resume`.
    """
    with begin_session(out, resume=resume):
        return run_cases(tests, out, engine, first_failure_ends=first_failure_ends, watch=watch)


def run_cases(
    tests: Sequence[FogTest], out: Path, engine: Engine, *, first_failure_ends: bool = False, watch: Watch = _unwatched
) -> list[FileOutcome]:
    """Run and judge all cases in a session that `begin_session` has begun in `out`, as `run_tests` does."""
    results = results_folder(out)
    names = {run.key: (*test.lines,) for test in tests for run in test.runs}
    found = {run.key: completed_result(results, run, names[run.key]) for test in tests for run in test.runs}
    waiting = [run for test in tests for run in test.runs if found[run.key] is None]
    done = failed = 0
    for one in found.values():
        done, failed = done + (one is not None), failed + (one is not None and one.has_failed)
    watch(done, failed)

    def count(run: StudyRun, _: str | None) -> None:
        nonlocal done, failed
        one = read_result(results, run, names[run.key]) or CaseResult(run, "its result cannot be read")
        found[run.key] = one
        done, failed = done + 1, failed + one.has_failed
        watch(done, failed)
        if failed and first_failure_ends:
            raise _FirstFailure

    try:
        if not (failed and first_failure_ends):
            engine.run(waiting, results, count)
    except _FirstFailure:
        pass
    outcomes = [_outcome(test, found) for test in tests]
    _end(out, outcomes)
    return outcomes


@contextlib.contextmanager
def begin_session(out: Path, *, resume: bool, kind: SessionKind = "tests") -> Iterator[Path]:
    """Lock a directory, keep only results that count, and yield their folder.

    InputError if it holds something else, another kind of results, or a campaign of another FogSim or SUMO.
    """
    refuse_unwritable_folder(out)
    session = out / _SESSION
    if out.is_dir() and not session.exists() and set(out.iterdir()) - {partial_path(session), out / LOCK_NAME}:
        raise InputError(f"--out {out} holds something else than tests or a campaign; choose another directory")
    out.mkdir(parents=True, exist_ok=True)
    with WriterLock(out):
        last, now = _read_session(out), versions()
        if last.kind not in (None, kind):
            raise InputError(f"--out {out} holds results of fogsim {_COMMANDS[last.kind]}; choose another directory")
        changed = [name for name in _DECIDING if last.versions.get(name) != now[name]]
        if kind == "campaign" and last.versions and changed:
            was = ", ".join(f"{name} {last.versions.get(name)} (now {now[name]})" for name in changed)
            raise InputError(f"--out {out} holds a campaign of {was}; choose another directory")
        if changed or not resume:
            _remove_results(results_folder(out))
        write_json(session, {"kind": kind, "versions": now, "not_passed": last.not_passed})
        results_folder(out).mkdir(exist_ok=True)
        yield results_folder(out)


def _remove_results(folder: Path) -> None:
    try:
        shutil.rmtree(folder)
    except FileNotFoundError:
        pass
    except OSError as error:
        why = error.strerror or error
        raise InputError(
            f"{folder}: results of an earlier call, which do not count, cannot be removed: {why}"
        ) from error


def results_folder(out: Path) -> Path:
    """Folder of the cases' results in the directory of a session."""
    return out / _RESULTS


class _Session(BaseModel):
    """State that is kept between two calls; without a kind, an earlier FogSim wrote it."""

    kind: SessionKind | None = None
    versions: dict[str, str | None] = Field(default_factory=dict)
    not_passed: dict[str, list[str]] = Field(default_factory=dict)


def _read_session(out: Path) -> _Session:
    file = out / _SESSION
    if not file.exists():
        return _Session()
    try:
        return _Session.model_validate(read_json(file))
    except (InputError, ValidationError) as error:
        raise InputError(
            f"{file}: not the description of tests or a campaign; choose another directory with --out, or remove the "
            "file and the results next to it"
        ) from error


def _outcome(test: FogTest, found: Mapping[str, CaseResult | None]) -> FileOutcome:
    results = tuple(one for run in test.runs if (one := found[run.key]) is not None)
    if len(results) < len(test.runs):
        # The first cases show no rate.
        test = replace(test, verdict=NONE_FAILS)
    return FileOutcome(test, results, tuple(judge(test, [one for one in results if one.message is None])))


def _end(out: Path, outcomes: Sequence[FileOutcome]) -> None:
    """Record failures for `last_failed`; those that were not run again stay recorded."""
    noted = {str(file): cases for file, cases in last_failed(out).items() if file.is_file()}
    for outcome in outcomes:
        file = str(outcome.test.path.resolve())
        wrong = {(one.name, one.clause) for one in outcome.judgements if one.outcome is not Outcome.PASSED}
        were_run = {label_of(one.run): _counts_against(one, wrong) for one in outcome.results}
        still = [label for label in noted.pop(file, []) if label not in were_run]
        cases = [*still, *(label for label, counts in were_run.items() if counts)]
        if cases:
            noted[file] = cases
    write_json(out / _SESSION, {"kind": "tests", "versions": versions(), "not_passed": noted})


def _counts_against(result: CaseResult, wrong: set[tuple[str, str]]) -> bool:
    of_wrong = [one for one in result.findings if (one.name, one.clause) in wrong]
    return result.message is not None or any(one.verdict is not FindingVerdict.PASSED for one in of_wrong)


def last_failed(out: Path) -> dict[Path, list[str]]:
    """Files that did not pass when they were last run, and the labels of their failed cases.

    Parameters
    ----------
    out : Path
        The directory.
    """
    return {Path(file): cases for file, cases in _read_session(out).not_passed.items()}
