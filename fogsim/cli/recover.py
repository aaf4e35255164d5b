"""``fogsim recover``: results of a run that was killed."""

from pathlib import Path
from typing import Annotated

import typer

from fogsim.cli.printing import escape, stdout


def recover_command(
    directory: Annotated[Path, typer.Argument(help="Directory of a run that was killed.")],
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Let its results take the place of those of an earlier run.")
    ] = False,
) -> None:
    """Make steps.parquet of the rows of a run that was killed."""
    from fogsim.recorders import recover_run

    for name in recover_run(directory, overwrite):
        stdout.print(escape(directory / name), soft_wrap=True)
