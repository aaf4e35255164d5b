"""Tests for other programs: a whole file, or one case, in this process where that is faster."""

import os
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from fogsim.errors import InputError
from fogsim.scenario.loading import load_cases
from fogsim.study.engine import Engine, RunWatch, result_file
from fogsim.study.plan import StudyRun
from fogsim.study.pool import ProcessPool, Work
from fogsim.testing.collection import FogTest
from fogsim.testing.execution import check_case, check_to_file
from fogsim.testing.results import CaseResult, finding_from_json
from fogsim.testing.session import FileOutcome, run_tests


@dataclass(frozen=True, slots=True)
class ThisProcess:
    """An engine that runs the cases in the calling process, which starts quickly and can be debugged."""

    work: Work = check_to_file

    def run(self, runs: Sequence[StudyRun], folder: Path, watch: RunWatch) -> None:
        """As `Engine.run`."""
        for run in runs:
            watch(run, self.work(run.scenario, run.seed, result_file(folder, run)))


def check_test(test: FogTest, out: Path, processes: int | None = None) -> FileOutcome:
    """Run all cases of a test and judge them: a single case in this process, several in others.

    Parameters
    ----------
    test : FogTest
        From `collect`.
    out : Path
        Directory of the results.
    processes : int or None
        Concurrent runs, in this process for one; None for one per core.

    Raises
    ------
    InputError, OSError, KeyboardInterrupt
        As in `run_tests`.
    """
    number = min(processes or os.cpu_count() or 1, len(test.runs))
    engine: Engine = ThisProcess() if number == 1 else ProcessPool(number, check_to_file)
    (outcome,) = run_tests([test], out, engine)
    return outcome


def check_one_case(
    scenario: str | Path, settings: Sequence[str] = (), case: str = "", seed: int | None = None
) -> CaseResult:
    """Run one case in this process.

    Parameters
    ----------
    scenario : str or Path
        As in `load_scenario`; expectations are optional.
    settings : sequence of str
        ``key.path=value`` each, replacing the file's values.
    case : str
        The case, as comma-separated ``name=value``; empty for the file's first.
    seed : int or None
        Seed of the run; None for the case's.

    Raises
    ------
    FogSimError
        If the scenario does not fit, or the run fails.
    """
    if isinstance(settings, str):
        raise InputError(f"settings must be a list of key.path=value each, got the text {settings!r}")
    begun = time.monotonic()
    chosen, loaded = load_cases(scenario, settings, case, seed, is_test=True).cases[0]
    run = StudyRun(0, chosen.levels, chosen.seed, loaded, "")
    found = check_case(loaded, run.seed)
    findings = tuple(finding_from_json(one) for one in found["findings"])
    return CaseResult(run, None, findings, found["metrics"], time.monotonic() - begun)
