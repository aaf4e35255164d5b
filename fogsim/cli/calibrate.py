"""``fogsim calibrate …``: measure what methods need to know about a camera, or fit drivers to measurements."""

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from fogsim.cli.printing import INTERRUPTED, escape, print_remarks, stderr, stdout
from fogsim.cli.progress import measuring_bar
from fogsim.core.interruption import interruptible
from fogsim.errors import InputError, printable

calibrate = typer.Typer(
    no_args_is_help=True, help="Measure what a method needs to know about a camera, or fit drivers to measurements."
)

_ENDED = "interrupted after {}; nothing is written"


@calibrate.callback()
def _commands() -> None:
    """Group the calibrations, one command each."""


@calibrate.command("signs")
def calibrate_signs_command(
    camera: Annotated[Path, typer.Option(help="Camera file of undistorted images (docs/how_to/own_camera.md).")],
    sign_diameter: Annotated[float, typer.Option(help="Diameter of the signs in metres.", min=0.1, max=5.0)] = 0.9,
    out: Annotated[Path, typer.Option(help="Calibration file to write.")] = Path("signs_range.json"),
    approaches: Annotated[int, typer.Option(help="Signs approached in each fog.", min=4, max=100_000)] = 24,
    seed: Annotated[int, typer.Option(help="Seed of positions, errors and noise.", min=0)] = 0,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace OUT if it exists.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the calibration as JSON instead of a table.")] = False,
) -> None:
    """Measure the distance at which signs are detected in fog, from which belaroussi2015 estimates visibility."""
    from fogsim.calibration.sign_calibration import measure_operating_range
    from fogsim.core.files.atomic import write_bytes
    from fogsim.core.files.output_targets import refuse_unwritable
    from fogsim.offline.camera_file import load_camera

    refuse_unwritable(out, "--out", overwrite=overwrite, read=[camera])
    known = load_camera(camera)
    with measuring_bar("signs", approaches, "approaches", _ENDED) as watch:
        measured = measure_operating_range(known, sign_diameter, approaches=approaches, seed=seed, watch=watch)
    write_bytes(out, (measured.as_json() + "\n").encode())
    if as_json:
        typer.echo(json.dumps(json.loads(measured.as_json())))
        return
    table = Table("V_met [m]", "80 % detection [m]", "first detection [m]", box=None, pad_edge=False)
    rows = zip(measured.visibility, measured.operating_range, measured.first_detection, measured.deviation, strict=True)
    for visibility, reach, first, deviation in rows:
        table.add_row(f"{visibility:.0f}", f"{reach:.0f}", f"{first:.0f} ± {deviation:.0f}")
    stdout.print(table)
    low, high = measured.reach
    usable = f"gives V_met between {low:.0f} and {high:.0f} m of first detection, up to {measured.farthest:.0f} m"
    stdout.print(
        f"{usable if low < high else 'gives nothing: resolution limits the range, not fog'}: {escape(out)}",
        soft_wrap=True,
    )


@calibrate.command("halos")
def calibrate_halos_command(
    camera: Annotated[Path, typer.Option(help="Camera file of undistorted images (docs/how_to/own_camera.md).")],
    out: Annotated[Path, typer.Option(help="Calibration file to write.")] = Path("halos.json"),
    scenes: Annotated[int, typer.Option(help="Scenes to draw, each in clear air and in fog.", min=4, max=100_000)] = 80,
    lens_glare: Annotated[
        float, typer.Option(help="Share of lamp light that the lens scatters.", min=0.0, max=1.0)
    ] = 0.01,
    seed: Annotated[int, typer.Option(help="Seed of scenes, exposures and noise.", min=0)] = 0,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace OUT if it exists.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the calibration as JSON instead of one line.")] = False,
) -> None:
    """Measure how steeply light falls off around lamps: the Br50 below which gallen2014 sees fog."""
    from fogsim.calibration.halo_calibration import measure_halo_threshold
    from fogsim.core.files.atomic import write_bytes
    from fogsim.core.files.output_targets import refuse_unwritable
    from fogsim.offline.camera_file import load_camera

    refuse_unwritable(out, "--out", overwrite=overwrite, read=[camera])
    known = load_camera(camera)
    with measuring_bar("halos", scenes, "scenes", _ENDED) as watch:
        measured = measure_halo_threshold(known, scenes, glare=lens_glare, seed=seed, watch=watch)
    write_bytes(out, (measured.as_json() + "\n").encode())
    if as_json:
        typer.echo(json.dumps(json.loads(measured.as_json())))
        return
    stdout.print(
        f"fog below a sharpness of {measured.sharpness:g} levels a pixel, as published a mean Br50 of "
        f"{measured.steepness:g} (of {measured.pictures} pictures, at most {100 * measured.largest_errors:.1f} and "
        f"{100 * measured.mean_errors:.1f} % of the clear or the foggy ones are taken for the other): {escape(out)}",
        soft_wrap=True,
    )


@calibrate.command("drivers")
def calibrate_drivers_command(
    data: Annotated[Path, typer.Argument(help="CSV of vehicles: visibility_m, speed_kmh, headway_s, session.")],
    out: Annotated[Path, typer.Option(help="File to write: the block drivers of a scenario.")] = Path("drivers.yaml"),
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace OUT if it exists.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the constants as JSON instead of a table.")] = False,
) -> None:
    """Fit drivers to your own measurements of speed and headway in fog (docs/how_to/own_drivers.md)."""
    from fogsim.calibration.driver_calibration import FITTED, LEAST, fit_drivers, read_passages
    from fogsim.core.files.atomic import write_text
    from fogsim.core.files.output_targets import refuse_unwritable

    refuse_unwritable(out, "--out", overwrite=overwrite, read=[data])
    passages = read_passages(data)
    try:
        with interruptible():
            fitted = fit_drivers(passages)
    except InputError as error:
        raise InputError(f"{data}: {error}") from error
    except KeyboardInterrupt:
        stderr.print("interrupted; nothing is written")
        raise typer.Exit(INTERRUPTED) from None
    write_text(out, fitted.as_yaml(printable(data.name, in_one_line=True)))
    if lacking := [name for name in FITTED if name not in fitted.constants]:
        reason = f"fewer than {LEAST} vehicles in fog show it, or leave it open above; the default stays"
        print_remarks("not fitted", (f"{', '.join(lacking)}: {reason}",))
    found = {**fitted.constants, **{f"following.{kind}": share for kind, share in fitted.following.items()}}
    if as_json:
        typer.echo(json.dumps({name: one._asdict() for name, one in found.items()}))
        return
    table = Table("constant", "value", "90 % interval", box=None, pad_edge=False)
    for name, (value, low, high) in found.items():
        table.add_row(name, f"{value:.3f}", f"{low:.3f} to {high:.3f}")
    stdout.print(table)
    vehicles = f"{fitted.fog} vehicles in fog, {fitted.clear} in clear air"
    shares = "" if fitted.following else "; too few headways for drivers.following"
    stdout.print(f"{vehicles}{shares}: {escape(out)}", soft_wrap=True)
