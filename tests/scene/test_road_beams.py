"""Head lamps of a traffic as what lights the road."""

import math

import numpy as np

from fogsim.lighting.beams import LampMount
from fogsim.scene import road_beams
from fogsim.values import Lamp, TrafficState
from fogsim.values.light import Side, dark_on
from tests.helpers.vehicles import vehicles

BEAMS = LampMount().beams
LOW = int(Lamp.POSITION | Lamp.LOW_BEAM)


def traffic(*cars: tuple[float, int]) -> TrafficState:
    """Cars on a line, by their places along it and their lamps; the first has the camera."""
    places = [[place, 0.0, 2.0] for place, _ in cars]
    return vehicles(places, kinds="passenger", heading=math.pi, lamps=[lamps for _, lamps in cars])


def test_who_shines_lights_the_road_and_the_camera_itself_does_not() -> None:
    state = traffic(
        (0.0, LOW), (50.0, LOW), (90.0, int(Lamp.POSITION)), (400.0, LOW), (-30.0, LOW | int(Lamp.FRONT_FOG))
    )
    found = road_beams(state, 0, (0.0, 0.0, 3.4), BEAMS, 0.1)
    assert found is not None
    assert found.position[:, 0].tolist() == [-30.0, -30.0, 50.0]
    assert [tuple(BEAMS)[kind] for kind in found.kind] == [Lamp.LOW_BEAM, Lamp.FRONT_FOG, Lamp.LOW_BEAM]
    assert found.scale.tolist() == [2.0, 2.0, 2.0]
    np.testing.assert_allclose(found.position[:, 2] - 2.0, found.height)
    assert found.grade.tolist() == [0.0, 0.0, 0.0]
    assert 0.5 < found.height[0] < 0.8
    assert found.height[1] < found.height[0]


def test_a_dead_lamp_lights_nothing_and_few_vehicles_count() -> None:
    dead = LOW | dark_on(int(Lamp.LOW_BEAM), Side.LEFT)
    found = road_beams(traffic((0.0, 0), (20.0, dead)), 0, (0.0, 0.0, 1.4), BEAMS, 0.1)
    assert found is not None
    assert found.scale.tolist() == [1.0]
    assert road_beams(traffic((0.0, LOW), (20.0, 0)), 0, (0.0, 0.0, 1.4), BEAMS, 0.1) is None
    many = road_beams(traffic(*((10.0 * i, LOW) for i in range(15))), None, (0.0, 0.0, 1.4), BEAMS, 0.1)
    assert many is not None
    assert many.position[:, 0].tolist() == [10.0 * i for i in range(4)]
