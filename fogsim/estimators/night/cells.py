"""A picture by cells: the coarser picture on which the veil, which is smooth, is looked at."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.values.camera import Camera
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
