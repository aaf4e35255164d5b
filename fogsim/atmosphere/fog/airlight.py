"""Light of an overcast day."""

import math

AIRLIGHT_TINT = (0.98, 1.0, 1.02)
"""Airlight per channel relative to its luminance: fog droplets are grey, the overcast sky slightly bluish."""


def airlight_from_illuminance(illuminance: float, share: float = 0.95) -> tuple[float, float, float]:
    """Airlight of fog under an overcast sky, L∞ = share · E_h / π per channel (physics of Koschmieder's closed form).

    Parameters
    ----------
    illuminance : float
        Horizontal illuminance E_h [lx], not negative.
    share : float
        Airlight relative to a perfectly white horizontal diffuser, 0.8 … 1.0 in overcast fog.

    Returns
    -------
    tuple of float
        Radiance per channel [cd/m²].

    Raises
    ------
    ValueError
        If the illuminance is negative or not finite.
    """
    if not (illuminance >= 0 and math.isfinite(illuminance)):
        raise ValueError(f"illuminance must be finite and not negative, got {illuminance!r}")
    luminance = share * illuminance / math.pi
    red, green, blue = (luminance * tint for tint in AIRLIGHT_TINT)
    return (red, green, blue)
