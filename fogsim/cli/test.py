"""``fogsim test``: scenario files with what they expect, run case by case and judged."""

import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fogsim.cli.printing import INTERRUPTED, escape, stderr, stdout
from fogsim.cli.progress import STARTING, progress_bar
from fogsim.cli.scenario_options import Settings

if TYPE_CHECKING:
    from fogsim.testing import FileOutcome

NOT_PASSED = 1
"""Exit code if something failed, was inconclusive, or a run went wrong."""

NOTHING_COLLECTED = 5
"""Exit code if there was no test, as of pytest."""

_COLOURS = {"passed": "green", "failed": "red", "inconclusive": "yellow", "error": "red"}


def check_command(
    files: Annotated[list[str] | None, typer.Argument(help="Files, folders or scenarios. [the current folder]")] = None,
    out: Annotated[Path, typer.Option(help="Directory of what came of them.")] = Path("runs/tests"),
    processes: Annotated[
        int | None, typer.Option("-j", "--processes", min=1, help="Runs at once. [one a core]")
    ] = None,
    keywords: Annotated[
        str | None, typer.Option("-k", help="Only expectations whose names fit: fog and not (night or truck).")
    ] = None,
    case: Annotated[str, typer.Option(help="Only cases with these values: strength=0.7,run=3.")] = "",
    exit_first: Annotated[bool, typer.Option("-x", help="End with the first case that fails.")] = False,
    of_last: Annotated[bool, typer.Option("--lf", help="Only what did not pass in the last call.")] = False,
    resume: Annotated[bool, typer.Option("--resume", help="Go on where a call was cut off.")] = False,
    settings: Settings = None,
) -> None:
    """Run scenario files with `expect:` and tell whether they pass: exit code 0, 1, 2 (bad input) or 5 (no tests)."""
    from fogsim.study.pool import ProcessPool
    from fogsim.testing import collect, find_files, last_failed, only_cases, parse_keywords, run_tests
    from fogsim.testing.execution import check_to_file

    asked = None if keywords is None else parse_keywords(keywords)
    found = find_files(files or ["."])
    tests = collect(found, settings or (), case, asked)
    noted = last_failed(out) if of_last else {}
    # As of pytest: where nothing has failed, all is run.
    tests = only_cases(tests, noted) if noted else tests
    if not tests:
        stdout.print(f"No tests: none of {len(found)} files expects anything that was asked for.")
        raise typer.Exit(NOTHING_COLLECTED)
    total, begun = sum(len(test.runs) for test in tests), time.monotonic()
    try:
        with progress_bar(stderr, stays=True) as progress:
            task = progress.add_task(STARTING, total=total)

            def show(done: int, failed: int) -> None:
                said = f", {failed} failed" if failed else ""
                progress.update(task, completed=done, description=f"{done} of {total} runs{said}")

            engine = ProcessPool(processes or os.cpu_count() or 1, check_to_file)
            outcomes = run_tests(tests, out, engine, resume=resume, first_failure_ends=exit_first, watch=show)
    except KeyboardInterrupt:
        stdout.print("Interrupted; cases that are done are kept, and the same command with --resume goes on.")
        raise typer.Exit(INTERRUPTED) from None
    _print_outcomes(outcomes, settings or ())
    from fogsim.testing.wording import totals_text

    stdout.print(f"\n{totals_text(outcomes, time.monotonic() - begun)}")
    if not all(one.is_passed for one in outcomes):
        raise typer.Exit(NOT_PASSED)


def _print_outcomes(outcomes: Sequence["FileOutcome"], settings: Sequence[str]) -> None:
    from fogsim.testing.wording import broken_text, command_text, judgement_text

    for one in outcomes:
        number = len(one.results)
        cases = "1 case" if number == 1 else f"{number} cases"
        stdout.print(f"[bold]{escape(one.test.path)}[/] ({escape(one.test.name)}, {cases})", soft_wrap=True)
        for judgement in one.judgements:
            _print_line(judgement.outcome, f"{judgement.title}: {judgement_text(judgement)}")
            if judgement.outcome != "passed":
                stdout.print(f"{'':15}{escape(command_text(one.test, judgement.run, settings))}", soft_wrap=True)
        if one.broken:
            _print_line("error", broken_text(one.broken))
            stdout.print(f"{'':15}{escape(command_text(one.test, one.broken[0].run, settings))}", soft_wrap=True)


def _print_line(outcome: str, told: str) -> None:
    stdout.print(f"  [{_COLOURS[outcome]}]{outcome.upper():13}[/]{escape(told)}", soft_wrap=True)
