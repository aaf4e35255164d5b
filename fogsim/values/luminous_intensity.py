"""Luminous intensity of a lamp over direction: of signal lamps by regulations, of others by beams that are checked."""

import math
from collections.abc import Mapping
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogsim.errors import InputError, shown
from fogsim.values import Beam

FALL_OFF = 0.07
"""How fast intensity falls beyond a measured table [decades per degree]; laboratory reports show 0.04 … 0.12."""

_FLOOR = 0.01
"""Least intensity that logarithms are taken of [cd]."""


LOBE_AZIMUTHS = np.radians([0.0, 5.0, 10.0, 20.0, 30.0, 45.0, 80.0])
"""Angles next to the axis of a signal lamp to which the columns of its lobe belong, alike on both sides [rad]."""

LOBE_ELEVATIONS = np.radians([0.0, 5.0, 10.0, 15.0, 30.0])
"""Angles above and below it to which the rows belong [rad]."""


_AZIMUTHS: tuple[float, ...] = tuple(LOBE_AZIMUTHS.tolist())


class SignalLobe(IntEnum):
    """Kinds of signal lamps by the way they shine."""

    SIGNAL = 0
    """Position and stop lamps and direction indicators."""

    DAYTIME = 1
    REAR_FOG = 2


SIGNAL_SHARES: Mapping[SignalLobe, tuple[tuple[float, ...], ...]] = {
    # UNECE R148 figure A3-I up to 20° aside and 10° up and down; beyond, what its fields of geometric visibility ask.
    SignalLobe.SIGNAL: (
        (1.0, 0.90, 0.35, 0.12, 0.06, 0.030, 0.0125),
        (0.70, 0.50, 0.20, 0.10, 0.05, 0.025, 0.0125),
        (0.30, 0.20, 0.12, 0.06, 0.03, 0.015, 0.010),
        (0.12, 0.09, 0.06, 0.035, 0.02, 0.0125, 0.008),
        (0.03, 0.025, 0.02, 0.012, 0.008, 0.005, 0.003),
    ),
    # The same, figure A3-II.
    SignalLobe.DAYTIME: (
        (1.0, 0.90, 0.70, 0.25, 0.08, 0.020, 0.003),
        (0.70, 0.50, 0.20, 0.10, 0.05, 0.015, 0.002),
        (0.20, 0.20, 0.12, 0.06, 0.03, 0.010, 0.002),
        (0.10, 0.09, 0.06, 0.03, 0.02, 0.008, 0.002),
        (0.02, 0.02, 0.015, 0.01, 0.007, 0.004, 0.001),
    ),
    # UNECE R148 asks for 150 cd (of at most 300) along 10° to either side and 5° up and down, half between these.
    SignalLobe.REAR_FOG: (
        (1.0, 0.92, 0.75, 0.20, 0.08, 0.030, 0.005),
        (0.75, 0.65, 0.40, 0.14, 0.06, 0.025, 0.005),
        (0.25, 0.22, 0.16, 0.08, 0.04, 0.015, 0.004),
        (0.10, 0.09, 0.07, 0.04, 0.02, 0.010, 0.003),
        (0.02, 0.02, 0.015, 0.01, 0.007, 0.005, 0.002),
    ),
}
"""Intensity of signal lamps over that along their axes [-]: rows by `LOBE_ELEVATIONS`, columns by `LOBE_AZIMUTHS`."""


def checked_beam(beam: Beam, name: str = "beam") -> Beam:
    """The beam itself, if it can be one."""
    for axis in ("azimuth", "elevation"):
        values = np.asarray(getattr(beam, axis))
        if values.ndim != 1 or len(values) < 2 or not np.all(np.diff(values) > 0) or not np.all(np.isfinite(values)):
            raise InputError(
                f"{name}: {axis} must be two or more finite, ascending angles [rad], got {shown(values.tolist())}"
            )
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
    """Intensity of a lamp in directions [rad], interpolated linearly in its logarithm [cd].

    Beyond the table the intensity of its border falls by `FALL_OFF`.
    """
    right, up = np.asarray(azimuth, dtype=np.float64), np.asarray(elevation, dtype=np.float64)
    table = np.log(np.maximum(beam.intensity, _FLOOR))
    column, column_share, beyond_sides = _place(beam.azimuth, right)
    row, row_share, beyond_ends = _place(beam.elevation, up)
    start, left_share = row * table.shape[1] + column, 1 - column_share
    below = left_share * table.take(start) + column_share * table.take(start + 1)
    start += table.shape[1]
    above = left_share * table.take(start) + column_share * table.take(start + 1)
    outside = np.degrees(np.hypot(beyond_sides, beyond_ends))
    return np.asarray(np.exp((1 - row_share) * below + row_share * above - math.log(10) * FALL_OFF * outside))


def _place(
    grid: NDArray[np.float64], values: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Interval of each value, the share of it that the value has passed, and how far outside the grid it lies."""
    inside = np.clip(values, grid[0], grid[-1])
    index = np.searchsorted(grid[1:-1], inside, side="right")
    return index, (inside - grid.take(index)) / np.diff(grid).take(index), np.abs(values - inside)


def signal_share(lobe: SignalLobe, aside: float) -> float:
    """Intensity of a signal lamp as high as the eye, `aside` [rad], over that along its axis [-]."""
    angle, shares = abs(aside), SIGNAL_SHARES[lobe][0]
    for after, edge in enumerate(_AZIMUTHS):
        if angle < edge:
            part = (angle - _AZIMUTHS[after - 1]) / (edge - _AZIMUTHS[after - 1])
            return float(shares[after - 1] ** (1.0 - part) * shares[after] ** part)
    return shares[-1]
