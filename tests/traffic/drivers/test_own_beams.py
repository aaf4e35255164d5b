"""What own head lamps do for drivers: measured beams on a rear, and the veil of photons."""

import math

import numpy as np
import pytest

from fogsim.lighting.beams import high_beam, low_beam
from fogsim.lighting.own_sight import own_veil
from fogsim.traffic.drivers.lamp_intensity import HIGH_BEAM_LIGHT, head_lamp_light, high_beam_veil, uses_high_beam
from fogsim.traffic.drivers.sight import DriverSight
from fogsim.units import extinction_from_visibility
from fogsim.values import Beam, Lamp
from fogsim.values.light import Side, dark_on
from fogsim.values.luminous_intensity import luminous_intensity

LOW, HIGH = int(Lamp.LOW_BEAM), int(Lamp.HIGH_BEAM)
NIGHT = DriverSight(0.05)


def on_a_rear(beam: Beam, distance: float) -> float:
    up = np.arctan((np.linspace(0.3, 1.2, 10) - 0.65) / distance)[:, None]
    return float(luminous_intensity(beam, np.arctan(np.linspace(-1.4, 1.4, 15) / distance), up).mean())


def test_high_beams_light_a_rear_as_measured_lamps_do() -> None:
    for distance in [30.0, 55.0, 100.0, 200.0]:
        measured = on_a_rear(high_beam(), distance) / on_a_rear(low_beam(), distance)
        assert measured == pytest.approx(HIGH_BEAM_LIGHT, rel=0.08)


def test_each_head_lamp_that_burns_counts() -> None:
    one_dead = HIGH | dark_on(HIGH, Side.LEFT)
    assert [head_lamp_light(lamps) for lamps in (0, LOW, HIGH, one_dead)] == [0.0, 1.0, 4.8, 2.4]
    assert [uses_high_beam(lamps) for lamps in (0, LOW, HIGH, one_dead)] == [False, False, True, True]


def test_the_veil_is_that_of_the_pictures() -> None:
    for visibility in [30.0, 50.0, 100.0, 200.0, 500.0, 1000.0]:
        more = own_veil(Lamp.HIGH_BEAM, visibility, 42.0) - own_veil(Lamp.LOW_BEAM, visibility, 42.0)
        assert high_beam_veil(extinction_from_visibility(visibility)) == pytest.approx(more, rel=0.1)


def test_high_beams_show_an_unlit_car_farther_and_the_less_so_the_thicker_the_fog() -> None:
    gains = []
    for visibility in (50.0, 100.0, 300.0, 1000.0, math.inf):
        k = extinction_from_visibility(visibility)
        by_high = NIGHT.seen_distance(k, 0.9, 0.0, HIGH_BEAM_LIGHT, high_beam_veil(k))
        gains.append(by_high / NIGHT.seen_distance(k, 0.9))
    assert gains == sorted(gains)
    assert 1.0 < gains[0] < 1.15
    assert 2.0 < gains[-1] < math.sqrt(HIGH_BEAM_LIGHT)


def test_a_rear_fog_lamp_is_seen_farther_than_a_tail_lamp() -> None:
    """By Allard's law of 200 and 8 cd by night: 1.5 times at V_met = 50 m, twice at 700 m."""
    ratios = {}
    for visibility in (50.0, 150.0, 700.0):
        k = extinction_from_visibility(visibility)
        ratios[visibility] = NIGHT.seen_distance(k, 0.9, 200.0) / NIGHT.seen_distance(k, 0.9, 8.0)
    assert ratios == {
        50.0: pytest.approx(1.5, abs=0.05),
        150.0: pytest.approx(1.66, abs=0.05),
        700.0: pytest.approx(2.0, abs=0.1),
    }
