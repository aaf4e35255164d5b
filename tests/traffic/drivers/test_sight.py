"""What a driver can see: check values of Allard's and Koschmieder's laws, and their limits."""

import math

import numpy as np
import pytest

from fogsim.traffic.drivers.lamp_intensity import rear_intensity
from fogsim.traffic.drivers.sight import DAY_EYE_THRESHOLD, DriverSight, inherent_contrast
from fogsim.units import extinction_from_visibility
from fogsim.values import Lamp

DISTANCES = np.linspace(1.0, 400.0, 39_901)


def reach(sight: DriverSight, visibility: float, intensity: float) -> float:
    """Farthest distance at which a lamp is seen [m]."""
    depth = extinction_from_visibility(visibility) * DISTANCES
    return float(DISTANCES[sight.sees_lamp(DISTANCES, depth, np.full_like(DISTANCES, intensity))].max())


@pytest.mark.parametrize(("intensity", "metres"), [(4, 166.0), (10, 188.0), (60, 234.0), (150, 258.0), (300, 276.0)])
def test_lamps_at_v_100_and_a_threshold_of_one_microlux(
    intensity: float, metres: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Allard, E = I e^(−kd) / d² = 10⁻⁶ lx at V_met = 100 m: published check values."""
    monkeypatch.setattr("fogsim.traffic.drivers.sight.NIGHT_EYE_THRESHOLD", 1e-6)
    assert reach(DriverSight(illuminance=0.1), 100.0, intensity) == pytest.approx(metres, abs=0.6)


def test_a_rear_fog_lamp_is_seen_farther_than_a_tail_lamp_and_all_lamps_less_far_by_day() -> None:
    night, day = DriverSight(illuminance=0.1), DriverSight(illuminance=10_000.0)
    assert reach(night, 60.0, rear_intensity(Lamp.REAR_FOG)) > 1.3 * reach(night, 60.0, rear_intensity(Lamp.POSITION))
    assert reach(day, 60.0, 200.0) < reach(night, 60.0, 200.0)
    assert day.eye_threshold == pytest.approx(DAY_EYE_THRESHOLD)


@pytest.mark.parametrize("visibility", [40.0, 100.0, 300.0])
def test_by_day_a_black_vehicle_is_seen_up_to_the_meteorological_visibility(visibility: float) -> None:
    depth = extinction_from_visibility(visibility) * DISTANCES
    seen = DriverSight(illuminance=10_000.0).sees_body(DISTANCES, depth, np.ones_like(DISTANCES))
    assert DISTANCES[seen].max() == pytest.approx(visibility, abs=0.02)


def test_a_light_vehicle_is_lost_sooner() -> None:
    black, white = inherent_contrast((0.02, 0.02, 0.02)), inherent_contrast((0.8, 0.8, 0.8))
    assert 0.5 < white < black <= 1.0
    depth = np.array([2.85])
    sight = DriverSight(illuminance=10_000.0)
    assert sight.sees_body([1.0], depth, [black])[0]
    assert not sight.sees_body([1.0], depth, [white])[0]


def test_in_clear_air_by_day_everything_is_seen_and_at_night_what_the_headlamps_reach() -> None:
    clear = np.zeros_like(DISTANCES)
    assert DriverSight(10_000.0).sees_body(DISTANCES, clear, np.full_like(DISTANCES, 0.3)).all()
    seen = DriverSight(0.1, headlamp_reach=55.0).sees_body(DISTANCES, clear, np.ones_like(DISTANCES))
    assert DISTANCES[seen].max() == pytest.approx(55.0, abs=0.02)


def test_the_brightest_lit_lamp_counts_and_an_unlit_vehicle_has_none() -> None:
    assert rear_intensity(int(Lamp.POSITION | Lamp.STOP)) == 100.0
    assert rear_intensity(int(Lamp.REAR_FOG | Lamp.STOP)) == 200.0
    assert rear_intensity(int(Lamp.LOW_BEAM)) == 0.0
    assert not DriverSight(0.1).sees_lamp([1.0], [0.0], [0.0])[0]


def test_the_eye_adapts_between_night_and_day() -> None:
    thresholds = [DriverSight(illuminance=e).eye_threshold for e in (1e-3, 1.0, 30.0, 1000.0, 1e5)]
    assert thresholds == sorted(thresholds)
    assert thresholds[0] == thresholds[1]
    assert math.isclose(thresholds[2], 1e-4, rel_tol=0.05)


def test_nobody_within_the_sure_distance_is_hidden() -> None:
    sight = DriverSight(illuminance=10_000.0)
    white = inherent_contrast((1.0, 1.0, 1.0))
    for k in (0.01, 0.1):
        distance = sight.sure_distance(k)
        assert sight.sees_body([distance], [k * distance], [white])[0]
    assert sight.sure_distance(0.0) == math.inf
    assert DriverSight(illuminance=0.1).sure_distance(0.01) == 0.0


@pytest.mark.parametrize("illuminance", [0.1, 10_000.0])
@pytest.mark.parametrize("k", [0.01, 0.1])
def test_beyond_the_hidden_distance_nothing_is_seen_and_just_within_it_something_is(
    illuminance: float, k: float
) -> None:
    sight = DriverSight(illuminance)
    edge = sight.hidden_distance(k)
    for distance, expected in ((1.01 * edge, False), (0.98 * edge, True)):
        body = sight.sees_body([distance], [k * distance], [1.0])[0]
        assert (body or sight.sees_lamp([distance], [k * distance], [200.0])[0]) == expected
    assert sight.hidden_distance(0.0) == math.inf


@pytest.mark.parametrize("illuminance", [0.1, 10_000.0])
def test_limits_are_the_depths_at_which_body_and_lamps_are_lost(illuminance: float) -> None:
    sight = DriverSight(illuminance)
    for distance in (5.0, 30.0, 50.0):
        for contrast in (0.5, 1.0):
            limit = sight.body_limit(distance, contrast)
            assert sight.sees_body([distance], [limit - 1e-6], [contrast])[0]
            assert not sight.sees_body([distance], [limit + 1e-6], [contrast])[0]
        limit = sight.lamp_limit(distance, 100.0)
        assert sight.sees_lamp([distance], [limit - 1e-6], [100.0])[0]
        assert not sight.sees_lamp([distance], [limit + 1e-6], [100.0])[0]
    assert sight.lamp_limit(1.0, 0.0) == -math.inf
