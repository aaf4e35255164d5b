"""A dirty and a wet windscreen before a camera."""

import math
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.camera.blots import PUPIL, Blots, passed_light, scattered_blots
from fogsim.values import Camera
from fogsim.values.fault import DirtyLens, WetLens

Floats32 = NDArray[np.float32]
Floats = NDArray[np.float64]

DROP_VIEW = math.radians(165.0)
"""Field of view of a drop of water (Garg and Nayar 2003, Photometric model of a rain drop) [rad]."""

CELL = 16
"""Rows and columns of the picture that count as one where drops show it small [px]."""

STEP = 4
"""Rows and columns of the blocks of the image that share one value of a drop's light [px]; the pupil is far wider."""


class DirtyGlass:
    """Dirt takes light from the road and sends some of the light around into the camera: L' = L T + (1 − T) ρ L̄.

    T is what blots leave (Gu et al. 2009, eq. 3), L̄ the mean of the picture, which stands for the light around.
    """

    def __init__(self, camera: Camera, dirt: DirtyLens, rng: np.random.Generator) -> None:
        self._passed = passed_light(camera, scattered_blots(camera, dirt.coverage, dirt.diameter, rng))
        self._albedo = np.float32(dirt.albedo)

    def look_through(self, radiance: Floats32) -> Floats32:
        """Luminance behind the glass (`radiance` (rows, cols, 3) [cd/m²])."""
        around: Floats32 = radiance.mean(axis=(0, 1), dtype=np.float64).astype(np.float32)
        behind: Floats32 = radiance * self._passed + (1.0 - self._passed) * (self._albedo * around)
        return behind


class WetGlass:
    """Drops show the whole scene upside down and out of focus; the film of water between them blurs the picture.

    A drop is a wide-angle lens of some millimetres' focal length (Garg and Nayar 2003; You et al. 2016, Adherent
    raindrop modeling, detection and removal in video): light comes through it from 165° about, and its upper part shows
    what is below. What is not in the picture is taken to be as what is at its border. Each pixel gets the mean of what
    the drops show over the pupil, whose disc a Gaussian of the same variance stands for.
    """

    def __init__(self, camera: Camera, water: WetLens, rng: np.random.Generator) -> None:
        self._blur = water.blur * camera.focal_length
        drops = scattered_blots(camera, water.coverage, water.diameter, rng)
        self._passed = passed_light(camera, drops)
        self._wet_rows, self._wet_columns = np.nonzero(self._passed[..., 0] < 1.0)
        # Drops next to the picture are in it, too, for they are out of focus.
        self._margin = math.ceil(2.0 * PUPIL * camera.focal_length / STEP)
        self._inside, self._shown = _shown_by(drops, camera, self._margin)
        # A disc of radius R has the variance R²/4 along each axis.
        self._defocus = 0.5 * PUPIL * camera.focal_length / STEP
        self._share = _smoothed(self._inside.astype(float), self._defocus)

    def look_through(self, radiance: Floats32) -> Floats32:
        """Luminance behind the glass (`radiance` (rows, cols, 3) [cd/m²])."""
        behind: Floats32 = radiance
        if self._blur > 0.0:
            behind = _smoothed(radiance, (self._blur, self._blur, 0.0), mode="nearest")
        cells, through = _cells(radiance), np.zeros_like(radiance)
        rows, columns = (place / STEP + self._margin for place in (self._wet_rows, self._wet_columns))
        for channel in range(3):
            light = np.zeros(self._inside.shape)
            light[self._inside] = _between(cells[..., channel], *self._shown)
            mean = _smoothed(light, self._defocus) / np.maximum(self._share, 1e-12)
            through[self._wet_rows, self._wet_columns, channel] = _between(mean, rows, columns)
        wet: Floats32 = behind * self._passed + (1.0 - self._passed) * through
        return wet


def _shown_by(drops: Blots, camera: Camera, margin: int) -> tuple[NDArray[np.bool_], tuple[Floats, Floats]]:
    """Where on the glass drops are, every `STEP` pixels, and which row and column of cells they show there."""
    (u0, v0), focal = camera.principal_point, camera.focal_length
    x, y = (
        (STEP * np.arange(-margin, size // STEP + margin + 2) - centre) / focal
        for centre, size in ((u0, camera.width), (v0, camera.height))
    )
    y = y[:, None]
    inside = np.zeros((y.size, x.size), bool)
    across, along = np.zeros(inside.shape), np.zeros(inside.shape)
    for right, down, radius in zip(*drops, strict=True):
        # However small, it is at one point at least.
        here = (x - right) ** 2 + (y - down) ** 2 < max(radius, STEP / focal) ** 2
        inside |= here
        across = np.where(here, np.clip((x - right) / radius, -1.0, 1.0), across)
        along = np.where(here, np.clip((y - down) / radius, -1.0, 1.0), along)
    rows, columns = (
        np.clip(centre - focal * np.tan(0.5 * DROP_VIEW * offset[inside]), 0.0, size - 1.0) / CELL - 0.5
        for offset, centre, size in ((along, v0, camera.height), (across, u0, camera.width))
    )
    return inside, (rows, columns)


def _cells(radiance: Floats32) -> Floats:
    """Means of squares of the picture (rows, cols, 3), as far as they are whole."""
    rows, columns = (max(size // CELL, 1) for size in radiance.shape[:2])
    used = radiance[: rows * CELL, : columns * CELL].astype(np.float64)
    means = used.reshape(rows, used.shape[0] // rows, columns, used.shape[1] // columns, 3).mean(axis=(1, 3))
    return np.asarray(means)


def _between(grid: Floats, rows: Floats, columns: Floats) -> Floats:
    """Bilinear interpolation between the points of a grid."""
    places = []
    for place, count in ((rows, grid.shape[0]), (columns, grid.shape[1])):
        at = np.clip(place, 0.0, count - 1.0)
        before = np.minimum(at.astype(np.int64), max(count - 2, 0))
        places.append((before, np.minimum(before + 1, count - 1), at - before))
    (top, bottom, down), (left, right, across) = places
    upper = grid[top, left] * (1.0 - across) + grid[top, right] * across
    lower = grid[bottom, left] * (1.0 - across) + grid[bottom, right] * across
    return np.asarray(upper * (1.0 - down) + lower * down)


def _smoothed(values: Any, deviation: Any, **options: Any) -> Any:
    """SciPy's Gaussian filter, imported by what is soiled alone."""
    return import_module("scipy.ndimage").gaussian_filter(values, deviation, **options)
