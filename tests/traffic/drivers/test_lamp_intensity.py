"""Lamps toward an eye: UNECE's limits, the measured beams, and which side shows which."""

import numpy as np
import pytest

from fogsim.lighting.beams import high_beam, low_beam, luminous_flux
from fogsim.scene.lamps import FULL, SIGNAL_LOBES
from fogsim.traffic.drivers.lamp_intensity import (
    LEAST_INTENSITY,
    LIT_ROAD_INTENSITY,
    SIDE_MARKER,
    THIRD_STOP_LAMP,
    beam_intensity,
    burning_head_lamps,
    head_lamp_share,
    intensity_toward,
    rear_intensity,
)
from fogsim.values import Beam, Lamp
from fogsim.values.light import Side, dark_on
from fogsim.values.luminous_intensity import SignalLobe, luminous_intensity

LIT = int(Lamp.POSITION | Lamp.LOW_BEAM)


def test_light_is_that_of_measured_beams() -> None:
    """Low beams half a degree to one degree up, the mean of left and right of UMTRI-2004-23, within a factor of 2."""

    def measured(beam: Beam, degrees: float, up: float) -> float:
        return float(luminous_intensity(beam, np.radians([-degrees, degrees]), np.radians(up)).mean())

    for degrees in [1.0, 2.0, 5.0, 10.0, 20.0]:
        low = [measured(low_beam(), degrees, up) for up in (0.5, 1.0)]
        assert 0.5 * min(low) < beam_intensity(LIT, degrees) < 2.0 * max(low)
    for degrees in [0.0, 2.0, 5.0, 10.0, 20.0]:
        high = measured(high_beam(), degrees, 0.0)
        assert beam_intensity(int(Lamp.HIGH_BEAM), degrees) == pytest.approx(high, rel=0.35)
    for degrees in [5.0, 10.0, 20.0]:
        own = measured(low_beam(), degrees, -1.5) / measured(low_beam(), 0.0, -1.5)
        assert head_lamp_share(np.radians(degrees)) == pytest.approx(own, rel=0.2)


def test_each_side_shows_its_own_lamps() -> None:
    everything = LIT | int(Lamp.STOP | Lamp.REAR_FOG)
    assert intensity_toward(everything, 5.0, 30.0, 0.0) == beam_intensity(LIT, 0.0)
    assert intensity_toward(everything, 5.0, -35.0, 0.0) == rear_intensity(everything) == 200.0
    assert intensity_toward(everything, 5.0, -2.5, 30.0) == LIT_ROAD_INTENSITY
    assert intensity_toward(int(Lamp.POSITION), 5.0, -2.5, 30.0) == LEAST_INTENSITY
    assert intensity_toward(everything, 12.0, -2.5, -30.0) == SIDE_MARKER
    assert intensity_toward(int(Lamp.STOP), 5.0, 30.0, 0.0) == 0.0
    assert intensity_toward(0, 12.0, -2.5, 30.0) == 0.0
    assert intensity_toward(int(Lamp.POSITION), 5.0, 30.0, 30.0) == pytest.approx(10.0 * 0.030)
    lamps = (Lamp.POSITION | Lamp.STOP, Lamp.REAR_FOG | Lamp.STOP, Lamp.LOW_BEAM)
    assert [rear_intensity(int(lit)) for lit in lamps] == [100.0, 200.0, 0.0]


@pytest.mark.parametrize(
    ("lamp", "lobe"),
    [(Lamp.POSITION, SignalLobe.SIGNAL), (Lamp.STOP, SignalLobe.SIGNAL), (Lamp.REAR_FOG, SignalLobe.REAR_FOG)],
)
def test_drivers_see_rear_lamps_as_bright_from_aside_as_pictures_show_them(lamp: Lamp, lobe: SignalLobe) -> None:
    table, least = SIGNAL_LOBES[lobe], LEAST_INTENSITY if lamp is Lamp.POSITION else 0.0
    for degrees in (0.0, 3.0, 5.0, 14.0, 20.0, 44.0, 75.0, 85.0):
        aside = 30.0 * np.tan(np.radians(degrees))
        drawn = float(luminous_intensity(table, np.radians(min(degrees, 80.0)), 0.0)) / FULL
        seen = intensity_toward(int(lamp), 5.0, -35.0, aside)
        assert seen == pytest.approx(max(drawn * rear_intensity(int(lamp)), least), rel=1e-6)


def test_the_lit_road_is_as_bright_as_the_flux_of_measured_low_beams_makes_it() -> None:
    flux = 2.0 * luminous_flux(low_beam(), (np.radians(-45.0), np.radians(45.0)), (np.radians(-5.0), np.radians(7.0)))
    assert flux * 0.1 / np.pi * 1.1 / 100.0 == pytest.approx(LIT_ROAD_INTENSITY, rel=0.15)


def test_lamps_are_as_bright_from_the_left_as_from_the_right_and_dimmer_off_their_axis() -> None:
    for ahead in (30.0, -35.0):
        off_axis = [intensity_toward(LIT, 5.0, ahead, aside) for aside in (0.0, 5.0, 20.0, 60.0)]
        assert off_axis == sorted(off_axis, reverse=True)
        assert off_axis[2] == intensity_toward(LIT, 5.0, ahead, -20.0)


def test_what_is_seen_follows_the_lamps_that_burn() -> None:
    """One of two changes nothing from behind; where both are dark, the third stop lamp or the tail lamps count."""
    left, right = (dark_on(int(Lamp.STOP), side) for side in (Side.LEFT, Side.RIGHT))
    braking = LIT | int(Lamp.STOP)
    assert rear_intensity(braking | left) == rear_intensity(braking | right) == 100.0
    assert rear_intensity(braking | left | right) == THIRD_STOP_LAMP
    assert rear_intensity(braking | left | right | dark_on(int(Lamp.STOP), Side.MIDDLE)) == 8.0
    tails = [dark_on(int(Lamp.POSITION), side) for side in (Side.LEFT, Side.RIGHT)]
    assert [rear_intensity(LIT | tails[0]), rear_intensity(LIT | sum(tails))] == [8.0, 0.0]


def test_one_dead_head_lamp_lights_half_the_road_and_is_still_seen_from_ahead() -> None:
    dead = LIT | dark_on(int(Lamp.LOW_BEAM), Side.RIGHT)
    assert [burning_head_lamps(lamps) for lamps in (LIT, dead, int(Lamp.POSITION))] == [1.0, 0.5, 0.0]
    assert intensity_toward(dead, 5.0, 30.0, 0.0) == intensity_toward(LIT, 5.0, 30.0, 0.0)
    assert intensity_toward(dead, 5.0, -2.5, 30.0) == 0.5 * LIT_ROAD_INTENSITY
