"""``fogsim explore``: a local page on which fog, light and camera of a drive are changed by hand."""

import contextlib
import os
import webbrowser
from typing import Annotated

import typer

from fogsim.cli.printing import escape, stderr, stdout
from fogsim.cli.progress import SimulationProgress
from fogsim.cli.scenario_options import SCENARIO_HELP, Settings, chosen_scenario

_NIGHT = 0.1  # lx


def explore_command(
    scenario: Annotated[str, typer.Argument(help=SCENARIO_HELP)],
    at: Annotated[float, typer.Option(min=0.0, max=86_400.0, help="Time of the drive to begin with in seconds.")] = 5.0,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the run.")] = 0,
    port: Annotated[int, typer.Option(min=0, max=65_535, help="Port of the page; 0 for any that is free.")] = 0,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Print the address, and open no browser.")] = False,
    settings: Settings = None,
) -> None:
    """Open a page with sliders for visibility, light and camera: frame, estimates and advice follow at once."""
    from fogsim.errors import InputError
    from fogsim.explore.answering import Explorer, Question
    from fogsim.explore.server import PageServer, serve

    loaded = chosen_scenario(scenario, None, None, None, settings)
    # The port before the drive, not after it.
    with PageServer(port) as server, contextlib.closing(Explorer(loaded, scenario, seed, settings or ())) as explorer:
        with SimulationProgress(stderr, at) as progress:
            step = explorer.drive.start()
            while step.time < at - 1e-9:
                if step.ending is not None:
                    raise InputError(f"--at {at:g}: the run ends after {step.time:g} s ({step.ending.value})")
                step = explorer.drive.advance()
                progress.show(step)
            # The first looks by day and by night take longer than all later ones.
            explorer.answer(Question(at))
            with contextlib.suppress(InputError):
                explorer.answer(Question(at, chosen={"light": _NIGHT}, soon=True))
        stdout.print(f"{escape(loaded.name)}: {server.url}#{at:g}   (Ctrl-C ends)", soft_wrap=True)
        # Where there is no display, a browser would take the terminal.
        if not no_browser and (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
            webbrowser.open(f"{server.url}#{at:g}")
        serve(server, explorer)
