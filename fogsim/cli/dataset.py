"""``fogsim dataset``: frames with their ground truth."""

from pathlib import Path
from typing import Annotated

import typer

from fogsim.cli.printing import INTERRUPTED, escape, stdout
from fogsim.cli.progress import tally_bar
from fogsim.cli.scenario_options import (
    EgoId,
    HomogeneousVisibility,
    ScenarioName,
    Settings,
    SumoConfiguration,
    chosen_scenario,
)


def dataset_command(
    out: Annotated[Path, typer.Option(help="Output directory; an interrupted data set is resumed.")],
    frames: Annotated[int, typer.Option(min=1, max=1_000_000, help="Number of frames.")],
    scenario: ScenarioName = None,
    sumocfg: SumoConfiguration = None,
    ego: EgoId = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the first run; further runs use the next seeds.")] = 0,
    every: Annotated[int, typer.Option(min=1, max=1_000_000, help="Keep one frame out of this many.")] = 1,
    visibility: HomogeneousVisibility = None,
    settings: Settings = None,
) -> None:
    """Write frames with depth, masks, true transmission and COCO annotations."""
    from fogsim.dataset import write_dataset

    loaded = chosen_scenario(scenario, sumocfg, ego, visibility, settings)
    with tally_bar(frames, "frames") as show:
        done = write_dataset(loaded, out, frames, seed=seed, every=every, watch=show)
    stdout.print(f"{done.frames} frames, {done.written} of them new: {escape(done.directory)}", soft_wrap=True)
    if not done.complete:
        stdout.print("Interrupted; the same command continues it.")
        raise typer.Exit(INTERRUPTED)
