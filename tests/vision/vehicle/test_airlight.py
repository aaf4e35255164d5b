import numpy as np
import pytest

from fogsim.values import Camera, Response
from fogsim.vision.light.daylight import CannotTellError
from fogsim.vision.vehicle.airlight import check_road, hidden_at_side, neighbouring_airlight, road_before, road_fall

NOISE = 2.0
CAMERA = Camera(688, 515, 700.0, (343.5, 257.0), 1.3, np.radians(1.0), response=Response.LINEAR)


def sky(light=180.0, seed=0):
    return np.random.default_rng(seed).normal(light, NOISE, (60, 600)).astype(np.float32)


@pytest.mark.parametrize("about", [179.0, 180.0, 181.5])
def test_the_light_of_an_even_sky_whatever_it_was_thought_to_be(about):
    errors = [neighbouring_airlight(sky(seed=s), about, NOISE, 300.0, 30.0) / 180.0 - 1 for s in range(10)]
    assert np.abs(errors).max() < 5e-4


def test_neither_trees_nor_branches_everywhere_nor_a_high_vehicle_are_sky():
    light = sky()
    light[:, :400] -= 1.0  # in dense fog
    assert neighbouring_airlight(light, 180.0, NOISE, 300.0, 30.0) == pytest.approx(180.0, rel=5e-4)
    light[:, :400] -= 60.0 * (np.random.default_rng(1).random((60, 400)) < 0.8)  # in thin fog
    assert neighbouring_airlight(light, 180.0, NOISE, 300.0, 30.0) == pytest.approx(180.0, rel=1e-3)
    light = sky()
    light[np.random.default_rng(1).random(light.shape) < 0.8] -= 60.0
    assert neighbouring_airlight(light, 180.0, NOISE, 300.0, 30.0) == pytest.approx(180.0, rel=1e-3)
    light = sky()
    light[:, 270:330] += 5.0
    assert neighbouring_airlight(light, 180.0, NOISE, 300.0, 30.0) == pytest.approx(180.0, rel=5e-4)
    # Without any of that light it is what it was supposed to be.
    assert neighbouring_airlight(sky(90.0), 180.0, NOISE, 300.0, 30.0) == 180.0


@pytest.mark.parametrize(("extinction", "reflectance"), [(0.003, 0.05), (0.03, 0.5), (0.1, 0.05)])
def test_the_roads_contrast_falls_as_fog_has_it(extinction, reflectance):
    def row(beam):
        def luminance_of(rows, cols):
            d = CAMERA.row_distance / (np.arange(CAMERA.height)[rows] - CAMERA.horizon_row)
            light = reflectance * (1.0 + beam * (6.0 / d) ** 2)
            seen = 200.0 * (1.0 - (1.0 - light) * np.exp(-extinction * d))
            return np.repeat(seen[:, None], cols.stop - cols.start, axis=1).astype(np.float32)

        return road_fall(luminance_of, CAMERA, 40.0, 200.0)

    day, lit = row(0.0), row(0.8)
    assert -day.rise(0.0) == pytest.approx(extinction * np.ptp(day.way), rel=0.03)
    assert not day.is_lit(extinction, 0.0)
    assert not day.is_lit(1.1 * extinction, 0.0)
    assert lit.rise(0.0) > day.rise(0.0)
    assert lit.is_lit(extinction, 0.0) == (reflectance == 0.5)
    assert row(4.0).rise(0.0) > lit.rise(0.0)


@pytest.mark.parametrize("extinction", [0.01, 0.06])
def test_before_airlight_that_darkens_downward_a_road_by_day_is_not_lit(extinction):
    share = 1.0 - 0.5 * np.clip(np.arange(CAMERA.height) - CAMERA.horizon_row, 0.0, 200.0) / 200.0

    def luminance_of(rows, cols):
        d = CAMERA.row_distance / (np.arange(CAMERA.height)[rows] - CAMERA.horizon_row)
        seen = 200.0 * (share[rows] - (share[rows] - 0.25) * np.exp(-extinction * d)) / share[rows]
        return np.repeat(seen[:, None], cols.stop - cols.start, axis=1).astype(np.float32)

    found = road_fall(luminance_of, CAMERA, 40.0, 200.0, share)
    assert not found.is_lit(extinction, 0.0)
    assert found.is_lit(3.0 * extinction, 0.0)
    assert road_fall(luminance_of, CAMERA, 40.0, 200.0).is_lit(extinction, 0.0)


def test_where_little_road_is_seen_nothing_is_lit():
    for depth, light in ((10.0, 50.0), (60.0, 200.0), (60.0, 250.0)):
        even = np.full((CAMERA.height, CAMERA.width), light, np.float32)
        found = road_fall(lambda *where, even=even: even[where], CAMERA, depth, 200.0)
        assert not found.way.size
        assert not found.is_lit(1.0, 0.0)


@pytest.mark.parametrize("depth", [8.0, 30.0, 200.0])
def test_the_road_before_a_vehicle_ends_below_its_foot(depth):
    rows, cols = road_before(CAMERA, depth)
    assert rows.start >= CAMERA.horizon_row + CAMERA.row_distance / depth
    assert rows.stop == CAMERA.height
    assert cols.start + cols.stop - 1 == pytest.approx(2 * CAMERA.principal_point[0], abs=1.0)


def test_a_road_brighter_than_the_sky_is_refused_and_none_is_not():
    check_road(np.full((4, 5), 215.0, np.float32), 200.0)
    check_road(np.zeros((0, 5), np.float32), 200.0)
    with pytest.raises(CannotTellError, match="brighter than the sky"):
        check_road(np.full((4, 5), 225.0, np.float32), 200.0)
    assert hidden_at_side(700.0, 20.0) == pytest.approx(2.0 * hidden_at_side(700.0, 40.0))
    assert hidden_at_side(700.0, np.inf) == 0.0
