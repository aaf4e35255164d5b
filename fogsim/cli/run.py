"""``fogsim run``: run a scenario and write its results."""

import sys
import warnings
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from fogsim.cli.compiler_process import compiling_in_background
from fogsim.cli.printing import INTERRUPTED, escape, stderr, stdout
from fogsim.cli.progress import SimulationProgress
from fogsim.cli.scenario_options import (
    CaseValues,
    EgoId,
    HomogeneousVisibility,
    Maps,
    MethodTimeout,
    ScenarioName,
    Settings,
    SumoConfiguration,
    chosen_case,
    with_timeout,
)
from fogsim.errors import InputError, UnplayedWarning

if TYPE_CHECKING:
    from fogsim.scenario import Scenario
    from fogsim.simulation.recording import RecordedRun


def recover_command(
    directory: Annotated[Path, typer.Argument(help="Directory of a killed run.")],
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the results of an earlier run.")] = False,
) -> None:
    """Write steps.parquet from the rows of a killed run."""
    from fogsim.recorders import recover_run

    for name in recover_run(directory, overwrite):
        stdout.print(escape(directory / name), soft_wrap=True)


_SHOWN = {
    "distance_m": ("distance driven", "m"),
    "mean_speed_mps": ("mean speed", "m/s"),
    "collisions": ("collisions of all vehicles", ""),
    "ego_collisions": ("collisions of the ego", ""),
    "minimum_time_to_collision_s": ("least time to collision", "s"),
    "minimum_gap_m": ("least gap to the leader", "m"),
    "max_deceleration_mps2": ("hardest braking", "m/s²"),
    "minimum_visibility_m": ("least true visibility ahead", "m"),
    "overdriven_m_per_km_in_fog": ("driven too fast to stop in sight", "m per km in fog"),
    "fog_warning_lead_m": ("warned of fog banks before half their density", "m"),
    "advised_time_share": ("time with a speed advice", "%"),
    "belief_median_error_percent": ("median error of the believed visibility", "%"),
    "belief_coverage_share": ("time in which its 90 % interval held the true one ahead", "%"),
}
"""Metrics that the summary shows, with their wording and unit; metrics.json and the report have all of them."""

_SHOWN_OF_TRAFFIC = {
    "duration_s": ("simulated time", "s"),
    "traffic_vehicle_time_s": ("time of all vehicles together", "s"),
    "traffic_mean_speed_mps": ("mean speed", "m/s"),
    "traffic_speed_standard_deviation_mps": ("standard deviation of speed", "m/s"),
    "traffic_delay_s_per_vehicle_km": ("delay", "s per vehicle-km"),
    "traffic_collisions": ("collisions", ""),
    "traffic_minimum_time_to_collision_s": ("least time to collision", "s"),
    "traffic_exposed_time_share": ("time below the time-to-collision threshold, of all vehicle time", "%"),
    "traffic_overdriven_m_per_vehicle_km_in_fog": ("driven too fast to stop in sight", "m per vehicle-km in fog"),
    "traffic_advised_time_share": ("time in which drivers had heard an advice", "%"),
    "traffic_advice_compliance_share": ("of it at the advice or slower", "%"),
}
"""The same for traffic alone; shares are of the time of all vehicles."""


