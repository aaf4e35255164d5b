"""Elevation of the sun, and illuminance of the ground."""

import datetime as dt
import math

from numpy.polynomial import polynomial

USUAL_LATITUDE = math.radians(50.0)
"""Latitude if a map gives none [rad]."""

_BRANCHES = (
    (20.0, (3.74, 3.97, -4.07, 1.47)),
    (5.0, (3.05, 13.28, -45.98, 64.33)),
    (-0.8, (2.88, 22.26, -207.64, 1034.30)),
    (-5.0, (2.88, 21.81, -258.11, -858.36)),
    (-12.0, (2.70, 12.17, -431.69, -1899.83)),
    (-18.0, (13.84, 262.72, 1447.42, 2797.93)),
)
"""Lowest elevation [deg] and coefficients of each piece of `clear_sky_illuminance`."""


def sun_elevation(moment: dt.datetime, latitude: float | None, longitude: float | None) -> float:
    """Elevation of the sun's centre above the horizon, without refraction [rad], at a place [rad, east and north].

    Declination and equation of time after Spencer (Fourier series representation of the position of the sun, Search
    2(5), 1971), accurate to some minutes of arc. A time without a time zone, or without a longitude, is mean solar
    time; without a latitude, 50° N is assumed.
    """
    hour = moment.hour + moment.minute / 60.0 + moment.second / 3600.0
    offset = moment.utcoffset()
    if longitude is not None and offset is not None:
        hour += math.degrees(longitude) / 15.0 - offset.total_seconds() / 3600.0
    day = 2.0 * math.pi * (moment.timetuple().tm_yday - 1 + (hour - 12.0) / 24.0) / 365.0
    terms = [trig(n * day) for n in (1, 2, 3) for trig in (math.cos, math.sin)]
    declination = 0.006918 + math.fsum(
        c * t for c, t in zip((-0.399912, 0.070257, -0.006758, 0.000907, -0.002697, 0.001480), terms, strict=True)
    )
    equation = 229.18 * (
        0.000075 + math.fsum(c * t for c, t in zip((0.001868, -0.032077, -0.014615, -0.040849), terms[:4], strict=True))
    )
    solar = hour + (equation / 60.0 if longitude is not None else 0.0)
    angle = math.pi * (solar - 12.0) / 12.0
    north = USUAL_LATITUDE if latitude is None else latitude
    height = math.sin(north) * math.sin(declination) + math.cos(north) * math.cos(declination) * math.cos(angle)
    return math.asin(min(max(height, -1.0), 1.0))


def clear_sky_illuminance(elevation: float) -> float:
    """Horizontal illuminance by sun and clear sky, also in twilight and at night [lx].

    Seidelmann (ed.), Explanatory Supplement to the Astronomical Almanac, 1992, p. 491: cubics in elevation [rad] / 90°
    of log10 lx, from −18° on; below, starlight is as bright as there.
    """
    degrees = min(90.0, max(_BRANCHES[-1][0], math.degrees(elevation)))
    coefficients = next(one for lowest, one in _BRANCHES if degrees >= lowest)
    logarithm: float = float(polynomial.polyval(degrees / 90.0, coefficients))
    return math.pow(10.0, logarithm)


def through_clouds(illuminance: float, oktas: float) -> float:
    """Horizontal illuminance [lx] under 0 … 8 oktas (Kasten & Czeplak, Solar Energy 24, 1980: 1 − 0.75 (N/8)^3.4)."""
    return illuminance * (1.0 - 0.75 * math.pow(min(oktas, 8.0) / 8.0, 3.4))
