"""Street lamps light the road: by the formula below them, not above, less in fog, and nothing that shines itself."""

import dataclasses
import math

import numpy as np
import pytest

from fogsim.atmosphere.air import Air
from fogsim.atmosphere.surfaces.streetlight import StreetLight
from fogsim.values import FogBank, Lights, LightSources, StreetLighting
from tests.atmosphere.night_scene import CAMERA, POSE, fog, rays, road_view

SKY, REFLECTANCE = 0.1, 0.2
LAMP = np.array([[20.0, 1.0, 8.0]])
EVEN = StreetLighting(LAMP, 8.0, np.array([0.0, math.pi / 2]), np.array([1000.0, 1000.0]), (1.0, 1.0, 1.0), SKY)


def road(value=REFLECTANCE * SKY / math.pi):
    view = road_view()
    view.radiance[np.isfinite(view.distance)] = value
    return view


def added(view=None, field=None, lamps=EVEN, pose=POSE):
    seen = view or road()
    return StreetLight().on(seen, CAMERA, pose, field or fog(math.inf), lamps).radiance - seen.radiance


def formula(lost=0.0):
    """What a road of that reflectance returns of the lamp's light, and where it is within its reach."""
    seen = np.isfinite(road_view().distance)
    place = rays() * np.where(seen, road_view().distance, 1.0)[..., None]
    square = (place[..., 0] - LAMP[0, 0]) ** 2 + (place[..., 1] - LAMP[0, 1]) ** 2
    way = np.sqrt(square + 64.0)
    light = REFLECTANCE / math.pi * 1000.0 * 8.0 / way**3 * np.exp(-lost * way)
    return light, seen & (square < 30.0**2)


def test_road_returns_the_lamps_light_as_the_skys():
    light, near = formula()
    assert added()[near][:, 1] == pytest.approx(light[near], rel=0.05)
    assert added()[~np.isfinite(road_view().distance)].max() == 0.0
    field = fog(100)  # takes a little of the light
    light, near = formula(0.3 * field.extinction)
    assert added(field=field)[near][:, 1] == pytest.approx(light[near], rel=0.05)


def test_fog_on_a_part_of_the_road_dims_the_lamps_in_it():
    lamps = dataclasses.replace(EVEN, position=np.array([[20.0, 0.0, 8.0], [80.0, 0.0, 8.0]]))
    bank = FogBank((0.0, 0.0), (1.0, 0.0), 60.0, 100.0, 4.0, 0.1)
    clear, foggy = added(lamps=lamps), added(lamps=lamps, field=dataclasses.replace(fog(math.inf), banks=(bank,)))
    distance = road_view().distance
    near, far = np.abs(distance - 20.0) < 3.0, np.abs(distance - 80.0) < 5.0
    assert foggy[near] == pytest.approx(clear[near], rel=0.01)
    assert foggy[far].mean() < 0.85 * clear[far].mean()


def test_the_same_light_from_wherever_the_camera_looks_and_as_it_drives_on():
    painter, still = StreetLight(), added()
    for x in (0.0, 10.0, 200.0, 260.0, 1000.0):
        lamps = dataclasses.replace(EVEN, position=LAMP + np.array((x, 0.0, 0.0)))
        pose = dataclasses.replace(POSE, position=(x, 0.0, 1.5))
        out = painter.on(road(), CAMERA, pose, fog(math.inf), lamps).radiance - road().radiance
        assert (np.abs(out - still) <= np.maximum(0.05 * still, 1e-3)).all()
    painter = StreetLight()
    lamps = dataclasses.replace(EVEN, position=np.array([[10.0 * n, 3.0, 8.0] for n in range(-20, 200)]))
    light = []
    for x in np.arange(0.0, 150.0, 10.0):
        pose = dataclasses.replace(POSE, position=(float(x), 0.0, 1.5))
        light.append(painter.on(road(), CAMERA, pose, fog(math.inf), lamps).radiance[100, 80, 1])
    assert light == pytest.approx(np.full(15, light[0]), rel=0.05)


def test_what_shines_itself_returns_no_more_than_white_and_what_hangs_above_the_lamps_is_dark():
    bright = added(road(1e4))
    light, near = formula()
    assert bright[near][:, 1] == pytest.approx(0.95 / REFLECTANCE * light[near], rel=0.06, abs=2e-3)
    high = dataclasses.replace(EVEN, position=LAMP - np.array((0.0, 0.0, 8.0)))
    assert added(lamps=dataclasses.replace(high, height=8.0)).max() < 0.02 * added().max()


@pytest.mark.parametrize(
    "lamps", [dataclasses.replace(EVEN, sky_illuminance=0.0), dataclasses.replace(EVEN, position=np.zeros((0, 3)))]
)
def test_without_lamps_or_sky_the_view_is_as_it_was(lamps):
    view = road()
    assert StreetLight().on(view, CAMERA, POSE, fog(100), lamps) is view


def test_air_attenuates_the_light_and_leaves_the_view_alone():
    view, field = road(), fog(100)
    before = view.radiance.copy()
    lights = Lights((), LightSources.none(), EVEN)
    lit = Air(field).radiance(view, CAMERA, POSE, lights) - Air(field).radiance(view, CAMERA, POSE)
    near = formula()[1]
    expected = added(field=field)[..., 1] * np.exp(-field.extinction * np.where(near, view.distance, 0.0))
    assert lit[near][:, 1] == pytest.approx(expected[near], rel=1e-3, abs=1e-5)
    assert np.array_equal(view.radiance, before)
