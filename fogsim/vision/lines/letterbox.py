"""Bands above the picture that a recorder adds: black, perhaps with a line of text."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.values.camera import Camera
from fogsim.vision.light.pixel_kernels import Pixels

_BLACK, _ALIKE, _PICTURE = 32, 4, 56
"""Most value of a band's pixels, by how much they differ, and least value of a sky's by day [levels of 8 bits]."""

_BAND_SHARE, _PICTURE_SHARE = 0.6, 0.5
"""Least shares of a row that are band, text on it left out, and that are picture [-]: black bars may border it."""

_BLURRED = 9
"""Rows within which the picture begins [px]: compression blurs the edge of a band over a block of 8."""

_LEAST_SKY, _LEAST_ROAD = 4.0, 16.0
"""Least rows between the upper and the lower band and the horizon for sky and road to show [px]."""


def without_letterbox(image: Pixels, camera: Camera) -> Pixels:
    """Continue the sky of a picture over a black band above it, and its road over one below.

    By night there is no band, nor where it reaches down to the horizon; one below alone looks like a bonnet, which
    methods know. Takes `image` (rows, cols), which is not written to.
    """
    pixels: NDArray[Any] = image if image.ndim == 3 else image[:, :, None]
    level = 1 << (camera.bits - 8)
    first = _first_row(pixels, level, _PICTURE)
    if not 0 < first < camera.horizon_row - _LEAST_SKY:
        return image
    filled = image.copy()
    filled[:first] = image[first]
    last = camera.height - 1 - _first_row(np.ascontiguousarray(pixels[::-1]), level, _BLACK)
    if camera.horizon_row + _LEAST_ROAD < last < camera.height - 1:
        # What is to one side of the lane stays there: toward the camera, columns move away from the way ahead.
        below, axis = np.arange(last + 1, camera.height)[:, None] - camera.horizon_row, camera.principal_point[0]
        aside = (np.arange(camera.width) - axis) * ((last - camera.horizon_row) / below)
        filled[last + 1 :] = image[last, np.clip(np.rint(axis + aside), 0, camera.width - 1).astype(np.int64)]
    return filled


@kernel
def _first_row(pixels: Pixels, level: int, least: int) -> int:
    """Row in which the picture begins below a band; 0 without a band (`pixels` (rows, cols, channels))."""
    if pixels[0, 0].max() > _BLACK * level or pixels[0, -1].max() > _BLACK * level:
        return 0
    rows, corner, end = pixels.shape[0], pixels[0, 0], 0
    while end < rows and _share(pixels[end], corner, _ALIKE * level) >= _BAND_SHARE:
        end += 1
    for row in range(end, min(end + _BLURRED, rows - 1) if end else 0):
        if _bright_share(pixels[row], least * level) >= _PICTURE_SHARE:
            return row + 1
    return 0


@kernel
def _share(row: Pixels, value: Pixels, apart: int) -> float:
    """Share of pixels that are alike in all channels."""
    count = 0
    for col in range(row.shape[0]):
        is_alike = True
        for channel in range(row.shape[1]):
            is_alike &= abs(int(row[col, channel]) - int(value[channel])) <= apart
        count += is_alike
    return float(count / row.shape[0])


@kernel
def _bright_share(row: Pixels, least: int) -> float:
    """Share of pixels with a bright channel."""
    count = 0
    for col in range(row.shape[0]):
        count += row[col].max() >= least
    return float(count / row.shape[0])
