"""``fogsim estimate``: the visibility in a person's own images and videos."""

import contextlib
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fogsim.cli.printing import BAD_INPUT, escape, print_error, print_remarks, stderr
from fogsim.cli.progress import progress_bar
from fogsim.errors import InputError, printable

if TYPE_CHECKING:
    from fogsim.offline import FrameEstimates, NightDrive, OverlayFile, SignWatch, Source
    from fogsim.values import Camera


def estimate_command(
    images: Annotated[
        list[str],
        typer.Argument(metavar="IMAGES|VIDEO", help="Image files, folders, patterns like 'a/*.png', or a video."),
    ],
    camera: Annotated[Path, typer.Option(help="camera.yaml: the calibration; --guess-camera writes it.")],
    method: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME|all", help="A method (fogsim list); may be repeated. Default: all."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object a line and method on stdout.")] = False,
    overlay: Annotated[
        Path | None, typer.Option(help="Draw what was found over the images: .mp4, or .png for one image.")
    ] = None,
    sequence: Annotated[
        bool | None,
        typer.Option(
            "--sequence/--stills", help="Images follow one another, or each stands alone. Default: by their names."
        ),
    ] = None,
    rate: Annotated[
        float | None, typer.Option(min=1e-6, max=1e6, help="Images of a sequence in a second. Default: 10.")
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace an overlay or a guessed camera file.")
    ] = False,
    signs: Annotated[Path | None, typer.Option(help="Map of signs: GeoJSON, points in WGS 84. With --track.")] = None,
    track: Annotated[
        Path | None, typer.Option(help="Where the camera was: .gpx, or .csv with time_s, latitude, longitude.")
    ] = None,
    track_offset: Annotated[
        float, typer.Option(min=-1e9, max=1e9, help="Seconds of the track at the first image.")
    ] = 0.0,
    night: Annotated[
        bool, typer.Option("--night", help="A drive by night: methods that read lamplight, unless some are named.")
    ] = False,
    lamps: Annotated[
        str | None, typer.Option(help="Own lamps that are lit by night, such as low_beam+front_fog. Default: low_beam.")
    ] = None,
    setback: Annotated[
        float | None,
        typer.Option(min=0, max=10, help="Metres from the front bumper back to the lens, by night. Default: 1.9."),
    ] = None,
    head_lamps: Annotated[
        Path | None, typer.Option(help="File of the own head lamps (docs/explanation/night.md). Default: a car's.")
    ] = None,
    halos: Annotated[Path | None, typer.Option(help="File of fogsim calibrate halos.")] = None,
    guess_camera: Annotated[
        bool, typer.Option("--guess-camera", help="Write the camera file from the images, and stop.")
    ] = False,
    mount_height: Annotated[
        float | None, typer.Option(min=0.1, max=20, help="For a guess: metres from the road to the lens.")
    ] = None,
    field_of_view: Annotated[
        float | None,
        typer.Option(min=1, max=170, help="For a guess: degrees from the image's left edge to its right."),
    ] = None,
    horizon_row: Annotated[
        float | None,
        typer.Option(min=0, max=1e6, help="For a guess: row of the horizon, in place of the lines of the road."),
    ] = None,
) -> None:
    """Estimate the visibility in your own images or video (docs/how_to/estimate.md)."""
    from fogsim.offline import NIGHT_METHODS, find_source

    if guess_camera:
        source = find_source(images, sequence=sequence, rate=rate)
        _guess(source, camera, overwrite, mount_height, field_of_view, horizon_row)
        return
    for option, value in (
        ("--mount-height", mount_height),
        ("--field-of-view", field_of_view),
        ("--horizon-row", horizon_row),
    ):
        if value is not None:
            raise InputError(f"{option} goes with --guess-camera; else the camera file has it")
    drive = _night_drive(night, lamps, setback, head_lamps, halos)
    names = method or (["all"] if drive is None else list(NIGHT_METHODS))
    mapped = (signs, track, track_offset)
    _estimate(images, camera, names, as_json, overlay, sequence, rate, overwrite, mapped, drive)


