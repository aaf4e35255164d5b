"""``fogsim estimate``: estimate visibility in a user's images and videos."""

import contextlib
import io
import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from fogsim.cli.images.sources import Images, IsSequence, Rate, found_source
from fogsim.cli.printing import BAD_INPUT, INTERRUPTED, escape, print_error, print_remarks, stderr, stdout
from fogsim.cli.progress import counting_bar, progress_bar
from fogsim.errors import InputError, printable

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from fogsim.offline import Calibration, CameraGuess, FrameEstimates, NightDrive, SignWatch, Source
    from fogsim.offline.calibration_deviations import CalibrationDeviations
    from fogsim.offline.clip_summary import Clip
    from fogsim.values import Camera

_PLOTS = (".png", ".svg", ".pdf")


def estimate_command(
    images: Images,
    camera: Annotated[
        Path | None, typer.Option(help="camera.yaml: the calibration. Default: guessed from the images.")
    ] = None,
    method: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME|all", help="A method (fogsim list); may be repeated. Default: joint_road."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object per image and method.")] = False,
    as_csv: Annotated[bool, typer.Option("--csv", help="Print one CSV row per image and method.")] = False,
    plot: Annotated[
        Path | None, typer.Option(help="Plot visibility over time: .png, .svg or .pdf. Not for stills.")
    ] = None,
    overlay: Annotated[
        Path | None, typer.Option(help="Draw the results over the images: .mp4, or .png for one image.")
    ] = None,
    sequence: IsSequence = None,
    rate: Rate = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace an overlay, a plot or a guessed camera file.")
    ] = False,
    signs: Annotated[Path | None, typer.Option(help="Sign map: GeoJSON, points in WGS 84. With --track.")] = None,
    track: Annotated[
        Path | None,
        typer.Option(help="Camera positions, for signs or a guess: .gpx, or .csv (time_s, latitude, longitude)."),
    ] = None,
    track_offset: Annotated[
        float, typer.Option(min=-1e9, max=1e9, help="Time of the track at the first image in seconds.")
    ] = 0.0,
    night: Annotated[
        bool,
        typer.Option("--night", help="A drive by night: use methods that read lamplight, unless others are named."),
    ] = False,
    lamps: Annotated[
        str | None,
        typer.Option(help="The vehicle's lit lamps by night, such as low_beam+front_fog. Default: low_beam."),
    ] = None,
    setback: Annotated[
        float | None,
        typer.Option(min=0, max=10, help="Metres from the front bumper back to the lens, by night. Default: 1.9."),
    ] = None,
    head_lamps: Annotated[
        Path | None,
        typer.Option(help="File of the vehicle's head lamps (docs/explanation/night.md). Default: a car's."),
    ] = None,
    halos: Annotated[Path | None, typer.Option(help="File from fogsim calibrate halos.")] = None,
    guess_camera: Annotated[
        bool, typer.Option("--guess-camera", help="Write the guess to --camera, and stop.")
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
        typer.Option(min=0, max=1e6, help="For a guess: row of the horizon, instead of finding it from lane marks."),
    ] = None,
) -> None:
    """Estimate the visibility in your own images or video (docs/how_to/estimate.md)."""
    from fogsim.offline import chosen_methods

    if track is None:
        _refuse_given({"--track-offset": track_offset or None}, "goes with --track")
    guessing = _Guessing(mount_height, field_of_view, horizon_row, track, track_offset)
    if guess_camera:
        if camera is None:
            raise InputError("--guess-camera writes a camera file and needs its name: --camera camera.yaml")
        estimating = {"--method": method, "--json": as_json, "--csv": as_csv, "--plot": plot, "--overlay": overlay}
        by_night = {"--night": night, "--lamps": lamps, "--setback": setback, "--head-lamps": head_lamps}
        unused = {**estimating, "--signs": signs, **by_night, "--halos": halos}
        _refuse_given(unused, "does not go with --guess-camera, which estimates no visibility")
        _guess(found_source(images, sequence, rate), camera, overwrite, guessing)
        return
    if camera is not None:
        guessing.refuse_all()
        if track is not None and signs is None:
            raise InputError("--track goes with --signs, or without --camera, for a guess of the camera")
    if as_json and as_csv:
        raise InputError("--json and --csv both go to stdout: give one of them")
    drive = _night_drive(night, lamps, setback, head_lamps, halos)
    methods = chosen_methods(_methods(method, drive, mapped=signs is not None))
    source = found_source(images, sequence, rate)
    if overlay is None and not source.temporal:
        _refuse_given({"--rate": rate}, "is for a sequence or an overlay; these are stills, unless --sequence is given")
    outputs = _Outputs(as_json, as_csv, overlay, plot, overwrite)
    _check_plot(outputs, source)
    calibration = _calibration(source, camera, guessing)
    _estimate(source, calibration, methods, outputs, (signs, track, track_offset), drive)


def _refuse_given(options: "Mapping[str, object]", reason: str) -> None:
    """Refuse the first option that is given; those that are not are None, or False for flags."""
    for option, value in options.items():
        if value is not None and value is not False:
            raise InputError(f"{option} {reason}")


