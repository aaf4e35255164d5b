"""Beams: the published tables, what lies between and beyond them, tables that cannot be, and where lamps are."""

import math

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.lighting.beams import (
    LampMount,
    front_fog_beam,
    high_beam,
    low_beam,
    luminous_flux,
    own_head_lamps,
    read_beam,
    scaled_beam,
)
from fogsim.values import Beam, Lamp
from fogsim.values.luminous_intensity import checked_beam, luminous_intensity

TABLE = "# a comment\nup\\right,-1,0,1\n-1,10,20,30\n0,40,50,60\n"


def toward(beam, right, up):
    return float(luminous_intensity(beam, math.radians(right), math.radians(up)))


def test_tables_hold_what_was_published():
    for beam, right, up, candela in [
        (high_beam, 0, 0, 37005),
        (high_beam, 1, 0, 39590),
        (high_beam, 20, 2, 285),
        (high_beam, -3, -5, 1213),
        (low_beam, 0, 0, 8830),
        (low_beam, 1, -1, 22740),
        (low_beam, -10, 4, 147),
        (low_beam, -45, 0, 23),
        (low_beam, 45, 0, 4),
    ]:
        assert toward(beam(), right, up) == pytest.approx(candela)


def test_flux_and_maxima_are_those_of_the_reports():
    window = (math.radians(-45), math.radians(45)), (math.radians(-5), math.radians(7))
    assert luminous_flux(high_beam(), *window) == pytest.approx(452, rel=0.01)
    assert luminous_flux(low_beam(), *window) == pytest.approx(315, rel=0.01)
    assert high_beam().intensity.max() == 39590
    assert low_beam().intensity.max() == 22740


def test_between_entries_the_logarithm_is_linear():
    beam = read_beam(TABLE, "table")
    assert toward(beam, 0.5, 0.0) == pytest.approx(math.sqrt(50 * 60))
    assert toward(beam, 0.0, -0.5) == pytest.approx(math.sqrt(50 * 20))


def test_beyond_a_table_intensity_falls_without_a_step():
    edge, near, far = (toward(low_beam(), 0, up) for up in (-5.0, -5.01, -15.0))
    assert near == pytest.approx(edge, rel=0.01)
    assert far == pytest.approx(edge * 10**-0.7)


def test_front_fog_lamp_keeps_to_its_limits():
    beam = front_fog_beam()
    wide = np.radians(np.linspace(-45, 45, 91))
    assert luminous_intensity(beam, wide, np.radians(np.linspace(1.25, 8, 28))[:, None]).max() <= 570
    assert 1140 <= toward(beam, 0, -1.5) <= 8600
    assert toward(beam, 18, -2.2) == pytest.approx(0.5 * toward(beam, 0, -2.2), rel=0.02)


def test_scaled_beam_is_brighter_everywhere():
    assert toward(scaled_beam(low_beam(), 0.3), 1, -1) == pytest.approx(0.3 * 22740)
    with pytest.raises(InputError, match=r"times -1"):
        scaled_beam(low_beam(), -1)


def test_tables_that_cannot_be_are_refused():
    for text, message in [
        (TABLE.replace("50", ""), r"row 2, column 2 must hold a number, got ''"),
        (TABLE.replace("50", "nan"), r"finite number of candela.*0° up, 0° right.*nan"),
        (TABLE.replace("50", "-5"), r"candela ≥ 0.*-5"),
        (TABLE.replace("40,50,60", "40,50"), r"row 2 has 3 cells, the first row has 4"),
        (TABLE.replace("-1,0,1", "0,-1,1"), r"azimuth must be two or more finite, ascending"),
        (TABLE.replace("\n0,40", "\n-2,40"), r"elevation must be two or more finite, ascending"),
        ("up\\right,0,1\n", r"two or more rows"),
    ]:
        with pytest.raises(InputError, match=message):
            read_beam(text, "table")


def test_shape_must_fit_the_directions():
    with pytest.raises(InputError, match=r"\(2, 3\), got \(3, 2\)"):
        checked_beam(Beam(np.arange(3.0), np.arange(2.0), np.ones((3, 2))))


def test_each_pair_is_where_a_car_has_it_or_the_mount_that_is_given():
    left, right = own_head_lamps(Lamp.LOW_BEAM, mount_height=1.5)
    assert left.offset == pytest.approx((1.8, 0.6, -0.85))
    assert right.offset == pytest.approx((1.8, -0.6, -0.85))
    assert left.beam is low_beam()
    mount = LampMount(behind_bumper=0.3, half_spacing=0.9, height=1.0)
    assert own_head_lamps(Lamp.HIGH_BEAM, 2.5, 2.0, mount)[0].offset == pytest.approx((1.7, 0.9, -1.5))


def test_lit_pairs_with_a_beam_ahead_are_there():
    assert own_head_lamps(Lamp.POSITION | Lamp.REAR_FOG | Lamp.STOP, 1.4) == ()
    lamps = own_head_lamps(Lamp.LOW_BEAM | Lamp.HIGH_BEAM | Lamp.FRONT_FOG, mount_height=1.4, setback=1.7)
    assert len(lamps) == 6
    assert sum(lamp.beam is high_beam() for lamp in lamps) == 2
    assert min(lamp.offset[2] for lamp in lamps) == pytest.approx(0.35 - 1.4)
