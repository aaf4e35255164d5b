"""What rows of an image show, under each response that the camera may have."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera
from fogsim.vision.day.bin_kernels import RowBins, bin_medians
from fogsim.vision.day.response_curves import POINTS, curves_of
from fogsim.vision.day.row_bins import SKY_WIDTH
from fogsim.vision.day.row_kernels import RowData

Floats = NDArray[np.float64]

_NOISE, _OF_SCATTER, _OF_SLOPE = 0.45 / 255.0, 0.25, 0.15
"""Noise of a bin's signal: of full scale, of its pixels' scatter, and of its change by row [-]."""

_CONTRAST_NOISE = 3.0
"""Contrast that noise makes across a row, in deviations of its pixels [-]."""

_CLIPPED = 0.988
"""Signal from which on a bin counts as clipped [-]."""

_BRIGHTEST = 0.92
"""Share of bins that are no brighter than the light that priors are relative to [-]."""

_BONNETS = (0.45, 0.3, 0.15, 0.05)
"""Shares of the rows below the horizon that a bonnet or a dashboard may cover [-]."""

_WALKS = np.array([[0.015], [0.04], [0.1]])
"""Deviations from bin to bin of signals that follow no law of fog [-]."""


def read_rows(image: NDArray[Any], bins: RowBins, camera: Camera, horizon: float) -> RowData:
    """Read the bins of an image (`image` (rows, cols, channels) uint8)."""
    found = np.empty((3, bins.first.size))
    wide = np.flatnonzero(bins.right - bins.left < 0.5 * SKY_WIDTH * camera.width)
    sky_end = int(bins.first[wide[0]]) if wide.size else 0
    bin_medians(image, bins, image.shape[2] // 2, sky_end, found)
    signal, scatter, across = found / (2**camera.bits - 1)
    middle = 0.5 * (bins.first + bins.last)
    by_row = np.zeros(signal.size)
    by_row[1:-1] = (signal[2:] - signal[:-2]) / (middle[2:] - middle[:-2])
    curves = curves_of(camera)
    place = np.clip(signal, 0.0, 1.0) * (POINTS - 1)
    low = np.minimum(place.astype(np.int64), POINTS - 2)
    share = place - low
    light, slope = (table[:, low] * (1.0 - share) + table[:, low + 1] * share for table in (curves.light, curves.slope))
    noise = np.sqrt(_NOISE**2 + (_OF_SCATTER * scatter) ** 2 + (_OF_SLOPE * by_row) ** 2)
    clipped = signal > _CLIPPED
    level = np.quantile(light, _BRIGHTEST, axis=1)
    contrast = np.stack([across, _CONTRAST_NOISE * np.hypot(1.5 * noise, 1.5 / 255.0)]) * slope[0] / level[0]
    cuts = _cuts(bins, camera, horizon)
    free = _free(signal, noise, clipped)
    return RowData(
        first=bins.first.astype(np.float64),
        last=bins.last.astype(np.float64),
        light=light,
        slope=slope,
        noise=np.where(clipped, 0.0, slope * noise),
        by_row=slope * by_row,
        level=level,
        least_airlight=light[:, clipped].min(axis=1) if clipped.any() else np.zeros(len(light)),
        contrast=contrast,
        cuts=cuts,
        free=free[cuts],
        none=float(free[0]),
    )


def _cuts(bins: RowBins, camera: Camera, horizon: float) -> NDArray[np.int64]:
    """Bins before which the road may end: at the horizon, at a bonnet, or not at all."""
    bottom = camera.height - 1
    sky = int((bins.last + 0.5 <= horizon).sum())
    ends = {int((bins.last < bottom - share * (bottom - horizon)).sum()) for share in _BONNETS}
    return np.array([sky, *sorted(end for end in ends if sky < end < bins.first.size), bins.first.size])


def _free(signal: Floats, noise: Floats, clipped: NDArray[np.bool_]) -> Floats:
    """(n + 1,) float64: logarithm of the chance of the signals of bins from each on, if they follow no law."""
    variance = _WALKS**2 + noise[1:] ** 2 + noise[:-1] ** 2
    steps = -0.5 * np.diff(signal) ** 2 / variance - 0.5 * np.log(2.0 * math.pi * variance)
    steps = np.where(clipped[1:], 0.0, steps)
    to_end = np.cumsum(steps[:, ::-1], axis=1)[:, ::-1]
    ends = np.concatenate([to_end[:, :1], to_end, np.zeros((len(_WALKS), 1))], axis=1)
    return np.asarray(np.logaddexp.reduce(ends, axis=0) - math.log(len(_WALKS)))
