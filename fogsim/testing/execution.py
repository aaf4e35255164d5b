"""One case: a run with its expectations evaluated."""

import os
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fogsim.conditions import ExpectationWatch
from fogsim.errors import InputError
from fogsim.scenario import Scenario
from fogsim.scenario.expect.schema import clauses_of
from fogsim.scenario.loading import load_cases
from fogsim.study.execution import Engine, RunWatch, Work, outcome_of, result_file, run_to_file, watched_run
from fogsim.study.plan import StudyRun
from fogsim.study.pool import ProcessPool
from fogsim.testing.collection import FogTest
from fogsim.testing.odd.coverage_watch import CoverageWatch
from fogsim.testing.odd.odd_file import OddFile
from fogsim.testing.results import CaseResult, finding_from_json, finding_to_json
from fogsim.testing.session import FileOutcome, run_tests


def check_case(
    scenario: Scenario, seed: int, sumo_outputs: Path | None = None, odd: OddFile | None = None
) -> dict[str, Any]:
    """Run a case and return ``findings``, ``metrics``, ``ending`` and, with an ODD, ``coverage`` as JSON data."""
    watch = ExpectationWatch(clauses_of(scenario.expect))
    coverage = None if odd is None else CoverageWatch(odd)
    watches = [watch.update, *(() if coverage is None else (coverage.update,))]
    metrics, ending = watched_run(scenario, seed, watches, sumo_outputs)
    findings = watch.findings(metrics)
    found = {"findings": [finding_to_json(one) for one in findings], "metrics": metrics, "ending": ending}
    return found if coverage is None else {**found, "coverage": coverage.document(scenario.name, findings)}


def check_outcome(scenario: Scenario, seed: int, sumo_outputs: Path, odd: OddFile | None = None) -> dict[str, Any]:
    """Check a case and return the content of its file, which also reports failures."""
    begun = time.monotonic()
    outcome = outcome_of(lambda: check_case(scenario, seed, sumo_outputs, odd))
    return {**outcome, "duration_s": round(time.monotonic() - begun, 3)}


@dataclass(frozen=True, slots=True)
class CoverageCheck:
    """Work of an engine that also collects the coverage of an ODD."""

    odd: OddFile

    def __call__(self, scenario: Scenario, seed: int, sumo_outputs: Path) -> dict[str, Any]:
        """As `check_outcome`."""
        return check_outcome(scenario, seed, sumo_outputs, self.odd)


@dataclass(frozen=True, slots=True)
class ThisProcess:
    """An engine that runs the cases in the calling process, which starts quickly and can be debugged."""

    work: Work = check_outcome

    def run(self, runs: Sequence[StudyRun], folder: Path, watch: RunWatch) -> None:
        """As `Engine.run`."""
        for case in runs:
            watch(case, run_to_file(case.scenario, case.seed, result_file(folder, case), self.work))


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
    engine: Engine = ThisProcess() if number == 1 else ProcessPool(number, check_outcome)
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