def _methods(named: list[str] | None, night: "NightDrive | None", *, mapped: bool) -> list[str]:
    """Named methods, or those that can apply: by day, by night, with a map of signs."""
    from fogsim.offline import NIGHT_METHODS

    if named or night is not None:
        return named or list(NIGHT_METHODS)
    return ["joint_road", *(("sign_contrast", "belaroussi2015") if mapped else ())]


@dataclass(frozen=True)
class _Guessing:
    """What is stated of an unknown camera: height [m], field of view [deg], row of the horizon [px], its way."""

    mount_height: float | None
    field_of_view: float | None
    horizon_row: float | None
    track: Path | None
    track_offset: float

    def refuse_all(self) -> None:
        stated = {"--mount-height": self.mount_height, "--field-of-view": self.field_of_view}
        _refuse_given({**stated, "--horizon-row": self.horizon_row}, "is for a guess; the camera file has it")

    def __call__(self, source: "Source") -> "CameraGuess":
        from fogsim.offline import guess_camera
        from fogsim.offline.drive.track_file import load_track

        track = None if self.track is None else load_track(self.track)
        way = None if track is None else lambda time: track.way_at(time + self.track_offset)

        with counting_bar(stderr, "looking for the camera's horizon and height") as progress:
            return guess_camera(
                source,
                mount_height=self.mount_height,
                field_of_view=None if self.field_of_view is None else math.radians(self.field_of_view),
                horizon_row=self.horizon_row,
                way=way,
                progress=progress,
            )


@dataclass(frozen=True)
class _Outputs:
    """Where results go."""

    as_json: bool
    as_csv: bool
    overlay: Path | None
    plot: Path | None
    overwrite: bool


def _calibration(source: "Source", camera: Path | None, guessing: _Guessing) -> "Calibration":
    from fogsim.offline import Calibration, load_calibration
    from fogsim.offline.guess import guess_text

    if camera is not None:
        calibration = load_calibration(camera)
        print_remarks("assumed", calibration.remarks)
        return calibration
    guess = guessing(source)
    print_remarks("guessed", (guess_text(guess),))
    print_remarks("uncertain", guess.warnings)
    return Calibration(guess.camera, deviations=guess.deviations)


def _night_drive(
    night: bool, lamps: str | None, setback: float | None, head_lamps: Path | None, halos: Path | None
) -> "NightDrive | None":
    from fogsim.calibration.veil_references import lamps_named
    from fogsim.estimators.night.own_light import KNOWN_HEAD_LAMPS
    from fogsim.offline import NightDrive

    if not night:
        by_night = {"--lamps": lamps, "--setback": setback, "--head-lamps": head_lamps, "--halos": halos}
        _refuse_given(by_night, "goes with --night")
        return None
    for option, file in (("--head-lamps", head_lamps), ("--halos", halos)):
        if file is not None and not file.is_file() and str(file) not in KNOWN_HEAD_LAMPS:
            raise InputError(f"{option} {file}: there is no such file")
    usual = NightDrive()
    lit = usual.lamps if lamps is None else lamps_named(lamps)
    # 0 would be unknown.
    return NightDrive(lit, usual.setback if setback is None else max(setback, 0.001), head_lamps, halos)


def _estimate(
    images: "Source",
    calibration: "Calibration",
    methods: tuple[str, ...],
    outputs: _Outputs,
    mapped: tuple[Path | None, Path | None, float],
    night: "NightDrive | None",
) -> None:
    from fogsim.offline import straightened
    from fogsim.offline.clip_summary import Clip
    from fogsim.offline.video_source import left_out

    source, camera = straightened(images, calibration)
    watch = _watch(mapped, source, camera)
    clip, rows = Clip(methods, camera if night is None else None), _Rows(source, methods, outputs)
    is_interrupted = False
    try:
        _each(source, camera, methods, outputs, rows, clip, watch, night, calibration.deviations)
    except KeyboardInterrupt:
        is_interrupted = True
    if rows.are_summed_up and rows.count:
        for line in clip.lines():
            _say(printable(line, in_one_line=True))
    print_remarks("uncertain", clip.remarks())
    if watch is not None:
        _show_signs(watch, quiet=outputs.as_json or outputs.as_csv)
    if is_interrupted:
        _end_early(rows, source, outputs)
    if outputs.plot is not None:
        _write_plot(clip, outputs.plot, source)
    if outputs.overlay is not None:
        stderr.print(f"overlay: {escape(outputs.overlay)}", soft_wrap=True)
        print_remarks("left out", left_out(images))
    if rows.unusable:
        print_error(f"{len(rows.unusable)} of the images could not be used:")
        for reason in rows.unusable:
            stderr.print(f"  {escape(reason, in_one_line=True)}", soft_wrap=True)
        raise typer.Exit(BAD_INPUT)


def _end_early(rows: "_Rows", source: "Source", outputs: _Outputs) -> NoReturn:
    lacking = [f"no {name}" for name, file in (("plot", outputs.plot), ("overlay", outputs.overlay)) if file]
    end = f"; {' and '.join(lacking)} is written" if lacking else ""
    stderr.print(f"interrupted after {rows.count} of {source.count} images{end}", soft_wrap=True)
    raise typer.Exit(INTERRUPTED)


