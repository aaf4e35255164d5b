"""``fogsim new`` and ``fogsim schema``: your own scenario from an existing one, and help for the editor."""

import json
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from fogsim.cli.printing import escape, stdout


class FileKind(StrEnum):
    """Types of files that people write."""

    SCENARIO = "scenario"
    STUDY = "study"


def new_command(
    name: Annotated[str, typer.Argument(help="Name of the new scenario, and of its folder.")],
    source: Annotated[str, typer.Option("--from", help="A scenario of the catalogue, a file, or a folder.")],
    parent: Annotated[Path, typer.Option("--in", help="Where the folder is made.")] = Path(),
) -> None:
    """Begin a scenario of your own from one that is there, with its comments and SUMO files."""
    from fogsim.scenario.starting import begin_scenario

    for file in begin_scenario(name, source, parent):
        stdout.print(f"  {escape(str(file))}", soft_wrap=True)
    stdout.print(f"next: edit {escape(str(parent / name))}/scenario.yaml, then fogsim run {escape(str(parent / name))}")


def schema_command(
    kind: Annotated[FileKind, typer.Argument(help="Which file's.")] = FileKind.SCENARIO,
) -> None:
    """Print the JSON schema of scenario or study files, by which editors complete and check them."""
    from fogsim.scenario.json_schema import json_schema, scenario_json_schema
    from fogsim.study.plan import StudyFile

    schema = scenario_json_schema() if kind == FileKind.SCENARIO else json_schema(StudyFile)
    typer.echo(json.dumps(schema, indent=2, ensure_ascii=False, allow_nan=False))
