"""Head lamps of others light the road: by the inverse square and the cosine, through fog, and nothing behind them."""

import dataclasses
import math

import numpy as np
import pytest

from fogsim.atmosphere.air import Air
from fogsim.atmosphere.surfaces.road_beams import TrafficLight
from fogsim.lighting.beams import high_beam, low_beam
from fogsim.values import FogBank, FogField, Lights, LightSources, StreetLighting, View
from fogsim.values.light import RoadBeams
from fogsim.values.luminous_intensity import luminous_intensity
from tests.atmosphere.night_scene import CAMERA, POSE, fog, rays, road_view

SKY, REFLECTANCE, HEIGHT = 0.05, 0.1, 0.65
COMING = RoadBeams(
    position=np.array([[60.0, 3.5, HEIGHT]]),
    heading=np.array([math.pi]),
    grade=np.zeros(1),
    height=np.array([HEIGHT]),
    kinds=(low_beam(), high_beam()),
    kind=np.array([0]),
    scale=np.array([2.0]),
    sky_illuminance=SKY,
)
GOING = dataclasses.replace(COMING, position=np.array([[25.0, 0.0, HEIGHT]]), heading=np.array([0.0]))


def road() -> View:
    view = road_view()
    view.radiance[np.isfinite(view.distance)] = REFLECTANCE * SKY / math.pi
    return view


def added(beams: RoadBeams = COMING, field: FogField | None = None) -> np.ndarray:
    seen = road()
    return TrafficLight().on(seen, CAMERA, POSE, field or fog(math.inf), beams).radiance[..., 1] - seen.radiance[..., 1]


def places() -> tuple[np.ndarray, np.ndarray]:
    """Where the pixels of the road are, and which of them see it within 100 m."""
    distance = road_view().distance
    seen = distance < 100.0
    return rays() * np.where(seen, distance, 1.0)[..., None], seen


def formula(beams: RoadBeams, lost: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """What the road returns of a pair's light [cd/m²], and where it is well within its reach."""
    place, seen = places()
    east, north = place[..., 0] - beams.position[0, 0], place[..., 1] - beams.position[0, 1]
    cosine, sine = math.cos(beams.heading[0]), math.sin(beams.heading[0])
    along, across = east * cosine + north * sine, east * sine - north * cosine
    way = np.sqrt(along**2 + across**2 + HEIGHT**2)
    beam = beams.kinds[int(beams.kind[0])]
    candela = luminous_intensity(beam, np.arctan2(across, along), -np.arcsin(HEIGHT / way))
    light = beams.scale[0] * candela * HEIGHT / way**3 * np.exp(-lost * way)
    return REFLECTANCE / math.pi * light, seen & (along > 4.0) & (along < 55.0) & (np.abs(across) < 12.0)


@pytest.mark.parametrize("beams", [COMING, GOING, dataclasses.replace(COMING, kind=np.array([1]))])
def test_the_road_returns_the_beams_light_as_the_skys(beams: RoadBeams) -> None:
    light, near = formula(beams)
    found = added(beams)
    assert near.sum() > 300
    # The map has cells of 1 m, near the lamp as anywhere.
    assert found[near].sum() == pytest.approx(light[near].sum(), rel=0.03)
    assert np.median(np.abs(found[near] / light[near] - 1.0)) < 0.03


def test_behind_lamps_and_above_them_there_is_no_light() -> None:
    place, seen = places()
    assert added()[seen & (place[..., 0] > 62.0)].max() == 0.0
    wall = road()
    wall.distance[:], wall.radiance[:] = 20.0, REFLECTANCE * SKY / math.pi
    height = POSE.position[2] + 20.0 * rays()[..., 2]
    for below_sea_level in (0.0, 10.0):
        pose = dataclasses.replace(POSE, position=(0.0, 0.0, POSE.position[2] - below_sea_level))
        lower = dataclasses.replace(COMING, position=COMING.position - (0.0, 0.0, below_sea_level))
        lit = TrafficLight().on(wall, CAMERA, pose, fog(math.inf), lower).radiance - wall.radiance
        assert lit[height > 1.7].max() == 0.0
        assert lit[(height > 0.0) & (height < 0.6)].max() > 0.0


def test_light_follows_the_road_uphill() -> None:
    uphill = dataclasses.replace(COMING, position=COMING.position - (0.0, 0.0, 3.0), grade=np.array([math.atan(0.1)]))
    light, near = formula(COMING)
    east = places()[0][..., 0]
    near &= (east > 12.0) & (east < 25.0)
    assert added(uphill)[near].sum() == pytest.approx(light[near].sum(), rel=0.03)


def test_fog_takes_the_light_of_its_way() -> None:
    field = fog(100.0)
    light, near = formula(COMING, field.extinction)
    assert added(field=field)[near].sum() == pytest.approx(light[near].sum(), rel=0.03)
    bank = FogBank((0.0, 0.0), (1.0, 0.0), 40.0, 56.0, 1.0, field.extinction)
    in_bank = dataclasses.replace(fog(math.inf), banks=(bank,))
    assert added(field=in_bank)[near].sum() == pytest.approx(light[near].sum(), rel=0.03)


def test_without_sky_or_lamps_nothing_is_changed() -> None:
    seen = road()
    none = RoadBeams(np.zeros((0, 3)), *(np.zeros(0),) * 3, (low_beam(),), np.zeros(0, np.int64), np.zeros(0), SKY)
    for beams in (none, dataclasses.replace(COMING, sky_illuminance=0.0)):
        assert TrafficLight().on(seen, CAMERA, POSE, fog(math.inf), beams) is seen


def test_beams_and_street_lamps_add_up() -> None:
    lamps = StreetLighting(
        np.array([[40.0, 1.0, 8.0]]), 8.0, np.array([0.0, math.pi / 2]), np.full(2, 1000.0), (1.0, 1.0, 1.0), SKY
    )
    air, seen, nobody = Air(fog(math.inf)), road(), LightSources.none()

    def drawn(streets: StreetLighting | None, beams: RoadBeams | None) -> np.ndarray:
        return air.radiance(seen, CAMERA, POSE, Lights((), nobody, streets, beams)).copy()

    apart = drawn(lamps, None) + drawn(None, COMING) - drawn(None, None)
    assert drawn(lamps, COMING) == pytest.approx(apart, rel=1e-4, abs=1e-9)


def test_light_in_tunnels_makes_surfaces_no_whiter() -> None:
    seen = road()
    by_tunnel_lamps = dataclasses.replace(seen, radiance=np.where(seen.radiance > 0.0, np.float32(4.0), seen.radiance))
    lights = Lights((), LightSources.none(), beams=COMING)
    lit = Air(fog(math.inf)).radiance(by_tunnel_lamps, CAMERA, POSE, lights, by_sky=seen)
    np.testing.assert_allclose((lit - by_tunnel_lamps.radiance)[..., 1], added(), rtol=0.0, atol=1e-5)
