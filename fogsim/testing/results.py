"""Results of cases, read from their files."""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, TypeAdapter

from fogsim.conditions import Finding, FindingVerdict
from fogsim.study.execution import result_file
from fogsim.study.plan import StudyRun
from fogsim.study.run_file import FailedRun, Finite, Metrics, RunRecord, Word, read_run


def finding_to_json(finding: Finding) -> dict[str, Any]:
    """A finding as JSON data."""
    return dataclasses.asdict(finding)


def finding_from_json(values: Mapping[str, Any]) -> Finding:
    """A finding of a file, as `finding_to_json` writes it."""
    return _FINDING.validate_python(values)


def _checked_coverage(document: dict[str, Any]) -> dict[str, Any]:
    odd = document.get("odd")
    if document.get("schema") != "openodd.coverage/1" or not isinstance(odd, dict) or "samples" not in odd:
        raise ValueError("expected the coverage of a run, by openodd-py")
    return document


class _CompleteCase(RunRecord):
    """A case with a completed run."""

    status: Literal["complete"]
    findings: list[Finding]
    metrics: Metrics
    ending: Word | None
    duration_s: Finite
    coverage: Annotated[dict[str, Any], AfterValidator(_checked_coverage)] | None = None


_FINDING = TypeAdapter(Finding)
_CASE: TypeAdapter[_CompleteCase | FailedRun] = TypeAdapter(
    Annotated[_CompleteCase | FailedRun, Field(discriminator="status")]
)


@dataclass(frozen=True, slots=True)
class CaseResult:
    """Result of a case.

    Attributes
    ----------
    run : StudyRun
        The case.
    message : str or None
        Error of its run, if any.
    findings : tuple of Finding
        Results of each clause of the selected expectations.
    metrics : mapping
        Metrics of the run.
    duration : float
        How long it took [s].
    """

    run: StudyRun
    message: str | None
    findings: tuple[Finding, ...] = ()
    metrics: Mapping[str, Any] = field(default_factory=dict)
    duration: float = 0.0

    @property
    def is_passed(self) -> bool:
        """Whether there were expectations, and all of them passed."""
        verdicts = [one.verdict for one in self.findings]
        return bool(verdicts) and all(one is FindingVerdict.PASSED for one in verdicts)

    @property
    def has_failed(self) -> bool:
        """Whether the run failed, or an expectation did."""
        return self.message is not None or any(one.verdict is FindingVerdict.FAILED for one in self.findings)


def read_result(folder: Path, run: StudyRun, expectations: Sequence[str]) -> CaseResult | None:
    """Result of a case; None if it is missing or incomplete."""
    found = read_run(result_file(folder, run), _CASE)
    if isinstance(found, FailedRun):
        return CaseResult(run, found.message, duration=found.duration_s)
    if found is None or {one.name for one in found.findings}.isdisjoint(expectations):
        return None
    findings = tuple(one for one in found.findings if one.name in expectations)
    return CaseResult(run, None, findings, found.metrics, found.duration_s)


def completed_result(folder: Path, run: StudyRun, expectations: Sequence[str]) -> CaseResult | None:
    """As `read_result`, but None also if the run failed, so that it is run again."""
    found = read_result(folder, run, expectations)
    return None if found is None or found.message is not None else found


def read_coverage(folder: Path, run: StudyRun) -> dict[str, Any] | None:
    """Coverage of an ODD by a case; None if its run failed or collected none."""
    found = read_run(result_file(folder, run), _CASE)
    return found.coverage if isinstance(found, _CompleteCase) else None