def run_command(
    scenario: ScenarioName = None,
    sumocfg: SumoConfiguration = None,
    ego: EgoId = None,
    visibility: HomogeneousVisibility = None,
    seed: Annotated[
        int | None,
        typer.Option(min=0, help="The same seed gives the same run, bit for bit. Default: 0, or the case's."),
    ] = None,
    case: CaseValues = "",
    out: Annotated[
        Path | None, typer.Option(help="Directory for the results. Default: runs/SCENARIO-seedN or runs/SCENARIO-CASE.")
    ] = None,
    settings: Settings = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace existing results.")] = False,
    video: Annotated[
        bool | None, typer.Option("--video/--no-video", help="Write video.mp4. Default: if there is an ego.")
    ] = None,
    restored_video: Annotated[
        bool,
        typer.Option(
            "--restored-video", help="Also write restored.mp4, half of each frame with its contrast restored."
        ),
    ] = False,
    report: Annotated[bool, typer.Option(help="Write report.html.")] = True,
    trajectories: Annotated[bool, typer.Option(help="Write trajectories.parquet for all vehicles.")] = False,
    events: Annotated[
        bool | None, typer.Option("--events/--no-events", help="Write events.parquet. Default: if there is a timeline.")
    ] = None,
    xosc: Annotated[bool, typer.Option("--xosc", help="Write scenario.xosc, the run as an OpenSCENARIO file.")] = False,
    osi: Annotated[
        bool, typer.Option("--osi", help="Write ground_truth.osi, an ASAM OSI trace (needs the extra `osi`).")
    ] = False,
    camera_processes: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=1024,
            help="Processes that render for equipped vehicles other than the ego. Default: all processors but one.",
        ),
    ] = None,
    method_timeout: MethodTimeout = None,
    maps: Maps = None,  # noqa: ARG001 - its callback does it
) -> None:
    """Run a scenario and write manifest.json, steps.parquet, metrics.json, video.mp4 and report.html."""
    settings = with_timeout(settings, method_timeout)
    with compiling_in_background() as compile_for:
        loaded, of_file = chosen_case(scenario, sumocfg, ego, visibility, settings, case, seed)
        compile_for(loaded)
        from fogsim.scenario.wording.sentences import empty_start
        from fogsim.simulation.recording import record_run, record_traffic

        if warning := empty_start(loaded):
            stderr.print(f"[yellow]{escape(warning)}[/]", soft_wrap=True)
        chosen = {
            "table": True,
            "video": _filmed(loaded, video),
            "restored_video": restored_video and _filmed(loaded, wanted=True),
            "report": report,
            "trajectories": trajectories,
            "events": bool(loaded.timeline) if events is None else events,
            "openscenario": xosc,
            "osi": osi,
        }
        record: Callable[..., RecordedRun] = record_traffic
        if loaded.traffic.has_ego:
            record = partial(record_run, camera_processes=_camera_processes(loaded, camera_processes))
        directory = out or Path("runs", f"{loaded.name}-{of_file.folder_name}")
        with warnings.catch_warnings(), SimulationProgress(stderr, loaded.duration_s) as progress:
            # The summary names all of it.
            warnings.simplefilter("ignore", UnplayedWarning)
            result = record(
                loaded,
                of_file.seed,
                directory,
                overwrite=overwrite,
                recorders=[name for name, wanted in chosen.items() if wanted],
                command_line=["fogsim", *sys.argv[1:]],
                watch=progress.show,
            )
    _print_result(result, _SHOWN if loaded.traffic.has_ego else _SHOWN_OF_TRAFFIC)
    if result.ending is None:
        raise typer.Exit(INTERRUPTED)


def _camera_processes(scenario: "Scenario", wanted: int | None) -> int:
    """Number of processes that render the cameras of other equipped vehicles, if any."""
    if not scenario.traffic.has_equipped:
        return 0
    from fogsim.core.jit import processors

    return processors() - 1 if wanted is None else wanted


def _filmed(scenario: "Scenario", wanted: bool | None) -> bool:
    """Whether to write a video: by default, if there is a camera for it."""
    from fogsim.simulation.run_config import NO_RENDERER

    if wanted and not scenario.traffic.has_ego:
        raise InputError(
            "--video shows what an ego's camera sees, and traffic.ego is none; leave it out, or name an ego"
        )
    if wanted and scenario.renderer == NO_RENDERER:
        raise InputError("--video shows frames, and renderer is none; leave it out, or --set renderer=auto")
    return scenario.traffic.has_ego and scenario.renderer != NO_RENDERER if wanted is None else wanted


def _print_result(result: "RecordedRun", shown: Mapping[str, tuple[str, str]]) -> None:
    """Report how the run went and ended, what was not played, and which files exist."""
    _print_summary(result.summary.values, shown)
    written = "the results are partial and say so" if result.files else "before its first step; nothing was written"
    ended = result.ending.value if result.ending else f"{result.status.value}; {written}"
    stdout.print(f"\nThe run ended: [bold]{ended}[/].")
    for line in result.unplayed.lines:
        stdout.print(f"[yellow]not played:[/] {escape(line)}", soft_wrap=True)
    stdout.print("Results:")
    for name in result.files:
        stdout.print(f"  {escape(result.directory / name)}", soft_wrap=True)


def _print_summary(values: Mapping[str, object], shown: Mapping[str, tuple[str, str]]) -> None:
    table = Table(title="Summary", title_justify="left", box=None, show_header=False, pad_edge=False)
    for key, (wording, unit) in shown.items():
        value = values.get(key)
        if isinstance(value, int | float):
            scale = 100.0 if key.endswith("_share") else 1.0
            table.add_row(wording, f"{value * scale:.4g} {unit}".rstrip())
    stdout.print(table)
