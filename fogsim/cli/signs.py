"""``fogsim signs``: the signs of a scenario's world as GeoJSON."""

from pathlib import Path
from typing import Annotated

import typer

from fogsim.cli.printing import escape, stdout
from fogsim.cli.scenario_options import SCENARIO_HELP, Settings


def signs_command(
    scenario: Annotated[str, typer.Argument(help=SCENARIO_HELP)],
    out: Annotated[Path, typer.Option(help="GeoJSON file.")] = Path("signs.geojson"),
    settings: Settings = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace OUT if it is there already.")] = False,
) -> None:
    """Write the signs of a scenario's road network, additional files and OpenDRIVE signals as GeoJSON."""
    from fogsim.recording import record_signs
    from fogsim.registry.user_code import import_nothing
    from fogsim.scenario import load_scenario

    loaded = load_scenario(scenario, settings or (), may_import=import_nothing)
    signs = record_signs(loaded, out, overwrite=overwrite).signs
    stdout.print(f"{len(signs)} sign{'' if len(signs) == 1 else 's'}: {escape(out)}", soft_wrap=True)
