"""When images were taken, by their EXIF data."""

import contextlib
import warnings
from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path

from PIL import Image

from fogsim.offline.image_files import IMAGE_FAULTS

_EXIF_IFD, _TAKEN, _PART_OF_SECOND = 0x8769, 0x9003, 0x9291  # EXIF 2.32: DateTimeOriginal and SubSecTimeOriginal


def capture_times(paths: Iterable[Path]) -> list[float]:
    """Seconds since 1970 by each camera's clock; none unless all files have them."""
    times = list[float]()
    for path in paths:
        time = _capture_time(path)
        if time is None:
            return []
        times.append(time)
    return times


def _capture_time(path: Path) -> float | None:
    with contextlib.suppress(*IMAGE_FAULTS), warnings.catch_warnings(action="ignore"), Image.open(path) as image:
        if image.format == "PNG" and "exif" not in image.info:
            return None  # Pillow would decode it to look behind its pixels
        tags = image.getexif().get_ifd(_EXIF_IFD)
        moment = datetime.strptime(str(tags[_TAKEN]).strip("\0 "), "%Y:%m:%d %H:%M:%S").replace(tzinfo=UTC)
        digits = str(tags.get(_PART_OF_SECOND, "")).strip("\0 ")
        return moment.timestamp() + (float(f"0.{digits}") if digits.isdecimal() else 0.0)
    return None
