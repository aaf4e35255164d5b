"""``fogsim study``: compare policies over seeds."""

from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fogsim.cli.printing import FAILED, INTERRUPTED, escape, stderr, stdout
from fogsim.cli.progress import counting_bar, tally_bar
from fogsim.cli.scenario_options import CodeNotice, MethodTimeout, with_timeout
from fogsim.errors import InputError

if TYPE_CHECKING:
    from fogsim.scenario import Scenario


class _EngineName(StrEnum):
    """Values of `--engine`."""

    POOL = "pool"
    RAY = "ray"


def study_command(
    study: Annotated[str, typer.Argument(help="Study file, or the name of a study included in FogSim (fogsim list).")],
    out: Annotated[
        Path | None, typer.Option(help="Output directory; an interrupted study is resumed. Default: runs/STUDY.")
    ] = None,
    processes: Annotated[
        int | None, typer.Option("-j", "--processes", min=1, max=1024, help="Concurrent runs. Default: one per core.")
    ] = None,
    engine: Annotated[
        _EngineName, typer.Option(help="Where to run: processes on this machine, or a Ray cluster.")
    ] = _EngineName.POOL,
    address: Annotated[
        str | None,
        typer.Option(help="With --engine ray: HOST:PORT of the head, auto or local. Default: $RAY_ADDRESS, or local."),
    ] = None,
    check: Annotated[
        bool, typer.Option("--check", help="Check the file and print its number of runs, without running any.")
    ] = False,
    method_timeout: MethodTimeout = None,
) -> None:
    """Run a grid of policies, fogs, drivers and seeds, and write a table, differences with intervals, and a report."""
    from fogsim.core.registry.user_code import import_nothing
    from fogsim.scenario.wording.sentences import empty_start
    from fogsim.study import RayCluster, load_study, run_study
    from fogsim.study.plan import grid_text

    if address is not None and engine is _EngineName.POOL:
        raise InputError("--address is a Ray cluster's: give --engine ray with it")
    on_ray = engine is _EngineName.RAY
    runner = {"engine": RayCluster(address, processes)} if on_ray else {"processes": processes}
    may_import = import_nothing if check else CodeNotice()
    with counting_bar(stderr, "checking the scenario of each cell") as watch:
        loaded = load_study(study, with_timeout(None, method_timeout), may_import, watch)
    stdout.print(escape(f"{loaded.name}: {grid_text(loaded)}"))
    cells = loaded.cells()
    if (warning := next(filter(None, map(empty_start, cells.values())), None)) is not None:
        stderr.print(f"[yellow]{escape(warning)}[/]", soft_wrap=True)
    if check:
        _build(loaded.file, cells)
        return
    directory = out or Path("runs", loaded.name)
    failed: list[str] = []
    try:
        with tally_bar(len(loaded.runs), "runs") as show:

            def watch_runs(done: int, message: str | None) -> None:
                failed.extend([message] if message else [])
                show(done, len(failed))

            rows = run_study(loaded, directory, **runner, watch=watch_runs)
    except KeyboardInterrupt:
        stdout.print("Interrupted; finished runs are kept, and the same command goes on.")
        raise typer.Exit(INTERRUPTED) from None
    except OSError:
        stdout.print("Finished runs are kept; the same command goes on once the disk takes files again.")
        raise
    missing = [row for row in rows if row["status"] != "complete"]
    for row in missing[:10]:
        stdout.print(f"[yellow]run {row['run']} failed:[/] {escape(str(row['message']))}", soft_wrap=True)
    stdout.print("Results:")
    for name in ("study.parquet", "study.csv", "comparison.csv", "methods.md", "report.html"):
        stdout.print(f"  {escape(directory / name)}", soft_wrap=True)
    if missing:
        stdout.print(f"[yellow]{len(missing)} of {len(rows)} runs failed; the same command tries them again.[/]")
        raise typer.Exit(FAILED)


def _build(file: Path, cells: "Mapping[str, Scenario]") -> None:
    """Build each cell's road, fog and meters; InputError names the cell in which they do not fit."""
    from fogsim.study.execution import build_without_running

    for label, scenario in cells.items():
        try:
            build_without_running(scenario)
        except InputError as error:
            raise InputError(f"{file}: {label}: {error}") from error
