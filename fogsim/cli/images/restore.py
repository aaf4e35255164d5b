"""``fogsim restore``: restore contrast that fog removed from images and videos."""

import contextlib
import math
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fogsim.cli.option_values import pixel_values
from fogsim.cli.printing import BAD_INPUT, escape, print_error, print_remarks, stderr, stdout
from fogsim.cli.progress import progress_bar

if TYPE_CHECKING:
    from fogsim.offline.restoration import RestorationWish, Restored


def restore_command(
    images: Annotated[
        list[str],
        typer.Argument(metavar="IMAGES|VIDEO", help="Image files, folders, patterns like 'a/*.png', or a video."),
    ],
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
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace existing files.")] = False,
) -> None:
    """Restore contrast that daytime fog removed from your own images or video (docs/how_to/restoration.md)."""
    from fogsim.offline import find_source, load_calibration, straightened
    from fogsim.offline.restoration import RestorationWish, restore_files, restore_video
    from fogsim.offline.source import ImageFiles
    from fogsim.offline.video_source import left_out
    from fogsim.vision.restoration import MOST_GAIN

    light = None if airlight is None else pixel_values(airlight)
    gain = MOST_GAIN if most_gain is None else most_gain
    wish = RestorationWish(method, visibility, gain, light, tone_map, beside)
    calibration = load_calibration(camera)
    print_remarks("assumed", calibration.remarks)
    given = find_source(images)
    source, pinhole = straightened(given, calibration)
    is_files, lacking, counts = isinstance(given, ImageFiles), list[str](), Counter[str]()
    restore = restore_files if is_files else restore_video
    try:
        with (
            progress_bar(stderr) as progress,
            contextlib.closing(restore(source, pinhole, wish, out, overwrite=overwrite)) as results,
        ):
            task = progress.add_task(source.description, total=source.count)
            for one in results:
                if one.image is None:  # its text alone: a drive's images would fill the memory
                    named = is_files and not one.picture.error
                    lacking.append(f"{one.picture.name}: {one.reason}" if named else one.reason)
                counts["restored" if one.image is not None else "lacking"] += 1
                counts["held"] += one.held
                last = one
                progress.advance(task)
    finally:
        if is_files:
            _report_missing(lacking)
    _print_counts(out, wish, counts, last)
    print_remarks("left out", left_out(given))
    if lacking and is_files:
        raise typer.Exit(BAD_INPUT)
    if lacking:
        text = f"{len(lacking)} frames before the first estimate are as they were: {lacking[0]}"
        print_remarks("not restored", (text,))


def _print_counts(out: Path, wish: "RestorationWish", counts: "Counter[str]", last: "Restored") -> None:
    from fogsim.units import visibility_from_extinction

    if not counts["restored"]:
        return
    number = counts["restored"]
    text = f"{out}: {'1 image' if number == 1 else f'{number} images'} restored by {wish.method}"
    if last.extinction is not None and number == 1:
        text += f", visibility {visibility_from_extinction(last.extinction):.4g} m"
        text += " (estimated by joint_road)" if wish.estimates else ""
    stdout.print(escape(text), soft_wrap=True)
    if counts["held"]:
        print_remarks("held", (f"in {counts['held']} images had no estimate; the last one was used",))


def _report_missing(lacking: list[str]) -> None:
    """Report why images were not restored."""
    if not lacking:
        return
    print_error(f"{len(lacking)} of the images could not be restored (--visibility does without an estimate):")
    for reason in lacking:
        stderr.print(f"  {escape(reason, in_one_line=True)}", soft_wrap=True)
