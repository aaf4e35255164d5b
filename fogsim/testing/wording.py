"""Test results in words, shared by terminal, reports and annotations."""

import shlex
from collections.abc import Sequence

from fogsim.expectations import Finding, FindingVerdict
from fogsim.study.plan import StudyRun
from fogsim.testing.collection import FogTest, label_of
from fogsim.testing.judgement import Judgement, Outcome
from fogsim.testing.results import CaseResult
from fogsim.testing.session import FileOutcome


def finding_text(finding: Finding) -> str:
    """What was expected, what came, when and where."""
    came = f", came {finding.came}" if finding.came else ""
    when = "" if finding.time is None or f"{finding.time:g} s" in finding.came else f" at {finding.time:.4g} s"
    where = "" if finding.position is None else f", {finding.position:.0f} m"
    why = f" ({finding.reason})" if finding.reason else ""
    return f"expected {finding.expected}{came}{when}{where}{why}"


def judgement_text(judgement: Judgement) -> str:
    """Result of a clause over all cases."""
    if not judgement.why:
        return finding_text(judgement.telling)
    if judgement.outcome is Outcome.PASSED:
        return f"expected {judgement.telling.expected}; {judgement.why}"
    return f"{judgement.why}; {label_of(judgement.run)}: {finding_text(judgement.telling)}"


def case_lines(outcome: FileOutcome, judgement: Judgement) -> list[str]:
    """A line for each case that did not pass a clause; none for a file with one case."""
    if len(outcome.results) == 1:
        return []
    return [
        f"{label_of(result.run)}: {finding.verdict}: {finding_text(finding)}"
        for result in outcome.results
        for finding in result.findings
        if (finding.name, finding.clause) == (judgement.name, judgement.clause)
        and finding.verdict is not FindingVerdict.PASSED
    ]


def broken_text(broken: Sequence[CaseResult]) -> str:
    """What went wrong with runs."""
    first, number = broken[0], len(broken)
    runs = "the run went wrong" if number == 1 else f"{number} runs went wrong"
    label = label_of(first.run)
    return f"{runs}: {label + ': ' if label else ''}{first.message}"


def command_text(test: FogTest, run: StudyRun, settings: Sequence[str] = (), program: str = "test") -> str:
    """Command that runs a case again with the same settings; `program` is ``test``, or ``run`` for all files."""
    label = label_of(run)
    chosen = ["--case", label] if label else []
    return shlex.join(
        ["fogsim", program, str(test.path), *chosen, *(part for one in settings for part in ("--set", one))]
    )


def expectation_lines(outcome: FileOutcome, name: str) -> list[str]:
    """Why an expectation did not pass, and how to reproduce it; nothing if it passed."""
    lines = []
    for one in outcome.judgements:
        if one.name == name and one.outcome is not Outcome.PASSED:
            lines += [f"{one.outcome}: {one.title}: {judgement_text(one)}", command_text(outcome.test, one.run)]
    if outcome.broken:
        lines += [broken_text(outcome.broken), command_text(outcome.test, outcome.broken[0].run)]
    return lines


def totals_text(outcomes: Sequence[FileOutcome], seconds: float) -> str:
    """How many expectations passed."""
    numbers = dict.fromkeys(Outcome, 0)
    for one in outcomes:
        numbers[Outcome.ERROR] += bool(one.broken)
        for judgement in one.judgements:
            numbers[judgement.outcome] += 1
    counted = ", ".join(f"{number} {outcome}" for outcome, number in numbers.items() if number)
    cases = sum(len(one.results) for one in outcomes)
    of_files = f"{_number(cases, 'run')} of {_number(len(outcomes), 'file')}"
    return f"{counted or 'nothing was checked'}; {of_files} in {seconds:.1f} s"


def _number(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"
