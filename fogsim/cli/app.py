"""``fogsim …``: arguments, progress and exit codes, nothing else."""

import contextlib
import json
import sys
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.table import Table

from fogsim import __version__
from fogsim.cli.estimate import BAD_INPUT, estimate_command, tell_remarks
from fogsim.cli.printing import escape
from fogsim.cli.reproduce import reproduce_command
from fogsim.errors import FogSimError, InputError, UnplayedWarning
from fogsim.interruption import ProgramSignals, leave
from fogsim.values import Step

if TYPE_CHECKING:
    from fogsim.scenario import Scenario

INTERRUPTED = 130

app = typer.Typer(
    name="fogsim",
    help="Driving in fog, closed loop: SUMO traffic, physically exact camera frames, visibility estimators, advice.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
ScenarioName = Annotated[
    str | None, typer.Argument(help="A scenario of the catalogue (fogsim list), a file or a folder.")
]
SumoConfiguration = Annotated[Path | None, typer.Option(help="A SUMO configuration, in place of a scenario.")]
EgoId = Annotated[str | None, typer.Option(help="Id of the vehicle that is the ego.")]
HomogeneousVisibility = Annotated[
    float | None, typer.Option(help="Meteorological visibility of homogeneous fog in metres.", min=1.0)
]

_out = Console(highlight=False)
_err = Console(stderr=True, highlight=False)


def main() -> None:
    """Run the command line; errors that a user can mend end in one message and exit code 2, signals in one line."""
    signals = ProgramSignals()
    signals.listen()
    code: object = 0
    try:
        code = _run_app()
    except BaseException:
        # Whatever an import or a library made of the exception that the signal raised.
        if signals.last is None:
            raise
    if signals.last is not None:
        with contextlib.suppress(OSError):
            sys.stdout.flush()
        leave(signals.last)
    sys.exit(code)  # type: ignore[arg-type]  # what sys.exit was called with


def _run_app() -> object:
    """Run the command that was given, and return what it exits with."""
    try:
        with warnings.catch_warnings():
            warnings.showwarning = lambda message, *_, **__: _tell(message)
            app()
    except SystemExit as end:
        return end.code
    except FogSimError as error:
        _err.print(f"[bold red]error:[/] {escape(str(error))}", soft_wrap=True)
        return BAD_INPUT
    except OSError as error:
        _err.print(f"[bold red]error:[/] the operating system refused: {escape(str(error))}", soft_wrap=True)
        return BAD_INPUT
    return 0


def _tell(message: Warning | str) -> None:
    """Print a warning as one line, without the place in the code that Python adds."""
    _err.print(f"[yellow]warning:[/] {escape(str(message))}", soft_wrap=True)


def _version(wanted: bool) -> None:
    if wanted:
        _out.print(f"fogsim {__version__}")
        raise typer.Exit


@app.callback()
def common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Take the options that stand before a command."""


@app.command("run")
def run_command(
    scenario: ScenarioName = None,
    sumocfg: SumoConfiguration = None,
    ego: EgoId = None,
    visibility: HomogeneousVisibility = None,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same run, bit for bit.")] = 0,
    out: Annotated[Path | None, typer.Option(help="Directory for the results. [runs/SCENARIO-seedN]")] = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY.PATH=VALUE", help="Put a value in place of the file's.")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace results that are there already.")] = False,
    video: Annotated[bool, typer.Option(help="Write video.mp4.")] = True,
    report: Annotated[bool, typer.Option(help="Write report.html.")] = True,
) -> None:
    """Run a scenario and write manifest.json, steps.parquet, metrics.json, video.mp4 and report.html."""
    from fogsim.recording import record_run  # noqa: PLC0415 - heavy; --help must be quick

    loaded = _scenario(scenario, sumocfg, ego, visibility, settings or ())
    recorders = ["table", *(["video"] if video else []), *(["report"] if report else [])]
    directory = out or Path("runs", f"{loaded.name}-seed{seed}")
    with warnings.catch_warnings(), _SimulationProgress(loaded.duration_s) as progress:
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
    _out.print(f"\nThe run ended: [bold]{ended}[/].")
    for line in result.unplayed.lines:
        _out.print(f"[yellow]not played:[/] {escape(line)}", soft_wrap=True)
    _out.print("Results:")
    for name in result.files:
        _out.print(f"  {escape(str(result.directory / name))}", soft_wrap=True)
    if result.ending is None:
        raise typer.Exit(INTERRUPTED)


@app.command("recover")
def recover_command(
    directory: Annotated[Path, typer.Argument(help="Directory of a run that was killed.")],
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Let its results take the place of those of an earlier run.")
    ] = False,
) -> None:
    """Make steps.parquet of the rows of a run that was killed."""
    from fogsim.recorders import recover_run  # noqa: PLC0415 - heavy; --help must be quick

    for name in recover_run(directory, overwrite):
        _out.print(escape(str(directory / name)), soft_wrap=True)


def _scenario(
    name: str | None, sumocfg: Path | None, ego: str | None, visibility: float | None, settings: Sequence[str]
) -> "Scenario":
    """Scenario of a name or of a SUMO configuration: exactly one of them."""
    from fogsim.scenario import load_scenario, scenario_from_config  # noqa: PLC0415 - heavy; --help must be quick

    fog = [] if visibility is None else [f"fog.visibility_m={visibility!r}"]
    if sumocfg is not None and name is None:
        if ego is None:
            raise InputError(f"--sumocfg {sumocfg}: --ego is missing: which vehicle is the ego?")
        if not fog and not any(setting.startswith("fog.") for setting in settings):
            raise InputError(f"--sumocfg {sumocfg}: --visibility is missing, or a fog by --set fog.…")
        return scenario_from_config(sumocfg, ego, [*fog, *settings])
    if name is not None and sumocfg is None:
        if name.endswith(".sumocfg"):
            raise InputError(f"{name} is a SUMO configuration, not a scenario: run it with --sumocfg {name} --ego ID")
        return load_scenario(name, [*fog, *([] if ego is None else [f"traffic.ego={json.dumps(ego)}"]), *settings])
    given = "neither" if name is None else f"both: {name} and --sumocfg {sumocfg}"
    raise InputError(f"expected either a scenario or --sumocfg FILE, got {given}")


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


def _print_summary(values: Mapping[str, object]) -> None:
    table = Table(title="Summary", title_justify="left", box=None, show_header=False, pad_edge=False)
    for key, (wording, unit) in SHOWN.items():
        value = values.get(key)
        if isinstance(value, int | float):
            scale = 100.0 if key.endswith("_share") else 1.0
            table.add_row(wording, f"{value * scale:.4g} {unit}".rstrip())
    _out.print(table)


class _SimulationProgress:
    """A bar over simulated time, with how fast it passes and what is believed."""

    def __init__(self, duration: float) -> None:
        self._duration = duration
        self._progress = Progress(
            BarColumn(bar_width=20),
            TaskProgressColumn(),
            TextColumn("{task.description}"),
            TimeRemainingColumn(),
            TextColumn("left"),
            console=_err,
        )
        self._task = self._progress.add_task("starting; a first run compiles for some seconds", total=duration)

    def show(self, step: Step) -> None:
        task = self._progress.tasks[self._task]
        rate = step.time / task.elapsed if task.elapsed else 0.0
        believed = f"V ≈ {step.belief.visibility:.0f} m"
        told = f"{step.time:.0f} of {self._duration:.0f} s, {rate:.1f}× real time, {believed}"
        # A run that is over is done, however much of its longest duration is left.
        done = step.time if step.ending is None else self._duration
        self._progress.update(self._task, completed=done, description=told)

    def __enter__(self) -> "_SimulationProgress":
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()


@app.command("list")
def list_command() -> None:
    """List scenarios and the methods that a scenario can name."""
    from fogsim.advice import ADVISERS  # noqa: PLC0415 - heavy; --help must be quick
    from fogsim.estimators import ESTIMATORS  # noqa: PLC0415 - heavy; --help must be quick
    from fogsim.fusion import FUSIONS  # noqa: PLC0415 - heavy; --help must be quick
    from fogsim.lighting import LIGHTING_POLICIES  # noqa: PLC0415 - heavy; --help must be quick
    from fogsim.render import RENDERERS  # noqa: PLC0415 - heavy; --help must be quick
    from fogsim.scenario import catalogue, load_scenario  # noqa: PLC0415 - heavy; --help must be quick

    table = Table(title="Scenarios", title_justify="left", box=None, pad_edge=False)
    table.add_column("name", style="bold", no_wrap=True)
    table.add_column("description")
    for name in catalogue():
        table.add_row(name, load_scenario(name).description)
    _out.print(table)
    _out.print()
    for registry in (ESTIMATORS, FUSIONS, ADVISERS, LIGHTING_POLICIES, RENDERERS):
        _out.print(f"[bold]{registry.kind}[/]: {', '.join(registry)}")


@app.command("validate")
def validate_command(files: Annotated[list[str], typer.Argument(help="Scenario files, folders or names.")]) -> None:
    """Check scenario files; every mistake is named with file, line, key, value and what is allowed."""
    from fogsim.scenario import load_scenario  # noqa: PLC0415 - heavy; --help must be quick

    bad = 0
    for file in files:
        try:
            scenario = load_scenario(file)
        except FogSimError as error:
            bad += 1
            _err.print(f"[bold red]error:[/] {escape(str(error))}", soft_wrap=True)
        else:
            _out.print(f"[green]fine:[/] {escape(file)} ({escape(scenario.name)})", soft_wrap=True)
    if bad:
        raise typer.Exit(BAD_INPUT)


@app.command("signs")
def signs_command(
    scenario: Annotated[str, typer.Argument(help="A scenario of the catalogue (fogsim list), a file or a folder.")],
    out: Annotated[Path, typer.Option(help="GeoJSON file.")] = Path("signs.geojson"),
    settings: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY.PATH=VALUE", help="Put a value in place of the file's.")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace OUT if it is there already.")] = False,
) -> None:
    """Write the signs of a scenario's road network, additional files and OpenDRIVE signals as GeoJSON."""
    from fogsim.recording import record_signs  # noqa: PLC0415 - heavy; --help must be quick
    from fogsim.scenario import load_scenario  # noqa: PLC0415 - heavy; --help must be quick

    signs = record_signs(load_scenario(scenario, settings or ()), out, overwrite=overwrite).signs
    _out.print(f"{len(signs)} sign{'' if len(signs) == 1 else 's'}: {escape(str(out))}", soft_wrap=True)


@app.command("dataset")
def dataset_command(
    out: Annotated[Path, typer.Option(help="Directory; one that was interrupted is continued.")],
    frames: Annotated[int, typer.Option(help="How many frames.")],
    scenario: ScenarioName = None,
    sumocfg: SumoConfiguration = None,
    ego: EgoId = None,
    seed: Annotated[int, typer.Option(help="Seed of the first run; further runs have the next ones.")] = 0,
    every: Annotated[int, typer.Option(help="Take one frame of so many.")] = 1,
    visibility: HomogeneousVisibility = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY.PATH=VALUE", help="Put a value in place of the file's.")
    ] = None,
) -> None:
    """Write frames with depth, masks and true transmission, and a COCO file with boxes and all that is known."""
    from fogsim.dataset import write_dataset  # noqa: PLC0415 - heavy; --help must be quick

    loaded = _scenario(scenario, sumocfg, ego, visibility, settings or ())
    progress = Progress(
        BarColumn(bar_width=20),
        TaskProgressColumn(),
        TextColumn("{task.description}"),
        TimeRemainingColumn(),
        console=_err,
    )
    with progress:
        task = progress.add_task("starting; a first run compiles for some seconds", total=frames)
        done = write_dataset(
            loaded,
            out,
            frames,
            seed=seed,
            every=every,
            watch=lambda n: progress.update(task, completed=n, description=f"{n} of {frames} frames"),
        )
    _out.print(f"{done.frames} frames, {done.written} of them new: {escape(str(done.directory))}", soft_wrap=True)
    if not done.complete:
        _out.print("Interrupted; the same command continues it.")
        raise typer.Exit(INTERRUPTED)