def _night_drive(
    night: bool, lamps: str | None, setback: float | None, head_lamps: Path | None, halos: Path | None
) -> "NightDrive | None":
    from fogsim.calibration.veil_references import lamps_named
    from fogsim.offline import NightDrive

    if not night:
        for option, value in (
            ("--lamps", lamps),
            ("--setback", setback),
            ("--head-lamps", head_lamps),
            ("--halos", halos),
        ):
            if value is not None:
                raise InputError(f"{option} goes with --night")
        return None
    usual = NightDrive()
    lit = usual.lamps if lamps is None else lamps_named(lamps)
    return NightDrive(lit, usual.setback if setback is None else setback, head_lamps, halos)


def _estimate(
    images: list[str],
    camera_file: Path,
    names: list[str],
    as_json: bool,
    overlay: Path | None,
    sequence: bool | None,
    rate: float | None,
    overwrite: bool,
    mapped: tuple[Path | None, Path | None, float],
    night: "NightDrive | None",
) -> None:
    from fogsim.offline import (
        OverlayFile,
        chosen_methods,
        estimates_of,
        find_source,
        straightened,
        table_heading,
    )
    from fogsim.offline.camera_file import load_calibration

    methods, unusable = chosen_methods(names), list[str]()
    calibration = load_calibration(camera_file)
    print_remarks("assumed", calibration.remarks)
    source, camera = straightened(find_source(images, sequence=sequence, rate=rate), calibration)
    watch = _watch(mapped, source, camera)
    with contextlib.ExitStack() as stack:
        drawn = overlay and stack.enter_context(OverlayFile(overlay, source, camera, methods, overwrite=overwrite))
        progress = stack.enter_context(progress_bar(stderr))
        task = progress.add_task(source.description, total=source.count)
        if not as_json:
            _say(table_heading(source, methods))
        for result in estimates_of(source, camera, methods, watch, night):
            _show(result, source, methods, as_json, drawn or None)
            unusable += [result.picture.error] if result.picture.error else []
            progress.advance(task)
    if watch is not None:
        _tell_signs(watch, as_json)
    if overlay is not None:
        stderr.print(f"overlay: {escape(overlay)}", soft_wrap=True)
    if unusable:
        print_error(f"{len(unusable)} of the images could not be used:")
        for reason in unusable:
            stderr.print(f"  {escape(reason, in_one_line=True)}", soft_wrap=True)
        raise typer.Exit(BAD_INPUT)


def _watch(mapped: tuple[Path | None, Path | None, float], source: "Source", camera: "Camera") -> "SignWatch | None":
    from fogsim.offline import watch_signs

    signs, track, offset = mapped
    if signs is None and track is None:
        return None
    if signs is None or track is None:
        lacking = "--signs" if signs is None else "--track"
        raise InputError(
            f"--signs and --track go together, and {lacking} is missing: a map says nothing without places"
        )
    watch, remarks = watch_signs(signs, track, source, camera, offset)
    print_remarks("assumed", remarks)
    return watch


def _tell_signs(watch: "SignWatch", as_json: bool) -> None:
    from fogsim.offline import summary_rows

    if not as_json:
        for line in summary_rows(watch.summary()):
            _say(printable(line, in_one_line=True))
    print_remarks("signs", watch.remarks())


def _show(
    result: "FrameEstimates", source: "Source", methods: tuple[str, ...], as_json: bool, drawn: "OverlayFile | None"
) -> None:
    from fogsim.offline import record_lines, table_rows

    if result.picture.error:
        print_remarks("passed over", (result.picture.error,))
    for line in record_lines(result) if as_json else table_rows(source, methods, result):
        _say(printable(line, in_one_line=True))
    if drawn is not None:
        drawn.add(result)


def _say(line: str) -> None:
    # Through sys.stdout as it is now: on a terminal rich has put itself there, to move its bar out of the way.
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def _guess(
    source: "Source",
    camera_file: Path,
    overwrite: bool,
    mount_height: float | None,
    field_of_view: float | None,
    horizon_row: float | None,
) -> None:
    from fogsim.files.output_targets import refuse_unwritable
    from fogsim.offline import camera_text, guess_camera, write_camera

    refuse_unwritable(camera_file, "--camera", overwrite=overwrite, read=source.paths)
    guess = guess_camera(
        source,
        mount_height=mount_height,
        field_of_view=None if field_of_view is None else math.radians(field_of_view),
        horizon_row=horizon_row,
    )
    write_camera(camera_file, guess, overwrite=overwrite)
    typer.echo(f"{printable(str(camera_file))}:\n\n{camera_text(guess)}", nl=False)
    print_remarks("uncertain", guess.warnings)
