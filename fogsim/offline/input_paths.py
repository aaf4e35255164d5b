"""From paths on a command line to images."""

import glob
import itertools
import math
import re
import warnings
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Annotated

from fogsim.core.files.readers import nearest_file
from fogsim.core.parameters import NUMBER_OR_NAN, checked_parameters
from fogsim.errors import InputError
from fogsim.offline.image_files import IMAGE_ENDINGS
from fogsim.offline.image_times import capture_times
from fogsim.offline.source import Animation, ImageFiles, Source
from fogsim.offline.video_source import VideoFile

_VIDEO_ENDINGS = (
    *(".mp4", ".m4v", ".mov", ".avi", ".mkv", ".webm", ".mpg", ".mpeg", ".ts", ".mts", ".m2ts"),
    *(".wmv", ".flv", ".3gp"),
)
"""Suffixes of videos."""

_SEQUENCE_RATE = 10.0
"""Default number of images of a numbered sequence per second [1/s]."""

_LONGEST_STEP = 2.0
"""Longest time between two images of a drive that is found by the names and times of its files [s]."""

_NO_PICTURES = (".yaml", ".yml", ".json", ".geojson", ".csv", ".gpx", ".txt", ".md")
"""Suffixes of text, which lies next to images and is no image that a folder's reader could miss."""


@checked_parameters
def find_source(
    inputs: Iterable[str | Path] | str | Path,
    *,
    sequence: bool | None = None,
    rate: Annotated[float, NUMBER_OR_NAN] | None = None,
) -> Source:
    """Find the images of paths, folders and patterns.

    Parameters
    ----------
    inputs : path or iterable of paths
        One video, or any number of image files, folders of them (in the order of the numbers in their names), and
        patterns like ``"drive/*.png"``.
    sequence : bool or None
        Whether images follow one another in time. None: a video does, and so do images whose names differ in one
        number that grows in equal steps, unless by their EXIF times any two are more than 2 s apart.
    rate : float or None
        Images of a sequence in a second [1/s]; None for that of their EXIF times, or 10 without.

    Returns
    -------
    Source
        The source; its images are read later. The `remarks` of image files say what was assumed or left out.

    Raises
    ------
    InputError
        If a file does not exist, a folder or pattern has no images, the rate is not positive, there is a video among
        others, or files of a sequence are in the order of their names as text instead of their numbers.
    """
    given = [inputs] if isinstance(inputs, str | Path) else list(inputs)
    if rate is not None and not (rate > 0 and math.isfinite(rate)):
        raise InputError(f"--rate must be a positive number of images a second, got {rate!r}")
    paths = [path for one in given for path in _paths(str(one))]
    if not paths:
        raise InputError("no image and no video is given")
    animation = Animation.open(paths[0], sequence is not False) if len(paths) == 1 else None
    if animation is None and not any(is_video(path) for path in paths):
        temporal, period, remarks = _timing(paths, sequence, rate)
        if temporal and paths == sorted(paths, key=str) != _ordered(paths):
            raise InputError(
                f"--sequence: {paths[0]}, {paths[1]}, … are in the order of their names as text, as a shell puts them, "
                "not of their numbers: give the folder, or the pattern in quotes"
            )
        if sequence and (gap := _first_gap(paths)):
            warnings.warn(
                f"--sequence: the numbers of {gap[0]} and {gap[1]} are farther apart than others: images may be "
                f"missing there; each is taken as {period:g} s after the one before",
                stacklevel=2,
            )
        return ImageFiles(tuple(paths), temporal, period, (*remarks, *_left_out(given)))
    if len(paths) > 1:
        raise InputError(f"expected images, or one video alone, got {len(paths)} files with a video among them")
    if rate is not None:
        what = "a video" if animation is None else "an animation"
        raise InputError(f"--rate is for image files; {paths[0]} is {what} and has its own")
    return animation or VideoFile.open(paths[0], temporal=sequence is not False)


def is_video(path: Path) -> bool:
    """Whether a file is a video, by its suffix."""
    return path.suffix.lower() in _VIDEO_ENDINGS


