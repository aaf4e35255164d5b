"""Own lamps drawn: light on the road by the formula, the veil without spots, and fog of every kind."""

import dataclasses
import math

import numpy as np
import pytest

from fogsim.atmosphere.air import Air
from fogsim.atmosphere.lamps import lamplight
from fogsim.atmosphere.lamps import veil as veil_module
from fogsim.atmosphere.lamps.halos import Halos
from fogsim.atmosphere.lamps.lamplight import OwnLamplight
from fogsim.atmosphere.lamps.phase_function import Droplets
from fogsim.atmosphere.lamps.road_glow import RoadGlow
from fogsim.errors import InputError
from fogsim.lighting.beams import low_beam, own_head_lamps
from fogsim.values import Beam, FogBank, HeadLamp, Lamp, Lights, LightSources
from fogsim.values.luminous_intensity import luminous_intensity
from tests.atmosphere.night_scene import CAMERA, POSE, RESPONSE, fog, rays, road_view

LOW = own_head_lamps(Lamp.LOW_BEAM, CAMERA.mount_height)


def drawn(field, own=LOW, view=None, pose=POSE, painter=None):
    seen = view or road_view()
    out = np.zeros_like(seen.radiance)
    (painter or OwnLamplight()).add(out, seen, CAMERA, pose, field, own)
    return out


def road_light(extinction):
    """Radiance of the road by the formula, one lamp after the other."""
    seen = np.isfinite(road_view().distance)
    distance = np.where(seen, road_view().distance.astype(float), 1.0)
    place = rays() * distance[..., None]
    total = np.zeros(distance.shape)
    for lamp in LOW:
        forward, left, up = np.moveaxis(place - np.array(lamp.offset), -1, 0)
        s = np.sqrt(forward**2 + left**2 + up**2)
        intensity = luminous_intensity(lamp.beam, np.arctan2(-left, forward), np.arcsin(up / s))
        total += RESPONSE * intensity / s**2 * np.exp(-extinction * (s + distance))
    return np.where(seen, total, 0.0)


def test_clear_air_has_lit_road_and_no_veil():
    out = drawn(fog(math.inf))
    near = (road_view().distance > 4.0) & (road_view().distance < 120.0)
    assert out[near][:, 0] == pytest.approx(road_light(0.0)[near], rel=0.06)
    assert out[~np.isfinite(road_view().distance)].max() == 0.0


def test_road_is_attenuated_both_ways():
    field, painter = fog(50), OwnLamplight()
    lit = drawn(field, painter=painter)
    veil = drawn(field, view=dataclasses.replace(road_view(), lamp_response=None), painter=painter)
    near = (road_view().distance > 4.0) & (road_view().distance < 60.0)
    assert (lit - veil)[near][:, 0] == pytest.approx(road_light(field.extinction)[near], rel=0.06, abs=1e-5)


def test_veil_has_no_spots_and_no_edges(monkeypatch):
    view = dataclasses.replace(road_view(), lamp_response=None)
    veil = drawn(fog(200), view=view)[..., 0]
    monkeypatch.setattr(veil_module, "CELLS", 256)
    # Rays and lamps of a camera are kept.
    monkeypatch.setattr(lamplight, "_rays", lamplight._rays.__wrapped__)
    monkeypatch.setattr(lamplight, "_group", lamplight._group.__wrapped__)
    fine = drawn(fog(200), view=view)[..., 0]
    # Next to a lamp's place, too, the veil is that of rays a quarter as far apart, and has no other steps. In fog of
    # 200 m these reach 12.3 % of the maximum; 40 cells across the image were 6 to 10 % off, with steps 4 % off.
    assert np.abs(veil - fine).max() < 0.05 * fine.max()
    for axis in (0, 1):
        assert np.abs(np.diff(veil, axis=axis) - np.diff(fine, axis=axis)).max() < 0.03 * fine.max()
    assert veil.max() < 40 * veil[58, 80]


