"""How visible a target is: Adrian's visibility level (Adrian 1989, Lighting Research & Technology 21:181).

The threshold is the luminance difference that an observer just detects,

    ΔL_th = k (√φ/α + √L)² F_cp F_t F_age,

with the angular size α of the target and functions √φ, √L of the luminance to which the eye is adapted. The visibility
level is the actual difference over that threshold. A veil of light adds to target and background alike and lifts the
adaptation, so it lowers the visibility level twice.
"""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogsim.errors import InputError
from fogsim.values.eye import LEAST_LUMINANCE, flux_root, luminance_root

ALMOST_CERTAIN = 2.6
"""Threshold factor k for detection with 99.9 % probability [-]; 1 stands for 50 %."""

_LEAST_FOR_POLARITY = 0.004
"""Luminance below which no contrast polarity factor is known [cd/m²]; it is read at this value."""


def angular_size(size: ArrayLike, distance: ArrayLike) -> NDArray[np.float64]:
    """Angle that a target subtends [rad], 2 atan(size / (2 distance)) (`size`, `distance` [m])."""
    return np.asarray(2.0 * np.arctan(np.asarray(size) / (2.0 * np.asarray(distance))))


def threshold(
    background: ArrayLike,
    angle: ArrayLike,
    *,
    darker: ArrayLike = False,
    exposure_time: float = 0.2,
    age: float = 25.0,
    probability_factor: float = ALMOST_CERTAIN,
) -> NDArray[np.float64]:
    """Luminance difference that is just detected, ΔL_th [cd/m²] (Adrian 1989).

    Takes `background` [cd/m²], `angle` [rad], `exposure_time` [s], `age` [years].
    """
    luminance, minutes = _checked(background, angle, exposure_time, age, probability_factor)
    positive = probability_factor * _threshold_root(luminance, minutes) ** 2
    result = positive * exposure_factor(luminance, minutes, exposure_time) * age_factor(age)
    return np.asarray(np.where(darker, result * polarity_factor(luminance, minutes), result))


def visibility_level(
    target: ArrayLike,
    background: ArrayLike,
    angle: ArrayLike,
    *,
    adaptation: ArrayLike | None = None,
    exposure_time: float = 0.2,
    age: float = 25.0,
    probability_factor: float = ALMOST_CERTAIN,
) -> NDArray[np.float64]:
    """Visibility level VL = (L_t − L_b) / ΔL_th [-]; negative for targets darker than their background.

    Parameters
    ----------
    target, background : array_like
        Luminances with every veil between them and the eye [cd/m²].
    angle : array_like
        Angular size of the target [rad].
    adaptation : array_like or None
        Luminance to which the eye is adapted [cd/m²], such as the background with the veil of glare inside the eye;
        None for the background.
    exposure_time, age, probability_factor : float
        See `threshold`.

    Raises
    ------
    InputError
        If an argument is out of its range or not finite.
    """
    difference = np.asarray(target, dtype=np.float64) - np.asarray(background, dtype=np.float64)
    least = threshold(
        background if adaptation is None else adaptation,
        angle,
        darker=difference < 0,
        exposure_time=exposure_time,
        age=age,
        probability_factor=probability_factor,
    )
    return np.asarray(difference / least)


def _threshold_root(luminance: NDArray[np.float64], minutes: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(flux_root(luminance) / minutes + luminance_root(luminance))


def polarity_factor(luminance: ArrayLike, minutes: ArrayLike) -> NDArray[np.float64]:
    """F_cp ≤ 1: dark targets are seen at a smaller difference than bright ones.

    Takes `luminance` [cd/m²], `minutes` [minutes of arc].
    """
    log = np.log10(np.maximum(luminance, _LEAST_FOR_POLARITY))
    curvature = np.where(log >= -1.0, 0.125, 0.075)
    m = 10.0 ** -(10.0 ** -(curvature * (log + 1.0) ** 2 + 0.0245))
    beta = 0.6 * 10.0 ** (-0.1488 * log)
    size = np.asarray(minutes, dtype=np.float64)
    positive = ALMOST_CERTAIN * _threshold_root(np.maximum(luminance, _LEAST_FOR_POLARITY), size) ** 2
    return np.asarray(np.clip(1.0 - m * size**-beta / (2.4 * positive), 0.0, 1.0))


def exposure_factor(luminance: ArrayLike, minutes: ArrayLike, exposure_time: float) -> NDArray[np.float64]:
    """F_t = (a + t)/t: a short glance asks for more (fitted to targets below 60 minutes of arc).

    Takes `luminance` [cd/m²], `minutes` [minutes of arc], `exposure_time` [s].
    """
    if exposure_time >= 2.0:
        return np.ones(np.broadcast_shapes(np.shape(luminance), np.shape(minutes)))
    x = np.log10(np.minimum(minutes, 60.0)) + 0.523
    y = np.log10(np.maximum(luminance, LEAST_LUMINANCE)) + 6.0
    by_size = 0.36 - 0.0972 * x**2 / (x**2 - 2.513 * x + 2.7895)
    by_luminance = 0.355 - 0.1217 * y**2 / (y**2 - 10.40 * y + 52.28)
    a = np.sqrt(by_size**2 + by_luminance**2) / 2.1
    return np.asarray((a + exposure_time) / exposure_time)


def age_factor(age: float) -> float:
    """F_age: what older eyes need more; it jumps from 1.93 to 1.90 at 64 years, as published (`age` [years])."""
    if age <= 64.0:
        return (max(age, 23.0) - 19.0) ** 2 / 2160.0 + 0.99
    return (age - 56.6) ** 2 / 116.3 + 1.43


def _checked(
    background: ArrayLike, angle: ArrayLike, exposure_time: float, age: float, factor: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    luminance, size = np.asarray(background, dtype=np.float64), np.asarray(angle, dtype=np.float64)
    if not (np.all(np.isfinite(luminance)) and np.all(luminance >= 0)):
        raise InputError(f"adaptation luminance must be finite and not negative [cd/m²], got {background!r}")
    if not (np.all(np.isfinite(size)) and np.all(size > 0)):
        raise InputError(f"angular size of the target must be positive and finite [rad], got {angle!r}")
    if not (exposure_time > 0 and factor > 0 and math.isfinite(factor)):
        raise InputError(
            f"exposure time and probability factor must be positive, got {exposure_time!r} s and {factor!r}"
        )
    if not 0 < age < 75:
        raise InputError(f"Adrian's model knows observers below 75 years, got {age!r}")
    return luminance, np.degrees(size) * 60.0
