"""The ``fogsim`` command: its subcommands, user errors, signals and exit codes."""

import contextlib
import errno
import json
import os
import shlex
import signal
import sys
import warnings
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from fogsim import __version__
from fogsim.cli.calibrate import calibrate
from fogsim.cli.campaign import campaign_command
from fogsim.cli.compile import compile_command
from fogsim.cli.dataset import dataset_command
from fogsim.cli.doctor import doctor_command
from fogsim.cli.explore import explore_command
from fogsim.cli.images.estimate import estimate_command
from fogsim.cli.images.fog import fog_command
from fogsim.cli.images.restore import restore_command
from fogsim.cli.option_values import check_values
from fogsim.cli.printing import BAD_INPUT, FAILED, escape, print_error, print_remarks, stderr, stdout
from fogsim.cli.reproduce import reproduce_command
from fogsim.cli.run import recover_command, run_command
from fogsim.cli.scenarios import list_command, signs_command, validate_command
from fogsim.cli.study import study_command
from fogsim.cli.test import check_command
from fogsim.cli.view import view_command
from fogsim.core.interruption import ProgramSignals, leave, leave_on_signals
from fogsim.errors import FogSimError, MethodError

_UNREAD = 128 + signal.SIGPIPE
"""Exit code of a command whose output nothing reads any more, as that of other programs."""


class _FileKind(StrEnum):
    """Types of files that users write."""

    SCENARIO = "scenario"
    STUDY = "study"


def _new_command(
    name: Annotated[str, typer.Argument(help="Name of the new scenario, and of its folder.")],
    source: Annotated[str, typer.Option("--from", help="Scenario name, file or folder to copy.")],
    parent: Annotated[Path, typer.Option("--in", help="Parent of the new folder.")] = Path(),
) -> None:
    """Create your own scenario from an existing one, with its comments and SUMO files."""
    from fogsim.scenario.starting import begin_scenario

    for file in begin_scenario(name, source, parent):
        stdout.print(f"  {escape(str(file))}", soft_wrap=True)
    made = parent / name
    again = f"next: edit {made}/scenario.yaml, then {shlex.join(['fogsim', 'run', str(made)])}"
    stdout.print(escape(again), soft_wrap=True)


def _schema_command(
    kind: Annotated[_FileKind, typer.Argument(help="Type of the file.")] = _FileKind.SCENARIO,
) -> None:
    """Print the JSON schema of scenario or study files, which lets editors complete and check them."""
    from fogsim.scenario.json_schema import json_schema, scenario_json_schema
    from fogsim.study.plan import StudyFile

    schema = scenario_json_schema() if kind == _FileKind.SCENARIO else json_schema(StudyFile)
    typer.echo(json.dumps(schema, indent=2, ensure_ascii=False, allow_nan=False))


app = typer.Typer(
    name="fogsim",
    help="Simulate driving in fog in a closed loop: SUMO traffic, exact camera frames, visibility estimators, advice.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(wanted: bool) -> None:
    if wanted:
        stdout.print(f"fogsim {__version__}")
        raise typer.Exit


@app.callback()
def _take_common_options(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Accept the options before a command."""


# In the order of --help.
app.command("run")(run_command)
app.command("test")(check_command)
app.command("campaign")(campaign_command)
app.command("study")(study_command)
app.command("explore")(explore_command)
app.command("view")(view_command)
app.command("recover")(recover_command)
app.command("list")(list_command)
app.command("validate")(validate_command)
app.command("new")(_new_command)
app.command("schema")(_schema_command)
app.command("signs")(signs_command)
app.command("dataset")(dataset_command)
app.command("fog")(fog_command)
app.command("restore")(restore_command)
app.command("estimate")(estimate_command)
app.add_typer(calibrate, name="calibrate")
app.command("reproduce")(reproduce_command)
app.command("compile")(compile_command)
app.command("doctor")(doctor_command)
check_values(app)


def main() -> None:
    """Run the command line; user errors end in one message and exit code 2, signals in one line."""
    # By default, rich ends the command.
    for console, descriptor in ((stdout, 1), (stderr, 2)):
        console.on_broken_pipe = partial(_discard, console, descriptor)  # type: ignore[method-assign]
    signals = ProgramSignals()
    signals.listen()
    code: object = 0
    try:
        code = _run_app()
        # All is saved; an exception while Python ends would be shown as a traceback.
        leave_on_signals()
    except BaseException:
        # Imports and libraries may convert the exception that the signal raised.
        if signals.last is None:
            raise
    if signals.last is not None:
        with contextlib.suppress(OSError):
            sys.stdout.flush()
        leave(signals.last)
    sys.exit(code)  # type: ignore[arg-type]  # what sys.exit was called with


def _run_app() -> object:
    """Run the given command, and return its exit code."""
    code: object = 0
    try:
        with warnings.catch_warnings():
            # Omit the code location that Python adds.
            warnings.showwarning = lambda message, *_, **__: print_remarks("warning", (message,), in_one_line=False)
            app()
    except SystemExit as end:
        is_unread = isinstance(end.__context__, BrokenPipeError)  # which typer makes a failure
        code = _UNREAD if is_unread else end.code
    except FogSimError as error:
        print_error(error)
        code = FAILED if isinstance(error, MethodError) else BAD_INPUT
    except OSError as error:
        print_error(f"the operating system refused: {error}")
        code = BAD_INPUT
    return code if _flush_stdout() else code or BAD_INPUT


def _flush_stdout() -> bool:
    """Flush stdout, and return whether it could be written, or has no reader any more."""
    try:
        sys.stdout.flush()
    except OSError as error:
        if error.errno != errno.EPIPE:
            print_error(f"stdout: cannot be written: {error.strerror}")
        # Python would try again when it ends, and print a traceback.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return error.errno == errno.EPIPE
    return True


def _discard(console: Console, descriptor: int) -> None:
    """Print nothing more to a reader that has gone, as ``head``: files and exit code are those of the whole command."""
    console.quiet = True
    os.dup2(os.open(os.devnull, os.O_WRONLY), descriptor)
