"""Which lamps throw light ahead, and from where."""

import pytest

from fogsim.lighting.beams import LampMount, high_beam, low_beam, own_head_lamps
from fogsim.values import Lamp


def test_lamps_without_a_beam_ahead_are_left_out():
    assert own_head_lamps(Lamp.POSITION | Lamp.REAR_FOG | Lamp.STOP, 1.4) == ()


def test_each_pair_is_where_a_car_has_it():
    left, right = own_head_lamps(Lamp.LOW_BEAM, mount_height=1.5)
    assert left.offset == pytest.approx((1.8, 0.6, -0.85))
    assert right.offset == pytest.approx((1.8, -0.6, -0.85))
    assert left.beam is low_beam()


def test_all_lit_pairs_are_there():
    lamps = own_head_lamps(Lamp.LOW_BEAM | Lamp.HIGH_BEAM | Lamp.FRONT_FOG, mount_height=1.4, setback=1.7)
    assert len(lamps) == 6
    assert sum(lamp.beam is high_beam() for lamp in lamps) == 2
    assert min(lamp.offset[2] for lamp in lamps) == pytest.approx(0.35 - 1.4)


def test_mount_can_be_given():
    mount = LampMount(behind_bumper=0.3, half_spacing=0.9, height=1.0)
    assert own_head_lamps(Lamp.HIGH_BEAM, 2.5, 2.0, mount)[0].offset == pytest.approx((1.7, 0.9, -1.5))
