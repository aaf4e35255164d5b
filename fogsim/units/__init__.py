"""Physical constants and the conversions that are made at the edges of FogSim, each written once."""

import math
from collections.abc import Sequence

CONTRAST_THRESHOLD = 0.05
"""Contrast at which a black target is just visible [-] (CIE e-ILV 772 and WMO, "meteorological optical range")."""

OPTICAL_DEPTH_AT_VISIBILITY = -math.log(CONTRAST_THRESHOLD)
"""k · V_met = ln 20 = 2.9957 [-]."""

KMH_PER_MPS = 3.6
"""Kilometres an hour in one metre a second."""

METRES_PER_MILE = 1609.344
"""International mile [m]."""

GRAVITY = 9.80665
"""Standard acceleration of free fall [m/s²]."""

LUMINANCE_WEIGHTS = (0.2126, 0.7152, 0.0722)
"""Shares of linear red, green and blue in luminance [-] (ITU-R BT.709)."""

DAY_ILLUMINANCE = 1000.0
"""Horizontal illuminance from which it is day [lx]: UNECE R48 lights the dipped beam by itself below it, the veil of
own lamps is less than 1 % of the airlight above it, and eyes are adapted to daylight; below is twilight, then night."""

_CLOCK_DIGITS = 9


def luminance_of(colour: Sequence[float]) -> float:
    """Luminance of one colour, in the unit of its channels.

    Parameters
    ----------
    colour : (3,) sequence of float
        Linear red, green and blue.
    """
    red, green, blue = LUMINANCE_WEIGHTS
    return red * colour[0] + green * colour[1] + blue * colour[2]


def clock_time(seconds: float) -> float:
    """Take the noise of binary fractions out of a time that was counted or added up: 3.8000000000000003 s is 3.8 s.

    Parameters
    ----------
    seconds : float
        Time [s].

    Returns
    -------
    float
        The nearest whole nanosecond [s]; steps of SUMO are whole milliseconds, those of highway-env may be 1/15 s.
    """
    return round(seconds, _CLOCK_DIGITS)


def extinction_from_visibility(visibility: float) -> float:
    """Extinction coefficient of fog with a given meteorological visibility (Koschmieder; CIE 5 % contrast).

    Parameters
    ----------
    visibility : float
        Meteorological visibility V_met [m], positive; ``inf`` is clear air.

    Returns
    -------
    float
        Extinction coefficient k = ln 20 / V_met [1/m]; exactly 0 for ``inf``.

    Raises
    ------
    ValueError
        If the visibility is not positive (NaN included).
    """
    if not visibility > 0:
        raise ValueError(f"meteorological visibility must be a positive length in metres, got {visibility!r}")
    return OPTICAL_DEPTH_AT_VISIBILITY / visibility


def visibility_from_extinction(extinction: float) -> float:
    """Meteorological visibility of fog with a given extinction coefficient, the inverse of the above.

    Parameters
    ----------
    extinction : float
        Extinction coefficient k [1/m], not negative.

    Returns
    -------
    float
        V_met = ln 20 / k [m]; ``inf`` for k = 0.

    Raises
    ------
    ValueError
        If the extinction coefficient is negative or NaN.
    """
    if not extinction >= 0:
        raise ValueError(f"an extinction coefficient must not be negative, got {extinction!r}")
    return math.inf if extinction == 0 else OPTICAL_DEPTH_AT_VISIBILITY / extinction


def finite_or_none(value: float) -> float | None:
    """A value as files hold it: None for what is not a finite number.

    Parameters
    ----------
    value : float
        Any number.
    """
    return value if math.isfinite(value) else None
