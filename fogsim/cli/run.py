"""``fogsim run``: a scenario with its results in files."""

import sys
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from fogsim.cli.printing import INTERRUPTED, escape, stderr, stdout
from fogsim.cli.progress import SimulationProgress
from fogsim.cli.scenario_options import (
    EgoId,
    HomogeneousVisibility,
    ScenarioName,
    Settings,
    SumoConfiguration,
    chosen_scenario,
)
from fogsim.errors import UnplayedWarning

SHOWN = {
    "distance_m": ("distance driven", "m"),
    "mean_speed_mps": ("mean speed", "m/s"),
    "collisions": ("collisions of all vehicles", ""),
    "ego_collisions": ("collisions of the ego", ""),
    "minimum_time_to_collision_s": ("least time to collision", "s"),
    "minimum_gap_m": ("least gap to the leader", "m"),
    "max_deceleration_mps2": ("hardest braking", "m/s²"),
    "minimum_visibility_m": ("least true visibility ahead", "m"),
    "negative_margin_time_share": ("time in which the ego could not have stopped in sight", "%"),
    "advised_time_share": ("time with a speed advice", "%"),
    "belief_median_error_percent": ("median error of the believed visibility", "%"),
    "belief_coverage_share": ("time in which its 90 % interval held the true one ahead", "%"),
}
"""Metrics that the summary shows, with their wording and unit; metrics.json and the report have all of them."""


def run_command(
    scenario: ScenarioName = None,
    sumocfg: SumoConfiguration = None,
    ego: EgoId = None,
    visibility: HomogeneousVisibility = None,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same run, bit for bit.")] = 0,
    out: Annotated[Path | None, typer.Option(help="Directory for the results. [runs/SCENARIO-seedN]")] = None,
    settings: Settings = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace results that are there already.")] = False,
    video: Annotated[bool, typer.Option(help="Write video.mp4.")] = True,
    report: Annotated[bool, typer.Option(help="Write report.html.")] = True,
    trajectories: Annotated[bool, typer.Option(help="Write trajectories.parquet, all vehicles.")] = False,
) -> None:
    """Run a scenario and write manifest.json, steps.parquet, metrics.json, video.mp4 and report.html."""
    from fogsim.recording import record_run
    from fogsim.scenario.build import check_ego

    loaded = chosen_scenario(scenario, sumocfg, ego, visibility, settings)
    check_ego(loaded, "fogsim run")
    recorders = ["table", *(["video"] if video else []), *(["report"] if report else [])]
    recorders += ["trajectories"] if trajectories else []
    directory = out or Path("runs", f"{loaded.name}-seed{seed}")
    with warnings.catch_warnings(), SimulationProgress(stderr, loaded.duration_s) as progress:
        # The summary names all of it.
        warnings.simplefilter("ignore", UnplayedWarning)
        result = record_run(
            loaded,
            seed,
            directory,
            overwrite=overwrite,
            recorders=recorders,
            command_line=["fogsim", *sys.argv[1:]],
            watch=progress.show,
        )
    _print_summary(result.summary.values)
    partial = "the results are partial and say so" if result.files else "before its first step; nothing was written"
    ended = result.ending.value if result.ending else f"{result.status.value}; {partial}"
    stdout.print(f"\nThe run ended: [bold]{ended}[/].")
    for line in result.unplayed.lines:
        stdout.print(f"[yellow]not played:[/] {escape(line)}", soft_wrap=True)
    stdout.print("Results:")
    for name in result.files:
        stdout.print(f"  {escape(result.directory / name)}", soft_wrap=True)
    if result.ending is None:
        raise typer.Exit(INTERRUPTED)


def _print_summary(values: Mapping[str, object]) -> None:
    table = Table(title="Summary", title_justify="left", box=None, show_header=False, pad_edge=False)
    for key, (wording, unit) in SHOWN.items():
        value = values.get(key)
        if isinstance(value, int | float):
            scale = 100.0 if key.endswith("_share") else 1.0
            table.add_row(wording, f"{value * scale:.4g} {unit}".rstrip())
    stdout.print(table)
