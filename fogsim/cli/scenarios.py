"""``fogsim list``, ``validate`` and ``signs``: scenarios and methods, mistakes in a file, and the signs of a world."""

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from fogsim.cli.printing import BAD_INPUT, escape, print_error, stdout
from fogsim.cli.scenario_options import SCENARIO_HELP, CodeNotice, Maps, Settings
from fogsim.errors import FogSimError


def list_command() -> None:
    """List scenarios and methods."""
    from fogsim.advice import ADVISERS, CONTROLLERS
    from fogsim.estimators import ESTIMATORS
    from fogsim.fusion import FUSIONS
    from fogsim.lighting import LIGHTING_POLICIES
    from fogsim.render import RENDERERS
    from fogsim.scenario import catalogue
    from fogsim.scenario.document import read_scenario_document
    from fogsim.scenario.loading import scenario_file
    from fogsim.study import shipped_studies
    from fogsim.traffic import SPEED_CHOICES

    table = Table(title="Scenarios", title_justify="left", box=None, pad_edge=False)
    table.add_column("name", style="bold", no_wrap=True)
    table.add_column("test", no_wrap=True)
    table.add_column("description")
    for name in catalogue():
        written = read_scenario_document(scenario_file(name)).data
        table.add_row(escape(name), "test" if "expect" in written else "", escape(written["description"]))
    stdout.print(table)
    stdout.print()
    stdout.print(f"[bold]study[/]: {escape(', '.join(shipped_studies()))}", soft_wrap=True)
    for registry in (ESTIMATORS, FUSIONS, ADVISERS, CONTROLLERS, LIGHTING_POLICIES, SPEED_CHOICES, RENDERERS):
        # FogSim's own in order, then those of installed packages, then those that are files.
        names = ", ".join(dict.fromkeys((*registry, *registry.known, *(f"{kind}:FILE" for kind in registry.files))))
        stdout.print(f"[bold]{registry.kind}[/]: {escape(names)}", soft_wrap=True)


def validate_command(
    files: Annotated[list[str], typer.Argument(help="Scenario files, folders or names.")],
    allow_code: Annotated[
        bool,
        typer.Option(
            "--allow-code", help="Also check parameters of Python files next to a scenario, by importing them."
        ),
    ] = False,
    maps: Maps = None,  # noqa: ARG001 - its callback does it
) -> None:
    """Check scenario files, and report every mistake with file, line, key and allowed values."""
    from fogsim.core.registry.user_code import import_nothing
    from fogsim.scenario.loading import load_cases

    may_import = CodeNotice() if allow_code else import_nothing

    bad = 0
    for file in files:
        try:
            cases = load_cases(file, may_import=may_import).cases
        except FogSimError as error:
            bad += 1
            print_error(error)
        else:
            number = f", {len(cases)} cases" if len(cases) > 1 else ""
            stdout.print(f"[green]fine:[/] {escape(file)} ({escape(cases[0][1].name)}{number})", soft_wrap=True)
    if bad:
        raise typer.Exit(BAD_INPUT)


def signs_command(
    scenario: Annotated[str, typer.Argument(help=SCENARIO_HELP)],
    out: Annotated[Path, typer.Option(help="GeoJSON file to write.")] = Path("signs.geojson"),
    settings: Settings = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace OUT if it exists.")] = False,
) -> None:
    """Write the signs of a scenario's road network, additional files and OpenDRIVE signals as GeoJSON."""
    from fogsim.core.files.output_targets import refuse_unwritable
    from fogsim.core.registry.user_code import import_nothing
    from fogsim.scenario import load_scenario
    from fogsim.scenario.loading import scenario_file
    from fogsim.simulation.recording import record_signs

    refuse_unwritable(out, "--out", read=[scenario_file(scenario)], makes_folder=True)
    loaded = load_scenario(scenario, settings or (), may_import=import_nothing)
    signs = record_signs(loaded, out, overwrite=overwrite).signs
    stdout.print(f"{len(signs)} sign{'' if len(signs) == 1 else 's'}: {escape(out)}", soft_wrap=True)
