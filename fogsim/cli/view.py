"""``fogsim view``: show the world around the ego, in pyrender's viewer or as an image."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fogsim.cli.printing import escape, stderr, stdout
from fogsim.cli.progress import SimulationProgress
from fogsim.cli.scenario_options import (
    EgoId,
    HomogeneousVisibility,
    ScenarioName,
    Settings,
    SumoConfiguration,
    chosen_scenario,
)
from fogsim.errors import InputError

if TYPE_CHECKING:
    from fogsim.scenario import Scenario
    from fogsim.simulation.ego.view_rendering import Surrounding


def view_command(
    scenario: ScenarioName = None,
    sumocfg: SumoConfiguration = None,
    ego: EgoId = None,
    visibility: HomogeneousVisibility = None,
    at: Annotated[float, typer.Option(min=0.0, max=1e6, help="Time of the run in seconds.")] = 0.0,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the run.")] = 0,
    out: Annotated[Path | None, typer.Option(help="Write the view to this image instead of opening a window.")] = None,
    settings: Settings = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace OUT if it exists.")] = False,
) -> None:
    """Show the world around the ego, in clear air, in pyrender's viewer, or write an image of it."""
    from fogsim.offline.image_files import refuse_unwritable_image, write_image
    from fogsim.render import gl_report, to_pyrender
    from fogsim.render.pyrender_reference import first_picture, open_viewer, require_display

    loaded = chosen_scenario(scenario, sumocfg, ego, visibility, settings)
    # Before the run, not after it.
    if out is None:
        require_display()
    else:
        refuse_unwritable_image(out, "--out", overwrite=overwrite)
        gl_report()
    around = _surrounding(loaded, at, seed)
    nodes = to_pyrender(
        around.scene,
        around.pose,
        around.lights,
        vehicles=around.vehicles,
        camera=around.camera,
        illuminance=around.illuminance,
    )
    size = (around.camera.width, around.camera.height)
    if out is None:
        stdout.print("Drag turns about what lies ahead, the wheel moves, z goes back to the ego's camera, q closes.")
        open_viewer(nodes, size, f"{loaded.name}, {at:g} s")
        return
    write_image(out, first_picture(nodes, size)[:, :, ::-1])  # blue first
    stdout.print(escape(out), soft_wrap=True)


def _surrounding(scenario: "Scenario", at: float, seed: int) -> "Surrounding":
    """Run a scenario with its own policy to an instant [s]."""
    from fogsim.simulation.controlled_driving import own_policy
    from fogsim.simulation.loop import ClosedLoop
    from fogsim.simulation.run_config import check_ego

    # The viewer needs its own type of OpenGL context, so no frames are rendered.
    drawn = scenario.model_copy(update={"renderer": "cpu"}).run_config()
    check_ego(drawn.traffic.ego, "fogsim view")
    policy = own_policy(drawn)
    with SimulationProgress(stderr, at) as progress, ClosedLoop(drawn) as loop:
        step = loop.start(seed)
        while step.time < at - 1e-9:
            if step.ending is not None:
                raise InputError(f"--at {at:g}: the run ends after {step.time:g} s ({step.ending.value})")
            step = loop.advance(policy.decide(step))
            progress.show(step)
        return loop.surrounding()
