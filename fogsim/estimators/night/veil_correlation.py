"""The own head lamps' veil by correlation with references: Gallen et al. 2014, sections III-A and III-D."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.core.linear_algebra import inverse_of, matrix_product
from fogsim.values.camera import Camera, Response
from fogsim.values.camera_response import respond
from fogsim.vision.light.pixel_kernels import LinearPixels, Pixels

_CELLS_ACROSS = 80
"""About how many cells there are in a row."""

_DARK_SHARE = 0.06
"""Share of a cell's pixels that read no light from which on the mean of the rest's noise is not 0 [-]."""


class CellMeans(NamedTuple):
    """A picture by cells."""

    luminance: NDArray[np.float64]  # (rows, cols): Mean luminance of each cell [linear grey levels, 0 … 255]
    # (rows, cols) bool: Cells of which some pixel is as bright as can be told, or so many as dark that noise about the
    # dark is cut off
    clipped: NDArray[np.bool_]


def cell_size(camera: Camera) -> int:
    """Side of a cell [px]."""
    return max(min(round(camera.width / _CELLS_ACROSS), camera.height), 1)


def camera_of_cells(camera: Camera) -> Camera:
    """The camera whose pixels are the cells of another's."""
    cell = cell_size(camera)
    middle = 0.5 * (cell - 1)
    u0, v0 = camera.principal_point
    return replace(
        camera,
        width=camera.width // cell,
        height=camera.height // cell,
        focal_length=camera.focal_length / cell,
        principal_point=((u0 - middle) / cell, (v0 - middle) / cell),
    )


def cell_means(image: LinearPixels, cell: int) -> CellMeans:
    """Mean luminance of each cell, `cell` px wide; what is left over at the right and below belongs to none."""
    rows, cols = image.pixels.shape[0] // cell, image.pixels.shape[1] // cell
    luminance, clipped = np.zeros((rows, cols)), np.zeros((rows, cols), np.bool_)
    _add_cells(image.pixels, image.tables, cell, luminance, clipped)
    return CellMeans(luminance, clipped)


@kernel
def _add_cells(
    pixels: Pixels, tables: NDArray[np.float32], cell: int, luminance: NDArray[np.float64], clipped: NDArray[np.bool_]
) -> None:
    rows, cols = luminance.shape
    highest = tables.shape[1] - 1
    share = 1.0 / cell**2
    dark = np.zeros((rows, cols))
    for row in range(rows * cell):
        i = row // cell
        for j in range(cols):
            total = 0.0
            for col in range(j * cell, (j + 1) * cell):
                for channel in range(tables.shape[0]):
                    value = pixels[row, col, channel]
                    total += tables[channel, value]
                    if value >= highest:
                        clipped[i, j] = True
                    elif value == 0:
                        dark[i, j] += share / tables.shape[0]
            luminance[i, j] += share * total
    for i in range(rows):
        for j in range(cols):
            clipped[i, j] |= dark[i, j] > _DARK_SHARE


@dataclass(frozen=True, slots=True, eq=False)
class VeilReferences:
    """What a camera sees of a dark, flat road by own lamps, by cells."""

    camera: Camera  # The camera; cells are those of `camera_of_cells`
    visibility: NDArray[np.float64]  # (n,): Meteorological visibilities, rising [m]; inf for a clear night
    # (n, rows, cols): Luminance of the fog that the lamps light, before the road or the sky [cd/m²]
    veil: NDArray[np.float64]
    # (n, rows, cols): Luminance of the road that they light, of asphalt, through the fog [cd/m²]; 0 above the horizon
    road: NDArray[np.float64]


_OTSU_BINS = 256

_LEAST_SCORES = 3
"""Scores that a parabola goes through."""


class VeilScores(NamedTuple):
    """How like a picture is to each reference."""

    visibility: NDArray[np.float64]  # (n,): Of the references, without that of a clear night [m]
    # (n,): Zero-mean normalised cross-correlation inside each reference's mask, −1 … 1; NaN where the mask is empty
    score: NDArray[np.float64]
    clear: float  # That with the reference of a clear night; NaN if there is none