def _paths(given: str) -> list[Path]:
    path = Path(given)
    if path.is_dir():
        found = _ordered(one for one in _seen(path) if one.suffix.lower() in IMAGE_ENDINGS)
        if not found:
            others = f"; it has {kinds}" if (kinds := _others(path)) else ""
            raise InputError(
                f"{path}: the folder contains no image with one of the endings {', '.join(IMAGE_ENDINGS)}{others}"
            )
        return found
    if path.exists():
        return [path]
    if any(sign in given for sign in "*?["):
        found = _ordered(Path(one) for one in glob.glob(given, recursive=True) if Path(one).is_file())  # noqa: PTH207 - Path.glob takes no absolute pattern
        if not found:
            raise InputError(f"{given}: no file fits this pattern")
        return found
    raise InputError(f"{given}: there is no such file or folder{nearest_file(path)}")


def _seen(folder: Path) -> list[Path]:
    # Hidden files, as "._1.png" of macOS, are no images; patterns leave them out, too.
    return [one for one in folder.iterdir() if not one.name.startswith(".") and one.is_file()]


def _others(folder: Path) -> str:
    """Numbers and suffixes of files in a folder that are not read and could be images."""
    suffixes = (one.suffix.lower() for one in _seen(folder))
    counts = Counter(one for one in suffixes if one not in (*IMAGE_ENDINGS, *_NO_PICTURES))
    return ", ".join(f"{number} × {suffix or 'no ending'}" for suffix, number in counts.most_common())


def _left_out(given: Iterable[str | Path]) -> Iterator[str]:
    for folder in (Path(one) for one in given if Path(one).is_dir()):
        if kinds := _others(folder):
            yield f"{folder}: left out, since only {', '.join(IMAGE_ENDINGS)} are read from a folder: {kinds}"


def _timing(paths: Sequence[Path], sequence: bool | None, rate: float | None) -> tuple[bool, float, list[str]]:
    """Whether files are a sequence, the time between two images [s], and what was assumed."""
    period = 1.0 / (rate or _SEQUENCE_RATE)
    if len(paths) < 2 or not (is_sequence(paths) if sequence is None else sequence):
        return bool(sequence), period, []
    times = capture_times(paths)
    steps = [after - before for before, after in itertools.pairwise(times)]
    if steps and sequence is None and not 0.0 <= min(steps) <= max(steps) <= _LONGEST_STEP:
        apart = f"up to {max(steps):.0f} s apart" if min(steps) >= 0.0 else "in another order"
        text = f"the names of {len(paths)} images count on, but by their EXIF times they were taken {apart}: "
        return False, period, [text + "each is read by itself; --sequence reads them as one drive"]
    if rate is not None:
        return True, period, []
    if steps and min(steps) >= 0.0 and times[-1] > times[0]:
        return True, (times[-1] - times[0]) / len(steps), []
    text = f"{len(paths)} images are taken as one drive, {_SEQUENCE_RATE:g} a second, since no EXIF times say "
    return True, period, [text + "otherwise: --rate changes it, and --stills reads each by itself"]


def _ordered(paths: Iterable[Path]) -> list[Path]:
    """Sort by name, with numbers in it by their value: image 9 comes before image 10."""

    def key(path: Path) -> list[tuple[int, int, str]]:
        parts = re.split(r"([0-9]+)", str(path))
        return [(1, int(part), part) if part.isdecimal() else (0, 0, part) for part in parts]

    return sorted(paths, key=key)


def is_sequence(paths: Sequence[Path]) -> bool:
    """Whether files are a numbered sequence: names that differ in one number, which grows in equal steps."""
    steps = set(_steps(paths))
    return len(steps) == 1 and min(steps) > 0


def _first_gap(paths: Sequence[Path]) -> Sequence[Path]:
    """The two files of a numbered sequence between which numbers are first left out; none without a gap."""
    steps = _steps(paths)
    usual = min(steps, default=0)
    return next((paths[i : i + 2] for i, step in enumerate(steps) if step > 1.5 * usual > 0.0), ())


def _steps(paths: Sequence[Path]) -> list[int]:
    """Differences between the numbers of files whose names differ in one number; none of others."""
    # The last number counts: "drive2_cam1_0007.png".
    parts = [re.fullmatch(r"(.*?)([0-9]+)([^0-9]*)", path.name) for path in paths]
    matches = [part for part in parts if part is not None]
    if len(matches) < len(paths):
        return []
    around = {(path.parent, match[1], match[3]) for path, match in zip(paths, matches, strict=True)}
    numbers = [int(match[2]) for match in matches]
    return [after - before for before, after in itertools.pairwise(numbers)] if len(around) == 1 else []
