"""``fogsim recover``: recover the results of a killed run."""

from pathlib import Path
from typing import Annotated

import typer

from fogsim.cli.printing import escape, stdout


def recover_command(
    directory: Annotated[Path, typer.Argument(help="Directory of a killed run.")],
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the results of an earlier run.")] = False,
) -> None:
    """Write steps.parquet from the rows of a killed run."""
    from fogsim.recorders import recover_run

    for name in recover_run(directory, overwrite):
        stdout.print(escape(directory / name), soft_wrap=True)
