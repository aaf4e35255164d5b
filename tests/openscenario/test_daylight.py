"""The sun and the light of a date and time."""

import datetime as dt
import math

import pytest

from fogsim.openscenario.environment import clear_sky_illuminance, sun_elevation, through_clouds

EQUINOX_NOON = dt.datetime(2026, 3, 20, 12, 0)


def test_the_sun_at_noon_is_as_high_as_latitude_and_season_have_it() -> None:
    for latitude in (0.0, 30.0, 50.0):
        assert math.degrees(sun_elevation(EQUINOX_NOON, math.radians(latitude), None)) == pytest.approx(
            90.0 - latitude, abs=1.0
        )
    solstice = dt.datetime(2026, 6, 21, 12, 0)
    assert math.degrees(sun_elevation(solstice, math.radians(50.0), None)) == pytest.approx(63.4, abs=0.2)


def test_time_zones_and_longitudes_shift_the_clock() -> None:
    # Munich, 20 November: the sun culminates at 11:59 - 0:14 (equation of time) + 0:14 (11.6° E in a zone of 15°).
    zone = dt.timezone(dt.timedelta(hours=1))
    place = math.radians(48.2), math.radians(11.6)
    heights = {
        minute: sun_elevation(dt.datetime(2026, 11, 20, 11, minute, tzinfo=zone), *place) for minute in range(50, 60)
    } | {60: sun_elevation(dt.datetime(2026, 11, 20, 12, 0, tzinfo=zone), *place)}
    assert max(heights, key=heights.__getitem__) in (59, 60)
    assert math.degrees(max(heights.values())) == pytest.approx(22.1, abs=0.2)


def test_illuminance_is_that_of_the_almanac_and_has_no_jumps() -> None:
    assert clear_sky_illuminance(math.radians(90.0)) == pytest.approx(129_000.0, rel=0.01)
    for degrees in (20.0, 5.0, -0.8, -5.0, -12.0):
        below, above = (clear_sky_illuminance(math.radians(degrees + d)) for d in (-1e-6, 1e-6))
        assert below == pytest.approx(above, rel=0.02)
    assert clear_sky_illuminance(math.radians(-40.0)) == clear_sky_illuminance(math.radians(-18.0)) < 1e-3
    assert through_clouds(80_000.0, 8.0) == pytest.approx(20_000.0)
    assert through_clouds(80_000.0, 0.0) == 80_000.0
