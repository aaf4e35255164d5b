"""Test results as one HTML page, with images and videos of the failures embedded."""

import os
import platform
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from fogsim.core.files.atomic import write_text
from fogsim.recorders.manifest import versions
from fogsim.recorders.templating import data_url, render
from fogsim.testing.artefacts import Artefacts
from fogsim.testing.judgement import Judgement, Outcome
from fogsim.testing.session import FileOutcome
from fogsim.testing.wording import broken_text, case_lines, command_text, judgement_text, totals_text

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
        return os.path.relpath(path, folder)
    return data_url(path.read_bytes(), media_type)


def _versions_text() -> str:
    known = "; ".join(f"{name} {version}" for name, version in versions().items() if version)
    return f"{known}; {platform.node()}"
