"""The human eye: how its thresholds follow the luminance it is adapted to, and the veil that glare lays over it."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogsim.errors import InputError

LEAST_LUMINANCE = 1e-6
"""Luminance below which the formulas are read at this value [cd/m²]."""

_SMALLEST_ANGLE = math.radians(0.1)
"""Angle from which on the general formula is known, to 100° [rad]; below it is read at this angle."""

_LEAST_ANGLE = math.radians(1.0)
"""Angle below which the formula is read at this angle [rad]; it is known from 1° to 30°."""


def flux_root(luminance: ArrayLike) -> NDArray[np.float64]:
    """√φ of Adrian's formula (1989), that of Ricco's law for small targets (`luminance` [cd/m²])."""
    value = np.asarray(luminance, dtype=np.float64)
    log = np.log10(np.maximum(value, LEAST_LUMINANCE))
    bright = np.log10(4.1925 * 10.0 ** (0.1556 * log)) + 0.1684 * 10.0 ** (0.5867 * log)
    middle = 10.0 ** (-0.072 + 0.3372 * log + 0.0866 * log**2)
    dark = 10.0 ** (0.028 + 0.173 * log)
    return np.select([value >= 0.6, value > 0.00418], [bright, middle], dark)


def luminance_root(luminance: ArrayLike) -> NDArray[np.float64]:
    """√L of Adrian's formula (1989), that of Weber's law for large targets (`luminance` [cd/m²])."""
    value = np.asarray(luminance, dtype=np.float64)
    log = np.log10(np.maximum(value, LEAST_LUMINANCE))
    bright = 0.05946 * 10.0 ** (0.466 * log)
    middle = 10.0 ** (-1.256 + 0.319 * log)
    dark = 10.0 ** (-0.891 + 0.5275 * log + 0.0227 * log**2)
    return np.select([value >= 0.6, value > 0.00418], [bright, middle], dark)


def veiling_luminance(illuminance: ArrayLike, angle: ArrayLike, age: float = 25.0) -> NDArray[np.float64]:
    """Veil of disability glare, L_v = 10 E (1 + (A/70)⁴) / θ² with θ in degrees [cd/m²] (Vos 2003; CIE 146:2002).

    Several sources add.

    Parameters
    ----------
    illuminance : array_like
        Illuminance at the eye from the glare source, across the line to it [lx], not negative.
    angle : array_like
        Angle between the source and what is looked at [rad]; less than 1° as 1°.
    age : float
        Age of the observer [years], positive.

    Raises
    ------
    InputError
        If an illuminance or the age is negative or not finite, or an angle is not in 0 … π.
    """
    light, theta = _checked_glare(illuminance, angle, age)
    degrees = np.degrees(np.maximum(theta, _LEAST_ANGLE))
    return np.asarray(10.0 * light * (1.0 + (age / 70.0) ** 4) / degrees**2)


def disability_glare(
    illuminance: ArrayLike, angle: ArrayLike, age: float = 25.0, pigmentation: float = 0.5
) -> NDArray[np.float64]:
    """Veil of disability glare by the general formula of CIE 146:2002, from 0.1° to 100° [cd/m²].

    L_v / E = 10/θ³ + (5/θ² + 0.1 p/θ) (1 + (A/62.5)⁴) + 0.0025 p, θ in degrees. Several sources add.
    """
    light, theta = _checked_glare(illuminance, angle, age)
    if not 0.0 <= pigmentation <= 1.2:
        raise InputError(f"pigmentation of the eye must lie in 0 … 1.2, got {pigmentation!r}")
    degrees = np.degrees(np.maximum(theta, _SMALLEST_ANGLE))
    by_age = (5.0 / degrees**2 + 0.1 * pigmentation / degrees) * (1.0 + (age / 62.5) ** 4)
    return np.asarray(light * (10.0 / degrees**3 + by_age + 0.0025 * pigmentation))


def _checked_glare(
    illuminance: ArrayLike, angle: ArrayLike, age: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    light, theta = np.asarray(illuminance, dtype=np.float64), np.asarray(angle, dtype=np.float64)
    if not (np.all(np.isfinite(light)) and np.all(light >= 0)):
        raise InputError(f"illuminance at the eye must be finite and not negative [lx], got {illuminance!r}")
    if not np.all((theta >= 0) & (theta <= math.pi)):
        raise InputError(f"angle of a glare source must lie in 0 … π rad, got {angle!r}")
    if not (age > 0 and math.isfinite(age)):
        raise InputError(f"age must be positive [years], got {age!r}")
    return light, theta
