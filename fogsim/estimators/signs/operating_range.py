"""From the distance at which signs are first detected to the visibility: the detector's calibrated operating range."""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.optimize import isotonic_regression

from fogsim.core.files.readers import number_within, read_json
from fogsim.core.linear_algebra import inverse_of, matrix_product, times
from fogsim.errors import InputError, shown

_FLAT = 0.35
"""Relative deviation of one sign's visibility beyond which the curve is flat and distances are uninformative [-]."""

_MARGIN = 1.5
"""Deviations before the distance that resolution sets at which the curve ends [-]."""

_LEAST = 3
"""Fewest visibilities that make a curve."""


@dataclass(frozen=True, slots=True)
class OperatingRange:
    """How far a detector of signs sees in fog, measured for one camera and one size of signs."""

    focal_length: float  # Of the camera [px]
    diameter: float  # Of the signs [m]
    visibility: tuple[float, ...]  # Meteorological visibilities at which it was measured, ascending [m]
    # Largest distance within which at least 80 % of looks find the sign, at each [m]
    operating_range: tuple[float, ...]
    # Median distance at which signs were first detected while they were driven up to [m]
    first_detection: tuple[float, ...]
    # Standard deviation of that from sign to sign, for normal errors of the same quartiles [m]
    deviation: tuple[float, ...]

    def __post_init__(self) -> None:
        rows = (self.visibility, self.operating_range, self.first_detection, self.deviation)
        if len({len(row) for row in rows}) != 1 or len(self.visibility) < _LEAST:
            raise InputError(f"expected at least {_LEAST} visibilities and as many distances each, got {shown(rows)}")
        numbers = np.array([*rows, [self.focal_length, self.diameter, *self.visibility[2:]]], dtype=np.float64)
        if not np.isfinite(numbers).all() or numbers.min() < 0.0 or min(self.focal_length, self.diameter) <= 0.0:
            raise InputError(f"expected finite numbers, none below 0, got {shown(asdict(self))}")
        if self.visibility[0] <= 0.0 or any(np.diff(self.visibility) <= 0.0):
            raise InputError(f"expected visibilities above 0 that ascend, got {shown(self.visibility)}")

    @property
    def cubic(self) -> tuple[float, ...]:
        """Coefficients a, b, c, d of d_vis = a d³ + b d² + c d + d₀ through the operating ranges (eq. 1), from a on."""
        # Where no class of distances has 80 % there is no operating range to fit.
        known = np.array(self.operating_range) > 0.0
        if not known.any():
            return (0.0, 0.0, 0.0, math.nan)
        # In units of the largest distance, so that powers are of one size.
        scale = max(self.operating_range)
        powers = (np.array(self.operating_range)[known] / scale)[:, None] ** np.arange(3, -1, -1)
        normal = inverse_of(matrix_product(powers.T, powers))
        found = times(normal, times(np.ascontiguousarray(powers.T), np.array(self.visibility)[known]))
        return tuple((found / scale ** np.arange(3, -1, -1)).tolist())

    def visibility_by_cubic(self, distance: float) -> float:
        """Visibility of a distance of first detection by the published cubic [m]; it need not be monotone.

        Takes `distance` [m].
        """
        return float(np.polyval(self.cubic, distance))

    def visibility_at(self, distance: float) -> tuple[float, float] | None:
        """Visibility of a distance of first detection by the monotone curve, and its standard deviation [m].

        Returns None outside what was measured, and where the curve is flat. Takes `distance` [m].
        """
        curve = _Curve(self)
        low, high = curve.reach
        return curve.at(distance) if low <= distance <= high else None

    @property
    def reach(self) -> tuple[float, float]:
        """Distances of first detection between which the curve gives the visibility [m]."""
        return _Curve(self).reach

    @property
    def farthest(self) -> float:
        """Visibility at the curve's far end [m]: whoever sees signs from farther away has at least that."""
        return _Curve(self).at(self.reach[1])[0]

    @classmethod
    def read(cls, path: Path) -> "OperatingRange":
        """Read a calibration's file."""
        try:
            data, names = read_json(path), ("focal_length_px", "diameter_m", *_COLUMNS.values())
            if not isinstance(data, Mapping) or set(data) != set(names):
                given = sorted(data) if isinstance(data, Mapping) else data
                raise InputError(f"expected the keys {', '.join(names)}, got {shown(given)}")  # noqa: TRY301
            columns = {name: _column(key, data[key]) for name, key in _COLUMNS.items()}
            focal_length, diameter = (number_within("", key, data[key]) for key in names[:2])
            return cls(focal_length, diameter, **columns)
        except InputError as error:
            raise InputError(
                f"operating_range must be a file of `fogsim calibrate signs`, got {str(path)!r}: {error}"
            ) from error

    def as_json(self) -> str:
        """The calibration's file."""
        columns = {key: [round(value, 2) for value in getattr(self, name)] for name, key in _COLUMNS.items()}
        return json.dumps({"focal_length_px": self.focal_length, "diameter_m": self.diameter, **columns}, indent=1)


_COLUMNS = {
    "visibility": "visibility_m",
    "operating_range": "operating_range_m",
    "first_detection": "first_detection_m",
    "deviation": "deviation_m",
}


def _column(key: str, values: Any) -> tuple[float, ...]:
    if not isinstance(values, list):
        raise InputError(f"{key} must be a list of numbers, got {shown(values)}")
    return tuple(number_within(key, str(place), value) for place, value in enumerate(values))


class _Curve:
    """Visibility over distance, monotone, over its informative range."""

    def __init__(self, measured: OperatingRange) -> None:
        visibility = np.array(measured.visibility)
        distance = isotonic_regression(measured.first_detection).x
        # Visibilities that are seen at one distance are one point of the curve, at the middle of them.
        known, row = np.unique(distance, return_inverse=True)
        self._deviation = np.array([np.mean(np.array(measured.deviation)[row == i]) for i in range(len(known))])
        self._distance = known
        self._log_visibility = np.array([np.mean(np.log(visibility[row == i])) for i in range(len(known))])
        # From the first of the thinnest fogs on that are all seen from one distance, resolution limits it and not fog.
        thinnest = visibility[row == len(known) - 1]
        self._log_visibility[-1] = math.log(thinnest[0])
        self._end = float(known[-1]) - (_MARGIN * float(self._deviation[-1]) if len(thinnest) > 1 else 0.0)
        self._curve = PchipInterpolator(known, self._log_visibility) if len(known) > 1 else None

    @property
    def reach(self) -> tuple[float, float]:
        if self._curve is None:
            return (math.inf, -math.inf)
        distances = np.linspace(self._distance[0], max(self._end, self._distance[0]), 200)
        flat = np.array([deviation / value for value, deviation in map(self.at, distances)]) > _FLAT
        last = int(np.argmax(flat)) - 1 if flat.any() else len(distances) - 1
        return (float(distances[0]), float(distances[max(last, 0)]))

    def at(self, distance: float) -> tuple[float, float]:
        if self._curve is None:
            return float(np.exp(self._log_visibility[0])), math.inf
        visibility = math.exp(float(self._curve(distance)))
        slope = float(self._curve(distance, 1))
        return visibility, visibility * slope * float(np.interp(distance, self._distance, self._deviation))
