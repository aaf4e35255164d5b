"""Test results as one HTML page, with images and videos of the failures embedded."""

import base64
import os
import platform
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

from fogsim.files.atomic import write_text
from fogsim.recorders.manifest import versions
from fogsim.recorders.report import PAGE_STYLE
from fogsim.testing.artefacts import Artefacts
from fogsim.testing.judgement import Judgement, Outcome
from fogsim.testing.session import FileOutcome
from fogsim.testing.wording import broken_text, case_lines, command_text, judgement_text, totals_text

_STYLE = """
body { max-width: 72rem; }
h2 { margin-top: 3rem; } h3 { font-size: 1rem; margin: 1.6rem 0 .3rem; }
.outcome { display: inline-block; min-width: 6.2rem; padding: .05rem .5rem; border-radius: .3rem; color: #fff;
  font-size: .8rem; font-weight: 600; text-align: center; }
.passed { background: #1f7a4d; } .failed, .error { background: #cf3a34; } .inconclusive { background: #9a6700; }
.banner { color: #fff; font-weight: 600; padding: .7rem 1rem; border-radius: .4rem; margin: 1rem 0; }
td.outcomes { width: 7rem; } td.names { width: 26%; overflow-wrap: anywhere; }
code { background: #f2f5f8; padding: .1rem .35rem; border-radius: .25rem; overflow-wrap: anywhere; }
.evidence { display: grid; grid-template-columns: repeat(auto-fit, minmax(24rem, 1fr)); gap: 1rem; align-items: start; }
.evidence video { width: 100%; border-radius: .3rem; background: #11151b; }
.cases { display: flex; flex-wrap: wrap; gap: 2px; margin: .4rem 0; }
.cases i { width: .8rem; height: .8rem; border-radius: .15rem; }
details { margin: .5rem 0; } summary { cursor: pointer; color: #44505c; } ul { margin: .3rem 0; padding-left: 1.2rem; }
"""

_LARGEST_EMBEDDED = 6_000_000
"""Largest embedded video; a larger one is linked [bytes]."""


@dataclass(frozen=True, slots=True)
class PageContent:
    """Content of the page; `artefacts` are by key of the run, expectation and clause."""

    outcomes: Sequence[FileOutcome]
    artefacts: Mapping[tuple[str, str, str], Artefacts]
    seconds: float
    settings: Sequence[str] = ()


def write_page(path: Path, content: PageContent) -> None:
    """Write the page; its folder is created if missing."""
    worst = _worst(content.outcomes)
    told = totals_text(content.outcomes, content.seconds)
    parts = [
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>{worst}: fog tests – FogSim</title>\n<style>{PAGE_STYLE}{_STYLE}</style>\n</head>\n<body>",
        f'<h1>Fog tests</h1>\n<div class="banner {worst}">{escape(told)}</div>',
        *_overview(content.outcomes),
        *(part for number, one in enumerate(content.outcomes) for part in _file(one, number, content, path.parent)),
        f"<footer>{escape(_versions_text())}</footer>\n</body>\n</html>\n",
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, "\n".join(parts))


def _worst(outcomes: Sequence[FileOutcome]) -> Outcome:
    if any(one.broken for one in outcomes):
        return Outcome.ERROR
    found = {judgement.outcome for one in outcomes for judgement in one.judgements}
    return next((one for one in (Outcome.FAILED, Outcome.INCONCLUSIVE) if one in found), Outcome.PASSED)


def _mark(outcome: Outcome) -> str:
    return f'<span class="outcome {outcome}">{outcome}</span>'


def _overview(outcomes: Sequence[FileOutcome]) -> Iterator[str]:
    if len(outcomes) < 2:
        return
    yield "<table><tr><th>outcome</th><th>file</th><th>scenario</th><th class='value'>cases</th></tr>"
    for number, one in enumerate(outcomes):
        cells = f'<td class="names"><a href="#file{number}">{escape(str(one.test.path))}</a></td>'
        cells += f"<td>{escape(one.test.name)}</td><td class='value'>{len(one.results)}</td>"
        yield f'<tr><td class="outcomes">{_mark(_worst([one]))}</td>{cells}</tr>'
    yield "</table>"