def test_veil_hardly_changes_when_fog_hardly_changes():
    painter = OwnLamplight()
    before, after = (drawn(fog(visibility), painter=painter) for visibility in (100.0, 100.1))
    np.testing.assert_allclose(after, before, rtol=5e-3)
    assert np.array_equal(drawn(fog(100.0), painter=painter), before)


def test_uneven_fog_that_is_even_looks_even_and_a_turning_vehicle_sees_the_same():
    field = fog(100)
    bank = FogBank((0.0, 0.0), (1.0, 0.0), 10.0, 40.0, 5.0, 1e-9)
    assert drawn(dataclasses.replace(field, banks=(bank,))) == pytest.approx(drawn(field), rel=0.02, abs=1e-5)
    turned = dataclasses.replace(POSE, heading=1.0)
    assert drawn(fog(100), pose=turned) == pytest.approx(drawn(fog(100)), rel=1e-4, abs=1e-6)


def test_bank_ahead_shines_only_ahead():
    bank = FogBank((0.0, 0.0), (1.0, 0.0), 30.0, 90.0, 4.0, 0.06)
    veil = drawn(dataclasses.replace(fog(math.inf), banks=(bank,)), view=None)
    road, sky = road_view().distance, veil[50, 80, 0]
    before = (road > 4.0) & (road < 25.0)
    assert veil[before][:, 0] == pytest.approx(road_light(0.0)[before], rel=0.06)
    assert 0.0 < sky < drawn(fog(50))[50, 80, 0]


def test_lamps_in_one_housing_and_colours_add():
    red = tuple(dataclasses.replace(lamp, colour=(1.0, 0.2, 0.1)) for lamp in LOW)
    single = drawn(fog(100))
    np.testing.assert_allclose(drawn(fog(100), LOW + LOW), 2 * single, rtol=1e-5)
    np.testing.assert_allclose(drawn(fog(100), LOW + red)[..., 1], 1.2 * single[..., 1], rtol=1e-5)


def test_beam_with_a_hole_is_refused():
    intensity = low_beam().intensity.copy()
    intensity[3, 4] = np.nan
    broken = HeadLamp(LOW[0].offset, Beam(low_beam().azimuth, low_beam().elevation, intensity))
    with pytest.raises(InputError, match=r"row 3, column 4"):
        drawn(fog(100), (broken,))


def test_air_adds_lamplight_to_twilight():
    field = dataclasses.replace(fog(100), airlight=(3.0, 3.0, 3.0))
    air, view = Air(field), road_view()
    lights = Lights(LOW, LightSources.none())
    by_day = air.radiance(view, CAMERA, POSE)
    lit = by_day + drawn(field)
    road = lit.copy()
    Halos().add(road, view, CAMERA, POSE, field, RoadGlow().sources(LOW, CAMERA, POSE, field))
    np.testing.assert_allclose(air.radiance(view, CAMERA, POSE, lights), road, rtol=0.0, atol=2e-6)
    # The road sends back a part of what the lamps themselves add.
    assert 0.005 * drawn(field).sum() < (road - lit).sum() < 0.05 * drawn(field).sum()


def test_preparing_changes_nothing_and_light_in_the_air_is_computed_once_a_process(monkeypatch):
    field, lights = fog(100), Lights(LOW, LightSources.none())
    prepared, fresh = Air(field), Air(field)
    prepared.prepare(CAMERA, [LOW])
    one, other = (air.radiance(road_view(), CAMERA, POSE, lights) for air in (prepared, fresh))
    assert np.array_equal(one, other)
    OwnLamplight().prepare(CAMERA, LOW)
    monkeypatch.setattr(lamplight, "lit_air", lambda *_: pytest.fail("computed anew"))
    OwnLamplight().prepare(CAMERA, LOW)
    with pytest.raises(pytest.fail.Exception, match="anew"):
        OwnLamplight(Droplets.HEAVY_ADVECTION).prepare(CAMERA, LOW)
