"""Test results as one HTML page, with images and videos of the failures embedded."""

import os
import platform
import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote

from fogsim.conditions import Finding, FindingVerdict
from fogsim.core.files.atomic import write_text
from fogsim.recorders.manifest import versions
from fogsim.recorders.templating import data_url, render
from fogsim.study.plan import StudyRun
from fogsim.testing.artefacts import Artefacts
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


_LARGEST_EMBEDDED = 6_000_000
"""Largest embedded file; a larger one is linked [bytes]."""


@dataclass(frozen=True, slots=True)
class PageContent:
    """Content of the page; `artefacts` are by key of the run, expectation and clause."""

    outcomes: Sequence[FileOutcome]
    artefacts: Mapping[tuple[str, str, str], Artefacts]
    seconds: float
    settings: Sequence[str] = ()


class _Clause(NamedTuple):
    """What the page shows of a clause that did not pass in every case."""

    judgement: Judgement
    cases: Sequence[tuple[str, str]]  # label and verdict of each case, in order
    command: str  # that runs it again; "" if it passed
    plot: str  # URL; "" without one
    video: str  # URL; "" without one
    video_file: Path | None
    lines: Sequence[str]


def write_page(path: Path, content: PageContent) -> None:
    """Write the page; its folder is created if missing."""
    page = render(
        "tests.html",
        title=f"{_worst(content.outcomes)}: fog tests",
        outcomes=content.outcomes,
        totals=totals_text(content.outcomes, content.seconds),
        clauses=lambda outcome: list(_clauses(outcome, content, path.parent)),
        worst=_worst,
        judgement_text=judgement_text,
        broken_text=broken_text,
        versions=_versions_text(),
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, page)


def _worst(outcomes: Sequence[FileOutcome]) -> Outcome:
    if any(one.broken for one in outcomes):
        return Outcome.ERROR
    found = {judgement.outcome for one in outcomes for judgement in one.judgements}
    return next((one for one in (Outcome.FAILED, Outcome.INCONCLUSIVE) if one in found), Outcome.PASSED)


def _clauses(outcome: FileOutcome, content: PageContent, folder: Path) -> Iterator[_Clause]:
    """Clauses that did not pass in every case."""
    for one in outcome.judgements:
        lines, is_passed = case_lines(outcome, one), one.outcome is Outcome.PASSED
        if lines or not is_passed:
            found = content.artefacts.get((one.run.key, one.name, one.clause), Artefacts())
            command = "" if is_passed else command_text(outcome.test, one.run, content.settings)
            plot = _embedded(found.plot, "image/svg+xml", folder)
            video = _embedded(found.video, "video/mp4", folder)
            yield _Clause(one, _cases(outcome, one), command, plot, video, found.video, lines)


def _cases(outcome: FileOutcome, judgement: Judgement) -> list[tuple[str, str]]:
    return [
        (", ".join(f"{name}={level}" for name, level in result.run.levels.items()), finding.verdict)
        for result in outcome.results
        for finding in result.findings
        if (finding.name, finding.clause) == (judgement.name, judgement.clause)
    ]


def _embedded(path: Path | None, media_type: str, folder: Path) -> str:
    """URL of a file, "" if there is none; a large one is linked."""
    if path is None or not path.is_file():
        return ""
    if path.stat().st_size > _LARGEST_EMBEDDED:
        return quote(os.path.relpath(path, folder))
    return data_url(path.read_bytes(), media_type)


def _versions_text() -> str:
    known = "; ".join(f"{name} {version}" for name, version in versions().items() if version)
    return f"{known}; {platform.node()}"
