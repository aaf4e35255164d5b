"""``fogsim test``: run scenario files with expectations, and judge each case."""

import os
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fogsim.cli.earlier_reports import remove_earlier
from fogsim.cli.printing import FAILED, INTERRUPTED, escape, stderr, stdout
from fogsim.cli.progress import counting_bar, tally_bar
from fogsim.cli.scenario_options import CaseValues, CodeNotice, Maps, MethodTimeout, Settings, with_timeout

if TYPE_CHECKING:
    from fogsim.testing import FileOutcome, FogTest
    from fogsim.testing.artefacts import Kept

_NOTHING_COLLECTED = 5
"""Exit code without tests, as in pytest."""

_COLOURS = {"passed": "green", "failed": "red", "inconclusive": "yellow", "error": "red"}
_INDENT = " " * 15


def check_command(
    files: Annotated[
        list[str] | None, typer.Argument(help="Files, folders or scenarios. Default: the current folder.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Directory for the results.")] = Path("runs/tests"),
    processes: Annotated[
        int | None, typer.Option("-j", "--processes", min=1, max=1024, help="Concurrent runs. Default: one per core.")
    ] = None,
    junit: Annotated[Path | None, typer.Option(help="Write JUnit XML for CI servers to this file.")] = None,
    html: Annotated[Path | None, typer.Option(help="Write a page with plots and videos to this file.")] = None,
    keywords: Annotated[
        str | None,
        typer.Option("-k", help="Only expectations whose names match, such as: fog and not (night or truck)."),
    ] = None,
    case: CaseValues = "",
    exit_first: Annotated[bool, typer.Option("-x", help="Stop at the first case that fails.")] = False,
    of_last: Annotated[bool, typer.Option("--lf", help="Only cases that did not pass in the last run.")] = False,
    resume: Annotated[bool, typer.Option("--resume", help="Resume an interrupted call.")] = False,
    shrink: Annotated[bool, typer.Option("--shrink", help="Search for the smallest case that still fails.")] = False,
    evidence: Annotated[bool, typer.Option(help="Keep a video and plots of cases that did not pass.")] = True,
    settings: Settings = None,
    method_timeout: MethodTimeout = None,
    maps: Maps = None,  # noqa: ARG001 - its callback does it
) -> None:
    """Test scenario files with `expect:`; exit code 0 (passed), 1 (not passed), 2 (bad input) or 5 (no tests)."""
    from fogsim.testing import find_files
    from fogsim.testing.junit import write_junit
    from fogsim.testing.page import PageContent, totals_text, write_page
    from fogsim.testing.session import begin_session

    begun, chosen = time.monotonic(), with_timeout(settings, method_timeout)
    remove_earlier(junit, html)
    found = find_files(files or ["."])
    _refuse_outputs(found, out, {"--junit": junit, "--html": html})
    tests = _asked_for(found, keywords, case, chosen, out if of_last else None)
    number = processes or os.cpu_count() or 1
    try:
        with begin_session(out, resume=resume):
            outcomes = _run(tests, out, number, exit_first=exit_first)
            kept = _evidence(outcomes, out, number) if evidence else {}
            # Before anything is printed, as into a pipe that head has closed.
            if junit is not None:
                write_junit(junit, outcomes, chosen)
            seconds = time.monotonic() - begun
            if html is not None:
                write_page(html, PageContent(outcomes, kept, seconds, chosen))
            for outcome in outcomes:
                _print_outcome(outcome, chosen)
                if shrink:
                    _print_smallest(outcome, chosen, out)
    except KeyboardInterrupt:
        stdout.print(
            "Interrupted; cases that are done are kept, and the same command with --resume goes on.", soft_wrap=True
        )
        raise typer.Exit(INTERRUPTED) from None
    stdout.print(f"\n{totals_text(outcomes, seconds)}", soft_wrap=True)
    for path in dict.fromkeys([*(one for found in kept.values() for one in found.files), junit, html]):
        if path is not None:
            stdout.print(f"  {escape(path)}", soft_wrap=True)
    _annotate(outcomes, chosen)
    if not all(one.is_passed for one in outcomes):
        raise typer.Exit(FAILED)