def _file(outcome: FileOutcome, number: int, content: PageContent, folder: Path) -> Iterator[str]:
    cases = "1 case" if len(outcome.results) == 1 else f"{len(outcome.results)} cases"
    described = outcome.test.runs[0].scenario.description
    yield f'<h2 id="file{number}">{escape(outcome.test.name)}</h2>'
    lead = f"{escape(described)}\n" if described else ""
    yield f'<p class="lead">{lead}{escape(str(outcome.test.path))}: {cases}, {outcome.duration:.1f} s</p>'
    yield "<table><tr><th>outcome</th><th>expectation</th><th>what came</th></tr>"
    for one in outcome.judgements:
        cells = f'<td class="names">{escape(one.title)}</td><td>{escape(judgement_text(one))}</td>'
        yield f'<tr><td class="outcomes">{_mark(one.outcome)}</td>{cells}</tr>'
    if outcome.broken:
        told = f'<td class="names">run</td><td>{escape(broken_text(outcome.broken))}</td>'
        yield f'<tr><td class="outcomes">{_mark(Outcome.ERROR)}</td>{told}</tr>'
    yield "</table>"
    for one in outcome.judgements:
        yield from _clause(outcome, one, content, folder)


def _clause(outcome: FileOutcome, judgement: Judgement, content: PageContent, folder: Path) -> Iterator[str]:
    """Details of a clause that did not pass in every case."""
    lines = case_lines(outcome, judgement)
    if judgement.outcome is Outcome.PASSED and not lines:
        return
    yield f"<h3>{escape(judgement.title)}</h3>"
    if len(outcome.results) > 1:
        yield _dots(outcome, judgement)
    if judgement.outcome is not Outcome.PASSED:
        again = command_text(outcome.test, judgement.run, content.settings)
        yield f"<p>Again: <code>{escape(again)}</code></p>"
    found = content.artefacts.get((judgement.run.key, judgement.name, judgement.clause))
    if found is not None:
        yield f'<div class="evidence">{_picture(found)}{_video(found, folder)}</div>'
    if lines:
        items = "".join(f"<li>{escape(line)}</li>" for line in lines)
        yield f"<details><summary>Cases that did not pass ({len(lines)})</summary><ul>{items}</ul></details>"


def _dots(outcome: FileOutcome, judgement: Judgement) -> str:
    """A square for each case, in order."""
    labels = {result.run.key: label for result in outcome.results for label in [_label(result.run.levels)]}
    dots = "".join(
        f'<i class="{finding.verdict}" title="{escape(labels[result.run.key])}: {finding.verdict}"></i>'
        for result in outcome.results
        for finding in result.findings
        if (finding.name, finding.clause) == (judgement.name, judgement.clause)
    )
    return f'<div class="cases">{dots}</div>'


def _label(levels: Mapping[str, str]) -> str:
    return ", ".join(f"{name}={level}" for name, level in levels.items())


def _picture(found: Artefacts) -> str:
    if found.plot is None or not found.plot.is_file():
        return ""
    data = base64.b64encode(found.plot.read_bytes()).decode("ascii")
    caption = "What was looked at, up to shortly after the failure."
    picture = f'<img alt="{caption}" src="data:image/svg+xml;base64,{data}">'
    return f"<figure>{picture}<figcaption>{caption}</figcaption></figure>"


def _video(found: Artefacts, folder: Path) -> str:
    if found.video is None or not found.video.is_file():
        return ""
    if found.video.stat().st_size <= _LARGEST_EMBEDDED:
        source = f"data:video/mp4;base64,{base64.b64encode(found.video.read_bytes()).decode('ascii')}"
    else:
        source = escape(os.path.relpath(found.video, folder))
    video = f'<video controls muted loop src="{source}"></video>'
    return f"<figure>{video}<figcaption>Around the failure: {escape(str(found.video))}</figcaption></figure>"


def _versions_text() -> str:
    known = "; ".join(f"{name} {version}" for name, version in versions().items() if version)
    return f"{known}; {platform.node()}"