@app.command("fog")
def fog_command(
    image: Annotated[Path, typer.Argument(help="A grey or colour image of 8 or 16 bits.")],
    depth: Annotated[Path, typer.Option(help="Its depth map: .npy in metres, or 16-bit PNG; 0 or inf is sky.")],
    camera: Annotated[Path, typer.Option(help="camera.yaml; its response says what pixel values stand for.")],
    visibility: Annotated[float, typer.Option(help="Meteorological visibility in metres; inf gives the image back.")],
    out: Annotated[Path, typer.Option(help="The fogged image.")],
    depth_kind: Annotated[
        str | None, typer.Option(help="planar (along the optical axis) or range (along the ray); required.")
    ] = None,
    airlight: Annotated[
        str | None, typer.Option(help="Its pixel value, or R,G,B; else the sky's median, or the brightest thousandth.")
    ] = None,
    depth_scale: Annotated[float | None, typer.Option(help="Metres in one unit of DEPTH.")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace OUT if it is there already.")] = False,
) -> None:
    """Put homogeneous fog on an image from disk: Koschmieder's law on light and slant range."""
    from fogsim.offline.camera_file import load_calibration, straight_camera  # noqa: PLC0415 - heavy; --help must be quick
    from fogsim.offline.fog_image import fog_file  # noqa: PLC0415 - heavy; --help must be quick

    if depth_kind is None:
        raise InputError("--depth-kind is missing: planar or range? Data sets differ, and the wrong one goes unseen")
    light = None if airlight is None else _pixel_values(airlight)
    calibration = load_calibration(camera)
    tell_remarks(calibration)
    pinhole = straight_camera(calibration, camera)
    used = fog_file(image, depth, depth_kind, visibility, pinhole, out, light, depth_scale, overwrite=overwrite)
    told = ", ".join(f"{value:.4g}" for value in used)
    _out.print(f"{escape(str(out))}: visibility {visibility:g} m, airlight {told}", soft_wrap=True)


def _pixel_values(text: str) -> tuple[float, ...]:
    """Pixel value, or three with commas between them."""
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"--airlight {text}: expected a pixel value, or red, green and blue as R,G,B") from None


app.command("estimate")(estimate_command)
app.command("reproduce")(reproduce_command)


@app.command("compile")
def compile_command() -> None:
    """Compile ahead what a first run would, on all cores; the result is kept on disk."""
    from fogsim.cli.compilation import compile_kernels  # noqa: PLC0415 - heavy; --help must be quick

    with _err.status("compiling for this processor, about a minute"):
        for ready in compile_kernels():
            _out.print(f"compiled: {ready}")


@app.command("doctor")
def doctor_command() -> None:
    """Say what works on this machine, what is missing, and how to get it."""
    from fogsim.cli.doctor import examine  # noqa: PLC0415 - heavy; --help must be quick

    findings = examine()
    table = Table(box=None, show_header=False, pad_edge=False)
    for finding in findings:
        table.add_row("[green]fine[/]" if finding.works else "[red]missing[/]", finding.subject, escape(finding.detail))
    _out.print(table)
    if not all(finding.works for finding in findings):
        raise typer.Exit(1)
