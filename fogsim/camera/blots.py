"""Dirt and drops on the glass before a camera, which are out of focus: how much of each pixel's light they take.

A camera that is focused on the road sees what sticks to the windscreen through its whole entrance pupil. A pixel's
light crosses the glass on a disc as large as the pupil, and a blot takes the share of that disc that it covers: the
area that two circles share. So small blots are faint and as wide as the pupil, large ones have dark middles and soft
borders (Gu, Ramamoorthi, Belhumeur and Nayar 2009, doi:10.1145/1661412.1618490).
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.values import Camera

Floats = NDArray[np.float64]

GLASS_DISTANCE = 0.05
"""From the entrance pupil to the glass along the axis [m]; assumed, for a camera close behind a windscreen."""

PUPIL_DIAMETER = 0.003
"""Of the entrance pupil [m]: a focal length of 6 mm at F/2, assumed."""

SIZE_SPREAD = 0.5
"""Standard deviation of the logarithm of blots' diameters [-], assumed."""

PUPIL = 0.5 * PUPIL_DIAMETER / GLASS_DISTANCE
"""Radius of the pupil as the glass has it, in distances of the glass [-]."""


class Blots(NamedTuple):
    """Round blots on the glass; lengths over the distance of the glass, so that a pixel is 1 / focal length wide."""

    # right, down (n,): middle, from the optical axis [-]
    right: Floats
    down: Floats
    radius: Floats  # (n,): Radius [-]


class _BlotPixels(NamedTuple):
    """Pixels that a blot dims."""

    # rows, columns: the part of the image about it
    rows: slice
    columns: slice
    hidden: Floats  # (rows, columns): Share of each pixel's light that the blot takes, 0 … 1


def scattered_blots(camera: Camera, coverage: float, diameter: float, rng: np.random.Generator) -> Blots:
    """Blots at random all over the glass (`diameter` [m])."""
    usual = 0.5 * diameter / GLASS_DISTANCE
    margin = PUPIL + 3.0 * usual
    (u0, v0), focal = camera.principal_point, camera.focal_length
    left, right = -u0 / focal - margin, (camera.width - u0) / focal + margin
    top, bottom = -v0 / focal - margin, (camera.height - v0) / focal + margin
    # The mean square of a log-normal diameter is its median's times e^(2σ²).
    mean_area = math.pi * usual**2 * math.exp(2.0 * SIZE_SPREAD**2)
    count = round(coverage * (right - left) * (bottom - top) / mean_area)
    return Blots(
        rng.uniform(left, right, count),
        rng.uniform(top, bottom, count),
        usual * np.exp(SIZE_SPREAD * rng.normal(size=count)),
    )


def passed_light(camera: Camera, blots: Blots) -> NDArray[np.float32]:
    """Share of each pixel's light that passes between blots; those that lie over one another do so by chance.

    Returns 0 … 1.
    """
    passed = np.ones((camera.height, camera.width))
    for blot in _blot_pixels(camera, blots):
        passed[blot.rows, blot.columns] *= 1.0 - blot.hidden
    return passed.astype(np.float32)[..., None]


def _blot_pixels(camera: Camera, blots: Blots) -> Iterator[_BlotPixels]:
    """What each blot that is in the picture takes of it."""
    (u0, v0), focal = camera.principal_point, camera.focal_length
    for right, down, radius in zip(*blots, strict=True):
        reach = radius + PUPIL
        columns = _pixels(u0 + focal * (right - reach), u0 + focal * (right + reach), camera.width)
        rows = _pixels(v0 + focal * (down - reach), v0 + focal * (down + reach), camera.height)
        if columns.start >= columns.stop or rows.start >= rows.stop:
            continue
        x = (np.arange(columns.start, columns.stop) - u0) / focal - right
        y = ((np.arange(rows.start, rows.stop) - v0) / focal - down)[:, None]
        hidden = shared_area(np.hypot(x, y), radius, PUPIL) / (math.pi * PUPIL**2)
        yield _BlotPixels(rows, columns, hidden)


def _pixels(first: float, last: float, count: int) -> slice:
    return slice(max(math.ceil(first), 0), min(math.floor(last) + 1, count))


def shared_area(distance: Floats, one: float, other: float) -> Floats:
    """Area that two circles share.

    Returns In that unit squared (…). Takes `distance` (…).
    """
    smaller = min(one, other)
    d = np.clip(distance, abs(one - other) + 1e-12, one + other)
    # Two sectors less the kite of both middles and both crossings.
    first = np.arccos(np.clip((d**2 + one**2 - other**2) / (2.0 * d * one), -1.0, 1.0))
    second = np.arccos(np.clip((d**2 + other**2 - one**2) / (2.0 * d * other), -1.0, 1.0))
    kite = np.sqrt(np.maximum((one + other - d) * (d + one - other) * (d - one + other) * (d + one + other), 0.0))
    lens = one**2 * first + other**2 * second - 0.5 * kite
    inside = np.where(distance <= abs(one - other), math.pi * smaller**2, lens)
    return np.asarray(np.where(distance >= one + other, 0.0, inside))
