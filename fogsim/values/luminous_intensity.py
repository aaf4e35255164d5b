"""Luminous intensity of a lamp over direction: checking a beam, and reading it between its entries."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogsim.errors import InputError
from fogsim.values import Beam

FALL_OFF = 0.07
"""How fast intensity falls beyond a measured table [decades per degree]; laboratory reports show 0.04 … 0.12."""

FLOOR = 0.01
"""Least intensity that logarithms are taken of [cd]."""


def checked_beam(beam: Beam, name: str = "beam") -> Beam:
    """The beam itself, if it can be one.

    Parameters
    ----------
    beam : Beam
        Any.
    name : str
        What the message calls it.

    Raises
    ------
    InputError
        If shapes differ, directions do not ascend, or an intensity is missing, not finite or negative.
    """
    for axis in ("azimuth", "elevation"):
        values = np.asarray(getattr(beam, axis))
        if values.ndim != 1 or len(values) < 2 or not np.all(np.diff(values) > 0) or not np.all(np.isfinite(values)):
            raise InputError(f"{name}: {axis} must be two or more finite, ascending angles [rad], got {values!r}")
    intensity = np.asarray(beam.intensity)
    expected = (len(beam.elevation), len(beam.azimuth))
    if intensity.shape != expected:
        raise InputError(
            f"{name}: intensity must have one row an elevation and one column an azimuth, {expected}, "
            f"got {intensity.shape}"
        )
    bad = np.argwhere(~(np.isfinite(intensity) & (intensity >= 0)))
    if len(bad):
        row, column = (int(index) for index in bad[0])
        raise InputError(
            f"{name}: every intensity must be a finite number of candela ≥ 0; row {row}, column {column} "
            f"({math.degrees(beam.elevation[row]):g}° up, {math.degrees(beam.azimuth[column]):g}° right) "
            f"holds {intensity[row, column]!r} ({len(bad)} such entries)"
        )
    return beam


def luminous_intensity(beam: Beam, azimuth: ArrayLike, elevation: ArrayLike) -> NDArray[np.float64]:
    """Intensity of a lamp in directions [cd], interpolated linearly in its logarithm.

    Beyond the table the intensity of its border falls by `FALL_OFF`.

    Parameters
    ----------
    beam : Beam
        The lamp.
    azimuth, elevation : array_like
        Directions to the right of the axis and above the horizontal through the lamp [rad]; they broadcast.
    """
    right, up = np.asarray(azimuth, dtype=np.float64), np.asarray(elevation, dtype=np.float64)
    table = np.log(np.maximum(beam.intensity, FLOOR))
    column, column_share, beyond_sides = _place(beam.azimuth, right)
    row, row_share, beyond_ends = _place(beam.elevation, up)
    below = (1 - column_share) * table[row, column] + column_share * table[row, column + 1]
    above = (1 - column_share) * table[row + 1, column] + column_share * table[row + 1, column + 1]
    outside = np.degrees(np.hypot(beyond_sides, beyond_ends))
    return np.asarray(np.exp((1 - row_share) * below + row_share * above - math.log(10) * FALL_OFF * outside))


def _place(
    grid: NDArray[np.float64], values: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Interval of each value, the share of it that the value has passed, and how far outside the grid it lies."""
    inside = np.clip(values, grid[0], grid[-1])
    index = np.clip(np.searchsorted(grid, inside, side="right") - 1, 0, len(grid) - 2)
    return index, (inside - grid[index]) / (grid[index + 1] - grid[index]), np.abs(values - inside)