def _each(
    source: "Source",
    camera: "Camera",
    methods: tuple[str, ...],
    outputs: _Outputs,
    rows: "_Rows",
    clip: "Clip",
    watch: "SignWatch | None",
    night: "NightDrive | None",
    deviations: "CalibrationDeviations",
) -> None:
    """Estimate on image after image, show and sum up the results, and write the overlay."""
    from fogsim.offline import OverlayFile, estimates_of

    with contextlib.ExitStack() as stack:
        drawn = outputs.overlay and stack.enter_context(
            OverlayFile(outputs.overlay, source, camera, methods, overwrite=outputs.overwrite)
        )
        progress = stack.enter_context(progress_bar(stderr))
        task = progress.add_task(source.description, total=source.count)
        rows.begin()
        for result in estimates_of(source, camera, methods, watch, night, deviations):
            rows.show(result)
            clip.add(result)
            if drawn:
                drawn.add(result)
            progress.advance(task)
            if stdout.quiet and not (drawn or outputs.plot):
                break  # who read the results has gone


def _check_plot(outputs: _Outputs, source: "Source") -> None:
    from fogsim.core.files.output_targets import refuse_unwritable

    if outputs.plot is None:
        return
    if not source.temporal:
        raise InputError("--plot draws over time, and stills have none: --sequence says that images follow one another")
    if outputs.plot.suffix.lower() not in _PLOTS:
        raise InputError(f"--plot must end in {', '.join(_PLOTS[:-1])} or {_PLOTS[-1]}, got {outputs.plot}")
    refuse_unwritable(outputs.plot, "--plot", overwrite=outputs.overwrite, read=source.paths)


def _write_plot(clip: "Clip", path: Path, source: "Source") -> None:
    from fogsim.core.files.atomic import write_bytes

    content = io.BytesIO()
    clip.plot(source.paths[0].name).savefig(content, format=path.suffix[1:].lower(), dpi=150)
    write_bytes(path, content.getvalue())
    stderr.print(f"plot: {escape(path)}", soft_wrap=True)


def _watch(mapped: tuple[Path | None, Path | None, float], source: "Source", camera: "Camera") -> "SignWatch | None":
    from fogsim.offline import watch_signs

    signs, track, offset = mapped
    if signs is None:
        return None
    if track is None:
        raise InputError("--signs needs --track: a map says nothing without places")
    watch, remarks = watch_signs(signs, track, source, camera, offset)
    print_remarks("assumed", remarks)
    return watch


def _show_signs(watch: "SignWatch", *, quiet: bool) -> None:
    from fogsim.offline import summary_rows

    if not quiet:
        for line in summary_rows(watch.summary()):
            _say(printable(line, in_one_line=True))
    print_remarks("signs", watch.remarks())


class _Rows:
    """Results image by image, as JSON or CSV; for stills, where each one stands alone, as a table."""

    def __init__(self, source: "Source", methods: tuple[str, ...], outputs: _Outputs) -> None:
        self._source, self._methods, self._outputs = source, methods, outputs
        self.are_summed_up = source.temporal and not (outputs.as_json or outputs.as_csv)
        self.count, self.unusable = 0, list[str]()

    def begin(self) -> None:
        from fogsim.offline import csv_line, table_heading

        if self._outputs.as_csv:
            _say(csv_line())
        elif not (self._outputs.as_json or self.are_summed_up):
            _say(table_heading(self._source, self._methods))

    def show(self, result: "FrameEstimates") -> None:
        self.count += 1
        if result.picture.error:
            self.unusable.append(result.picture.error)
            print_remarks("passed over", (result.picture.error,))
        for line in self._lines(result):
            _say(printable(line, in_one_line=True))

    def _lines(self, result: "FrameEstimates") -> "Iterator[str]":
        from fogsim.offline import csv_lines, record_lines, table_rows

        if self._outputs.as_json:
            return record_lines(result)
        if self._outputs.as_csv:
            return csv_lines(result)
        return iter(()) if self.are_summed_up else table_rows(self._source, self._methods, result)


def _say(line: str) -> None:
    # Through sys.stdout as it is now: on a terminal rich has put itself there, to move its bar out of the way.
    try:
        sys.stdout.write(line + "\n")
        sys.stdout.flush()
    except BrokenPipeError:
        stdout.on_broken_pipe()


def _guess(source: "Source", camera_file: Path, overwrite: bool, guessing: _Guessing) -> None:
    from fogsim.core.files.output_targets import refuse_unwritable
    from fogsim.offline import camera_text, write_camera

    refuse_unwritable(camera_file, "--camera", overwrite=overwrite, read=source.paths)
    guess = guessing(source)
    write_camera(camera_file, guess, overwrite=overwrite)
    typer.echo(f"{printable(str(camera_file))}:\n\n{camera_text(guess)}", nl=False)
    print_remarks("uncertain", guess.warnings)
