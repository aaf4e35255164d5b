"""The rear of the vehicle ahead, found in the pixels near where its range says that it is."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera
from fogsim.vision.strips import LinearPixels, Sky

Floats = NDArray[np.float64]

HALF_PANEL = 0.5
"""Half the width of the part of the rear that is looked at [m]: between the lamps of any car."""

FLANKS = (1.2, 1.7)
"""Where beside a vehicle's middle its surroundings are looked at [m]."""

SIDEWAYS = 4.0
"""How far from the vehicle's axis the vehicle ahead is looked for [m]: a lane's width of a curve."""

HEIGHTS = np.arange(-0.3, 2.01, 0.05)
"""Heights above the road at which the rear is sampled [m]."""

PANEL = (HEIGHTS >= 0.4) & (HEIGHTS <= 1.2)
"""The heights that every vehicle's rear covers, above shadow and bumper edge and below a low roof."""

LEAST_STEP = 1.0
"""Least difference of the panel to both its flanks for it to be found by [linear grey levels]."""

MIN_PIXELS = 3.0
"""Least width of the panel in the image [px]."""


@dataclass(frozen=True, slots=True)
class LeadPatch:
    """Contrast of a vehicle's rear to the airlight by height.

    Attributes
    ----------
    contrast : (n,) float64
        (A − L) / A at `HEIGHTS` [-].
    deviation : float
        Noise of each of them [-].
    offset : float
        Lateral place of the vehicle's middle, to the right of the axis [m].
    box : tuple of int
        Left, right, top and bottom of the panel in the image [px].
    """

    contrast: Floats
    deviation: float
    offset: float
    box: tuple[int, int, int, int]

    @property
    def panel(self) -> float:
        """Mean contrast of the panel [-]."""
        return float(self.contrast[PANEL].mean())


def lead_patch(image: LinearPixels, camera: Camera, depth: float, sky: Sky, expected: float | None) -> LeadPatch | None:
    """Find the rear of a vehicle and read its contrast.

    Sideways it is where the panel differs most from both its flanks, near `expected` if that is known.

    Parameters
    ----------
    image : LinearPixels
        The image, level.
    camera : Camera
        The told calibration.
    depth : float
        Depth of the rear from the camera [m].
    sky : Sky
        The airlight and the pixels' noise.
    expected : float or None
        Lateral place at which it was seen before [m].

    Returns
    -------
    LeadPatch or None
        None if it is too small, outside the image or not told apart from what is beside it.
    """
    scale = camera.focal_length / depth
    if 2.0 * HALF_PANEL * scale < MIN_PIXELS:
        return None
    rows = camera.horizon_row + (camera.mount_height - HEIGHTS) * camera.row_distance / (camera.mount_height * depth)
    top, bottom = math.floor(rows[-1]), math.ceil(rows[0]) + 1
    reach = math.ceil((SIDEWAYS + FLANKS[1]) * scale)
    middle = camera.principal_point[0]
    left, right = max(math.floor(middle) - reach, 0), min(math.ceil(middle) + reach + 1, camera.width)
    if top < 0 or bottom >= camera.height or right - left < 2.0 * FLANKS[1] * scale:
        return None
    light = _luminance(image, top, bottom + 1, left, right)
    panel_rows = slice(round(rows[PANEL][-1]) - top, max(round(rows[PANEL][0]) - top, round(rows[PANEL][-1]) - top + 1))
    offset = _sideways(light[panel_rows].mean(axis=0), left - middle, scale, expected, sky.noise)
    if offset is None:
        return None
    centre = middle + offset * scale
    first, last = round(centre - HALF_PANEL * scale) - left, round(centre + HALF_PANEL * scale) - left + 1
    profile = _unlit_mean(light[:, max(first, 0) : last], sky)
    contrast = 1.0 - np.interp(rows, np.arange(top, bottom + 1), profile) / sky.luminance
    pixels = max((last - first) * float(PANEL.sum()) * 0.05 * scale, 1.0)
    box = (left + first, left + last - 1, top + panel_rows.start, top + panel_rows.stop - 1)
    return LeadPatch(contrast, sky.noise / sky.luminance / math.sqrt(pixels), offset, box)