class VeilTemplates:
    """References as a camera has them, each with the mask of its veil.

    Each is a luminance map of veil and road, normalised to 0 … 255 and bent by the camera's response; Otsu's threshold
    keeps its bright part.

    Takes `nearest_to` [m].
    """

    def __init__(
        self, references: VeilReferences, nearest_to: Sequence[float] = (), *, common_mask: bool = False
    ) -> None:
        foggy = np.flatnonzero(np.isfinite(references.visibility))
        log_visibility = np.log(references.visibility[foggy])
        chosen = [int(np.abs(log_visibility - math.log(one)).argmin()) for one in nearest_to]
        foggy = foggy[sorted(set(chosen))] if chosen else foggy
        self.visibility = references.visibility[foggy]
        clear = np.flatnonzero(np.isinf(references.visibility))[:1]
        lit = (references.veil + references.road)[[*foggy, *clear]]
        self._images = [_as_image(one, references.camera) for one in lit]
        masked = [np.mean(self._images, axis=0)] * len(self._images) if common_mask else self._images
        self._masks = [np.flatnonzero(one.ravel() > otsu_threshold(one)) for one in masked]

    def scores(self, picture: NDArray[np.float64]) -> VeilScores:
        """Compare a picture with each reference (`picture` (rows, cols))."""
        flat = picture.ravel()
        found = [
            correlation(flat[mask], image.ravel()[mask]) for image, mask in zip(self._images, self._masks, strict=True)
        ]
        count = len(self.visibility)
        return VeilScores(self.visibility, np.array(found[:count]), found[count] if len(found) > count else math.nan)


def _as_image(luminance: NDArray[np.float64], camera: Camera) -> NDArray[np.float64]:
    share = luminance / max(float(luminance.max()), 1e-30)
    image: NDArray[np.float64] = 255.0 * respond(share, Response(camera.response))
    return image


def correlation(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """Zero-mean normalised cross-correlation (ZNCC), −1 … 1; NaN where either is even (`one`, `other` (n,))."""
    if one.size == 0:
        return math.nan
    a, b = one - one.mean(), other - other.mean()
    power = float((a * a).sum() * (b * b).sum())
    return float((a * b).sum()) / math.sqrt(power) if power > 0.0 else math.nan


def otsu_threshold(image: NDArray[np.float64]) -> float:
    """Value that parts an image into two classes with the least variance within them (Otsu 1979).

    Takes `image` (rows, cols).
    """
    count, edges = np.histogram(image, bins=_OTSU_BINS, range=(0.0, 255.0))
    middle = 0.5 * (edges[:-1] + edges[1:])
    below, weight = np.cumsum(count * middle), np.cumsum(count).astype(np.float64)
    total, all_of_it = weight[-1], below[-1]
    with np.errstate(invalid="ignore", divide="ignore"):
        between = (all_of_it * weight / total - below) ** 2 / (weight * (total - weight))
    if not np.isfinite(between).any():
        return float(edges[-1])
    return float(edges[1 + int(np.nanargmax(np.where(np.isfinite(between), between, np.nan)))])


def visibility_by_parabola(scores: VeilScores) -> float | None:
    """Visibility at the top of S = exp(a V² + b V + c) through the scores, −b / 2a [m] (equations 13 and 14).

    Returns None where the parabola has no top above 0.
    """
    some = np.nan_to_num(scores.score, nan=-1.0) > 0.0
    if np.count_nonzero(some) < _LEAST_SCORES:
        return None
    # In units of the largest visibility, so that powers are of one size.
    scale = float(scores.visibility[some].max())
    powers = (scores.visibility[some] / scale)[:, None] ** np.arange(2, -1, -1)
    side = matrix_product(np.ascontiguousarray(powers.T), np.log(scores.score[some]))
    a, b, _ = matrix_product(inverse_of(matrix_product(powers.T, powers)), side).tolist()
    return -b / (2.0 * a) * scale if a < 0.0 < b else None
