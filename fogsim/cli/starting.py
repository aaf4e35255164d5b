"""``fogsim new`` and ``fogsim schema``: copy an existing scenario, and print schemas for editors."""

import json
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from fogsim.cli.printing import escape, stdout


class FileKind(StrEnum):
    """Types of files that users write."""

    SCENARIO = "scenario"
    STUDY = "study"


def new_command(
    name: Annotated[str, typer.Argument(help="Name of the new scenario, and of its folder.")],
    source: Annotated[str, typer.Option("--from", help="Scenario name, file or folder to copy.")],
    parent: Annotated[Path, typer.Option("--in", help="Parent of the new folder.")] = Path(),
) -> None:
    """Create your own scenario from an existing one, with its comments and SUMO files."""
    from fogsim.scenario.starting import begin_scenario

    for file in begin_scenario(name, source, parent):
        stdout.print(f"  {escape(str(file))}", soft_wrap=True)
    stdout.print(f"next: edit {escape(str(parent / name))}/scenario.yaml, then fogsim run {escape(str(parent / name))}")


def schema_command(
    kind: Annotated[FileKind, typer.Argument(help="Type of the file.")] = FileKind.SCENARIO,
) -> None:
    """Print the JSON schema of scenario or study files, which lets editors complete and check them."""
    from fogsim.scenario.json_schema import json_schema, scenario_json_schema
    from fogsim.study.plan import StudyFile

    schema = scenario_json_schema() if kind == FileKind.SCENARIO else json_schema(StudyFile)
    typer.echo(json.dumps(schema, indent=2, ensure_ascii=False, allow_nan=False))