def _luminance(image: LinearPixels, top: int, bottom: int, left: int, right: int) -> Floats:
    part = image.pixels[top:bottom, left:right]
    channels = [image.tables[c].astype(np.float64)[part[:, :, c]] for c in range(part.shape[2])]
    return np.asarray(np.sum(channels, axis=0))


def _sideways(columns: Floats, start: float, scale: float, expected: float | None, noise: float) -> float | None:
    """Lateral place [m] at which the mean of the panel differs most from both flanks."""
    total = np.concatenate([[0.0], np.cumsum(columns)])
    most = SIDEWAYS if expected is None else 1.0
    offsets = np.arange(-most, most + 1e-9, max(0.1, 0.5 / scale)) + (expected or 0.0)

    def mean(low: Floats, high: Floats) -> Floats:
        first = np.clip(np.rint(low * scale - start), 0, columns.size - 1).astype(np.int64)
        last = np.clip(np.rint(high * scale - start) + 1, first + 1, columns.size).astype(np.int64)
        return np.asarray((total[last] - total[first]) / (last - first))

    inside = mean(offsets - HALF_PANEL, offsets + HALF_PANEL)
    before, behind = mean(offsets - FLANKS[1], offsets - FLANKS[0]), mean(offsets + FLANKS[0], offsets + FLANKS[1])
    # Of the same sign against both flanks: else it is the edge of something wider.
    step = np.where(
        (inside - before) * (inside - behind) > 0, np.minimum(abs(inside - before), abs(inside - behind)), 0
    )
    likely = step * np.exp(-0.5 * ((offsets - (expected or 0.0)) / (1.5 if expected is None else 0.4)) ** 2)
    best = likely >= 0.9 * likely.max()
    if step.max() <= 3.0 * noise / math.sqrt(max(HALF_PANEL * scale, 1.0)) + LEAST_STEP:
        # Faded into the fog, it still is where it was.
        return expected
    return float(np.average(offsets[best], weights=likely[best]))


def _unlit_mean(light: Floats, sky: Sky) -> Floats:
    """Mean of each row without what is brighter than the airlight, which is lamps."""
    unlit = light <= sky.luminance + 4.0 * sky.noise + 1.0
    count = unlit.sum(axis=1)
    return np.where(count > 0, np.where(unlit, light, 0.0).sum(axis=1) / np.maximum(count, 1), sky.luminance)


def registered_contrast(contrast: Floats, template: Floats, deviation: float, shift_deviation: float) -> float:
    """Mean contrast of the panel after a vertical shift that makes a profile most like a template.

    Parameters
    ----------
    contrast, template : (n,) float64
        Profiles over `HEIGHTS`.
    deviation : float
        Noise of the panel's mean [-].
    shift_deviation : float
        Standard deviation of the shift [m].

    Returns
    -------
    float
        Mean over `PANEL` of the shifted profile, relative to that of the template.
    """
    best, found = math.inf, 0.0
    step = float(HEIGHTS[1] - HEIGHTS[0])
    noise = deviation * math.sqrt(float(PANEL.sum()))
    reach = min(math.ceil(2.5 * shift_deviation / step), 8)
    weight = template[PANEL]
    for shift in range(-reach, reach + 1):
        moved = np.roll(contrast, shift)
        size = float(moved[PANEL] @ weight) / max(float(weight @ weight), 1e-12)
        inner = slice(8, -8)
        misfit = float(((moved[inner] - size * template[inner]) ** 2).sum()) / max(noise, 0.002) ** 2
        misfit += (shift * step / shift_deviation) ** 2
        if misfit < best:
            best, found = misfit, float(moved[PANEL].mean())
    return found / float(weight.mean())
