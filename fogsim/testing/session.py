"""Running tests: cases in parallel, results in files, and resuming an earlier call."""

import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import BaseModel, Field, ValidationError

from fogsim.conditions import FindingVerdict
from fogsim.core.files.atomic import partial_path, write_json
from fogsim.core.files.output_targets import refuse_unwritable_folder
from fogsim.core.files.readers import read_json
from fogsim.core.files.writer_lock import WriterLock
from fogsim.errors import InputError
from fogsim.recorders.manifest import versions
from fogsim.study.execution import Engine
from fogsim.study.plan import StudyRun
from fogsim.testing.collection import FogTest, label_of
from fogsim.testing.judgement import Judgement, Outcome, judge
from fogsim.testing.results import CaseResult, read_result

Watch = Callable[[int, int], None]
"""Called at the beginning and after each case, with the numbers of completed and failed cases."""

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
        Engine for the cases, with `check_to_file` as its work.
    resume : bool
        Whether results of an interrupted earlier call count; those of other scenarios, seeds or versions do not.
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
        If the directory holds something else, or is written by another process.
    OSError
        If a result cannot be written.
    KeyboardInterrupt
        On Ctrl-C: completed cases are kept, for `resume`.
    """
    results = begin_session(out, resume)
    with WriterLock(out):
        names = {run.key: (*test.lines,) for test in tests for run in test.runs}
        found = {run.key: read_result(results, run, names[run.key]) for test in tests for run in test.runs}
        waiting = [run for test in tests for run in test.runs if found[run.key] is None]
        done = failed = 0
        for one in found.values():
            done, failed = done + (one is not None), failed + (one is not None and one.has_failed)
        watch(done, failed)

        def count(run: StudyRun, _: str | None) -> None:
            nonlocal done, failed
            found[run.key] = one = read_result(results, run, names[run.key])
            done, failed = done + 1, failed + (one is None or one.has_failed)
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


def begin_session(out: Path, resume: bool) -> Path:
    """Create the directory, and keep only results that count."""
    refuse_unwritable_folder(out)
    session = out / _SESSION
    if out.is_dir() and not session.exists() and set(out.iterdir()) - {partial_path(session)}:
        raise InputError(f"--out {out} holds something else than tests; choose another directory")
    out.mkdir(parents=True, exist_ok=True)
    last = _read_session(out)
    if not (resume and last.versions == versions()):
        shutil.rmtree(results_folder(out), ignore_errors=True)
    write_json(session, {"versions": versions(), "not_passed": last.not_passed})
    results_folder(out).mkdir(exist_ok=True)
    return results_folder(out)


def results_folder(out: Path) -> Path:
    """Folder of the cases' results in the directory of a session."""
    return out / _RESULTS


class _Session(BaseModel):
    """State that is kept between two calls."""

    versions: dict[str, str | None] = Field(default_factory=dict)
    not_passed: dict[str, list[str]] = Field(default_factory=dict)


def _read_session(out: Path) -> _Session:
    try:
        return _Session.model_validate(read_json(out / _SESSION))
    except (InputError, ValidationError):
        return _Session()


def _outcome(test: FogTest, found: Mapping[str, CaseResult | None]) -> FileOutcome:
    results = tuple(one for run in test.runs if (one := found[run.key]) is not None)
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
    write_json(out / _SESSION, {"versions": versions(), "not_passed": noted})


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
