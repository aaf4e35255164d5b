"""``fogsim reproduce``: repeat papers' evaluations."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table

from fogsim.cli.printing import escape, stderr, stdout
from fogsim.cli.progress import measuring_bar
from fogsim.errors import InputError, UnknownNameError

if TYPE_CHECKING:
    from fogsim.reproduce import Evaluation, Reproduction

_UNBROKEN = 200  # wider than any table [characters]

_ALL = "all"
"""Represents every paper."""


def reproduce_command(
    paper: Annotated[
        str,
        typer.Argument(
            metavar="PAPER|all", help="Paper whose evaluation is repeated; drivers: field studies of traffic in fog."
        ),
    ],
    out: Annotated[Path | None, typer.Option(help="Folder for PAPER.png, a figure like the paper's.")] = None,
    table: Annotated[str | None, typer.Option(help="Run only what this table of the paper needs, such as 5.1.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Fewer frames and seeds for the same figures.")] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print flat records, one per line, instead of tables.")
    ] = False,
) -> None:
    """Repeat a paper's evaluation on FogSim's frames or traffic, and compare the figures."""
    from fogsim.core.files.output_targets import refuse_unwritable, refuse_unwritable_folder
    from fogsim.reproduce import REPRODUCTIONS

    if paper != _ALL and paper not in REPRODUCTIONS:
        raise UnknownNameError("paper", paper, [*REPRODUCTIONS, _ALL])
    if paper == _ALL and table is not None:
        raise InputError(f"--table {table} needs one paper, not {_ALL}")
    papers = REPRODUCTIONS if paper == _ALL else (paper,)
    if out is not None:
        refuse_unwritable_folder(out)
        for name in papers:
            refuse_unwritable(_picture_path(out, name), "--out", makes_folder=True)
    for name in papers:
        done = _evaluated(name, REPRODUCTIONS[name], quick=quick, table=table)
        _show(done, as_json=as_json)
        if out is not None:
            _save(done, out)


def _evaluated(name: str, evaluation: "Evaluation", *, quick: bool, table: str | None) -> "Reproduction":
    ended = f"interrupted: {name} after {{}}; nothing of it is printed or written"
    with measuring_bar(name, None, "steps", ended) as watch:
        return evaluation(quick=quick, table=table, watch=watch)


def _show(done: "Reproduction", *, as_json: bool) -> None:
    from fogsim.reproduce.result import CELL_HEADING, reached_counts

    if as_json:
        cells = [{"paper": done.paper, "table": "cells", **cell.record()} for cell in done.cells]
        for record in (*cells, *done.records, *done.sweeps):
            typer.echo(json.dumps(record, allow_nan=False))
        return
    if done.cells:
        # A file shows no bold, so a miss is marked as in Markdown.
        miss = "[bold]{}[/]" if stdout.is_terminal else "**{}**"
        rows = [(*map(escape, shown[:3]), *shown[3:]) for shown in (cell.shown(miss) for cell in done.cells)]
        _print_table(f"{done.paper}: the paper's figures and ours, misses in bold", CELL_HEADING, rows)
        published, corrected = reached_counts(done.cells)
        summary = (
            f"Of {len(done.cells)} published figures {published} are reached as published and {corrected} corrected."
        )
        stdout.print(summary, soft_wrap=True, end="\n\n")
    for shown in done.all_tables:
        heading, *plain = shown.rows
        _print_table(shown.title, heading, [tuple(map(escape, row)) for row in plain])
        if done.tables:
            stdout.print()
    for note in done.notes:
        stdout.print(f"- {escape(note)}", soft_wrap=True)


def _print_table(title: str, heading: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    # Files and pipes have no width at which rows must be broken.
    wide = stdout if stdout.is_terminal else Console(highlight=False, emoji=False, width=_UNBROKEN)
    table = Table(*map(escape, heading), box=None, pad_edge=False)
    for row in rows:
        table.add_row(*row)
    stdout.print(f"[italic]{escape(title)}[/]", soft_wrap=True)
    wide.print(table)


def _picture_path(folder: Path, paper: str) -> Path:
    return folder / f"{paper}.png"


def _save(done: "Reproduction", folder: Path) -> None:
    from fogsim.offline.image_files import write_image

    folder.mkdir(parents=True, exist_ok=True)
    path = _picture_path(folder, done.paper)
    write_image(path, done.picture[:, :, ::-1])
    stderr.print(f"picture: {escape(path)}", soft_wrap=True)
