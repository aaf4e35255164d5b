"""``fogsim restore``: restore contrast that fog removed from images and videos."""

import contextlib
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fogsim.cli.images.sources import Images, IsSequence, Rate, found_source
from fogsim.cli.option_values import pixel_values
from fogsim.cli.printing import BAD_INPUT, INTERRUPTED, escape, print_error, print_remarks, stderr, stdout
from fogsim.cli.progress import progress_bar
from fogsim.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from fogsim.offline import Source
    from fogsim.offline.restoration import RestorationWish, Restored


def restore_command(
    images: Images,
    camera: Annotated[
        Path, typer.Option(help="camera.yaml: the calibration; fogsim estimate --guess-camera writes one.")
    ],
    out: Annotated[Path, typer.Option(help="Restored image or .mp4; for several images, a folder.")],
    method: Annotated[str, typer.Option(help="planar, dark_channel or tarel2009.")] = "planar",
    visibility: Annotated[
        float | None,
        typer.Option(
            min=0.1, max=math.inf, help="Meteorological visibility in metres. Default: estimated by joint_road."
        ),
    ] = None,
    most_gain: Annotated[
        float | None, typer.Option(min=1, max=1000, help="Largest amplification of light and noise. Default: 5.")
    ] = None,
    airlight: Annotated[
        str | None,
        typer.Option(metavar="R,G,B", help="Pixel values of the airlight. Default: those above the horizon."),
    ] = None,
    tone_map: Annotated[bool, typer.Option("--tone-map", help="Compress brightness for viewing.")] = False,
    beside: Annotated[bool, typer.Option("--beside", help="Write original and restored image side by side.")] = False,
    sequence: IsSequence = None,
    rate: Rate = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace existing files.")] = False,
) -> None:
    """Restore contrast that daytime fog removed from your own images or video (docs/how_to/restoration.md)."""
    from fogsim.offline import load_calibration, straightened
    from fogsim.offline.image_files import IMAGE_ENDINGS
    from fogsim.offline.restoration import RestorationWish, restore_files, restore_video
    from fogsim.offline.source import ImageFiles
    from fogsim.offline.video_source import left_out
    from fogsim.vision.restoration import MOST_GAIN

    light = None if airlight is None else pixel_values(airlight)
    gain = MOST_GAIN if most_gain is None else most_gain
    wish = RestorationWish(method, visibility, gain, light, tone_map, beside)
    calibration = load_calibration(camera)
    print_remarks("assumed", calibration.remarks)
    given = found_source(images, sequence, rate)
    source, pinhole = straightened(given, calibration)
    is_files = isinstance(given, ImageFiles)
    if given.count > 1 and out.suffix.lower() in IMAGE_ENDINGS and not out.is_dir():
        raise InputError(f"--out {out}: {given.count} images go into a folder, and this is the name of an image")
    tally, is_interrupted = _Tally(is_files), False
    restore = restore_files if is_files else restore_video
    try:
        with contextlib.closing(restore(source, pinhole, wish, out, overwrite=overwrite)) as results:
            tally.count(results, source)
    except KeyboardInterrupt:
        if given.count == 1 or not is_files:
            raise
        is_interrupted = True
    finally:
        if is_files:
            _report_missing(tally.lacking)
    _print_counts(out, wish, tally)
    if is_interrupted:
        stdout.print("Interrupted; the same command continues it.")
        raise typer.Exit(INTERRUPTED)
    if is_files and (kept := given.count - tally.seen):
        stdout.print(f"{kept} more had been restored before an interruption")
    print_remarks("left out", left_out(given))
    if tally.lacking and is_files:
        raise typer.Exit(BAD_INPUT)
    if tally.lacking:
        text = f"{len(tally.lacking)} frames before the first estimate are as they were: {tally.lacking[0]}"
        print_remarks("not restored", (text,))


class _Tally:
    """Results image by image: `seen` of them, `restored`, `held` with an earlier estimate, and why others lack."""

    def __init__(self, are_files: bool) -> None:
        self._are_files = are_files
        self.seen = self.restored = self.held = 0
        self.lacking = list[str]()
        self.extinction: float | None = None  # of the last [1/m]

    def count(self, results: "Iterable[Restored]", source: "Source") -> None:
        with progress_bar(stderr) as progress:
            task = progress.add_task(source.description, total=source.count)
            for one in results:
                if one.image is None:  # its text alone: a drive's images would fill the memory
                    named = self._are_files and not one.picture.error
                    self.lacking.append(f"{one.picture.name}: {one.reason}" if named else one.reason)
                self.seen += 1
                self.restored += one.image is not None
                self.held += one.held
                self.extinction = one.extinction
                progress.advance(task)


def _print_counts(out: Path, wish: "RestorationWish", tally: _Tally) -> None:
    from fogsim.units import visibility_from_extinction

    number = tally.restored
    if not number:
        return
    text = f"{out}: {'1 image' if number == 1 else f'{number} images'} restored by {wish.method}"
    if tally.extinction is not None and number == 1:
        text += f", visibility {visibility_from_extinction(tally.extinction):.4g} m"
        text += " (estimated by joint_road)" if wish.estimates else ""
    stdout.print(escape(text), soft_wrap=True)
    if tally.held:
        print_remarks("held", (f"in {tally.held} images had no estimate; the last one was used",))


def _report_missing(lacking: list[str]) -> None:
    """Report why images were not restored."""
    if not lacking:
        return
    advice = " (--visibility does without an estimate)" if any("no visibility: " in one for one in lacking) else ""
    print_error(f"{len(lacking)} of the images could not be restored{advice}:")
    for reason in lacking:
        stderr.print(f"  {escape(reason, in_one_line=True)}", soft_wrap=True)