def _refuse_outputs(read: Sequence[Path], out: Path, pages: Mapping[str, Path | None]) -> None:
    """Refuse before the first run what could not be written after the last."""
    from fogsim.core.files.output_targets import refuse_clashes, refuse_unwritable, refuse_unwritable_folder

    refuse_unwritable_folder(out)
    named = {option: path for option, path in pages.items() if path is not None}
    for option, path in named.items():
        refuse_unwritable(path, option, read=read, makes_folder=True)
    refuse_clashes(named, {"--out": out})


def _asked_for(
    found: Sequence[Path], keywords: str | None, case: str, settings: Sequence[str], failed_in: Path | None
) -> "list[FogTest]":
    from fogsim.testing import collect, last_failed, only_cases, parse_keywords

    asked = None if keywords is None else parse_keywords(keywords)
    with counting_bar(stderr, "checking the scenario of each case") as watch:
        tests = collect(found, settings, case, asked, CodeNotice(), watch)
    noted = {} if failed_in is None else last_failed(failed_in)
    # As in pytest: if nothing has failed, all tests run.
    tests = only_cases(tests, noted) or tests
    if not tests:
        stdout.print(f"No tests: no selected expectation in {len(found)} file{'s' * (len(found) != 1)}.")
        raise typer.Exit(_NOTHING_COLLECTED)
    return tests


def _run(tests: "Sequence[FogTest]", out: Path, processes: int, *, exit_first: bool) -> "list[FileOutcome]":
    from fogsim.study.pool import ProcessPool
    from fogsim.testing.execution import check_outcome
    from fogsim.testing.session import run_cases

    engine = ProcessPool(processes, check_outcome)
    with tally_bar(sum(len(test.runs) for test in tests), "runs") as show:
        return run_cases(tests, out, engine, first_failure_ends=exit_first, watch=show)


def _evidence(outcomes: "Sequence[FileOutcome]", out: Path, processes: int) -> "Kept":
    from fogsim.testing.artefacts import keep_artefacts

    with counting_bar(stderr, "videos and plots of what did not pass") as watch:
        return keep_artefacts(outcomes, out, processes, watch)


def _print_outcome(outcome: "FileOutcome", settings: Sequence[str]) -> None:
    from fogsim.testing.page import broken_text, command_text, judgement_text

    number, test = len(outcome.results), outcome.test
    cases = "1 case" if number == 1 else f"{number} cases"
    stdout.print(f"[bold]{escape(test.path)}[/] ({escape(test.name)}, {cases})", soft_wrap=True)
    for judgement in outcome.judgements:
        _print_line(judgement.outcome, f"{judgement.title}: {judgement_text(judgement)}")
        if judgement.outcome != "passed":
            stdout.print(f"{_INDENT}{escape(command_text(test, judgement.run, settings))}", soft_wrap=True)
    if outcome.broken:
        _print_line("error", broken_text(outcome.broken))
        stdout.print(f"{_INDENT}{escape(command_text(test, outcome.broken[0].run, settings))}", soft_wrap=True)


def _print_line(outcome: str, text: str) -> None:
    stdout.print(f"  [{_COLOURS[outcome]}]{outcome.upper():13}[/]{escape(text)}", soft_wrap=True)


def _print_smallest(outcome: "FileOutcome", settings: Sequence[str], out: Path) -> None:
    from fogsim.study.pool import ProcessPool
    from fogsim.testing.execution import check_outcome
    from fogsim.testing.shrinking import shrink, smallest_text

    for judgement in outcome.judgements:
        if len(outcome.results) > 1 and judgement.numbers[1]:
            found = shrink(outcome, judgement, settings, ProcessPool(1, check_outcome), out / "results")
            text = smallest_text(outcome.test, found, settings)
            stdout.print(f"{_INDENT}{escape(f'{judgement.title}: {text}')}", soft_wrap=True)


def _annotate(outcomes: "Sequence[FileOutcome]", settings: Sequence[str]) -> None:
    """Report failures to GitHub by file and line, if it runs this."""
    from fogsim.testing.junit import annotations

    if os.environ.get("GITHUB_ACTIONS") == "true":
        for line in annotations(outcomes, settings):
            stdout.print(line, markup=False, soft_wrap=True)
