"""What the road returns of the own head lamps' light: photons, and where it is."""

import math

import numpy as np
import pytest

from fogsim.atmosphere import Air
from fogsim.atmosphere.lamps import road_glow
from fogsim.atmosphere.lamps.halos import Halos
from fogsim.atmosphere.lamps.phase_function import Droplets
from fogsim.lighting.beams import low_beam
from fogsim.values import Camera, CameraPose, FogBank, FogField, HeadLamp, Lights, LightSources
from fogsim.values.light import RoadBeams
from tests.atmosphere.night_scene import empty_view, fog
from tests.atmosphere.tables import read_table

CAMERA = Camera(160, 120, 100.0, (79.5, 79.5), 1.5, 0.0)
POSE = CameraPose((0.0, 0.0, 1.5), 0.0)
LOW = tuple(HeadLamp((1.8, side, -0.85), low_beam()) for side in (0.6, -0.6))


@pytest.mark.parametrize("droplets", [Droplets.HEAVY_ADVECTION, Droplets.MODERATE_RADIATION])
def test_the_sky_over_a_lit_road_is_that_of_photons(droplets):
    rows = read_table("monte_carlo_road.csv")
    for row in rows[(rows["fog"] == droplets) & (rows["error"] < 0.1 * rows["road"])]:
        field, out = fog(float(row["visibility"])), np.zeros((120, 160, 3), np.float32)
        sources = road_glow.RoadGlow().sources(LOW, CAMERA, POSE, field)
        Halos(droplets).add(out, empty_view(CAMERA), CAMERA, POSE, field, sources)
        at = 79.5 - 100.0 * math.tan(math.radians(row["up"]))
        drawn = np.interp(at, np.arange(120), out[:, 79:81, 1].mean(axis=1))
        assert 0.75 < drawn / row["road"] < 1.5


def test_lit_pieces_of_road_lie_ahead_on_it_and_return_its_share():
    turned = CameraPose((100.0, 50.0, 6.5), math.pi / 2)
    sources = road_glow.RoadGlow().sources(LOW, CAMERA, turned, fog(math.inf))
    assert sources.position[:, 2] == pytest.approx(np.full(5, 5.0))
    assert (np.diff(sources.position[:, 1]) > 0).all()
    assert np.abs(sources.position[:, 0] - 100.0).max() < 1.0
    assert sources.lobes is not None
    # A Lambertian surface shines π times its intensity straight up.
    flux = math.pi * 1000.0 * sources.lobes.scale.sum()
    assert 60.0 < flux < 0.95 * road_glow.ROAD_ALBEDO * 2 * 517.0
    dense = road_glow.RoadGlow().sources(LOW, CAMERA, turned, fog(50))
    assert (dense.intensity < sources.intensity).all()


def beams(*places: tuple[float, float]) -> RoadBeams:
    """Pairs of low beams that come."""
    count = len(places)
    return RoadBeams(
        position=np.array([(x, y, 0.65) for x, y in places]),
        heading=np.full(count, math.pi),
        grade=np.zeros(count),
        height=np.full(count, 0.65),
        kinds=(low_beam(),),
        kind=np.zeros(count, np.int64),
        scale=np.full(count, 2.0),
        sky_illuminance=0.1,
    )


def test_the_road_before_others_glows_where_their_lamps_light_it() -> None:
    coming = beams((60.0, 3.5), (200.0, 3.5))
    sources = road_glow.glow_of_beams(coming, POSE, fog(100))
    assert sources.position[:, 0] == pytest.approx([60.0 - 12.0, 200.0 - 12.0], abs=5.0)
    assert sources.position[:, 2] == pytest.approx([0.0, 0.0], abs=1e-9)
    own = road_glow.RoadGlow().sources(LOW, CAMERA, POSE, fog(100)).lobes
    assert sources.lobes is not None
    assert own is not None
    # As much light as before the own lamps.
    assert sources.lobes.scale == pytest.approx(np.full(2, own.scale.sum()), rel=0.02)
    assert (road_glow.glow_of_beams(coming, POSE, fog(20)).intensity < sources.intensity).all()
    many = road_glow.glow_of_beams(beams(*((20.0 * n, 0.0) for n in range(1, 8))), POSE, fog(100))
    assert len(many.intensity) == 2
    assert many.position[:, 0].max() < 40.0


def test_the_lit_road_glows_in_a_bank_as_in_even_fog() -> None:
    even = fog(50)
    bank = FogBank((-5000.0, 0.0), (1.0, 0.0), 0.0, 10000.0, 1.0, even.extinction)
    banked = FogField(0.0, (0.0, 0.0, 0.0), (bank,))
    lit = Lights(LOW, LightSources.none(), beams=beams((60.0, 3.5)))
    one, other = (Air(field).radiance(empty_view(CAMERA), CAMERA, POSE, lit) for field in (even, banked))
    np.testing.assert_allclose(other, one, rtol=1e-3)
