from dataclasses import replace

import numpy as np
import pytest

from fogsim.estimators import make
from fogsim.values import Camera, Frame, LeadMeasurement, Observation, Response

SMALL = Camera(320, 240, 288.0, (159.5, 119.5), 1.38, np.radians(2.0))
PAPER = Camera(688, 515, 700.0, (343.5, 257.0), 1.3, np.radians(2.0))
LONG = Camera(800, 400, 1400.0, (399.5, 150.0), 2.1, np.radians(1.0), response=Response.SRGB)


def estimate(image, camera, lead=None, **options):
    measured = None if lead is None else LeadMeasurement(lead, 0.0)
    return make("joint_road", camera, **options).update(Observation(image, lead=measured))


def mispitched(road, seed):
    """A scene whose camera is pitched by 0.1° (one deviation) otherwise than told."""
    pitch = np.random.default_rng(seed).normal(0.0, np.radians(0.1))
    return road.but(camera=replace(road.camera, pitch=road.camera.pitch + pitch))


def errors(render, road, seeds, lead=None):
    found = [estimate(render(mispitched(road, s), s), road.camera, lead) for s in seeds]
    assert all(f.valid for f in found)
    # The judge takes k = 3 / V.
    return np.array([f.extinction * road.visibility / 3.0 - 1.0 for f in found]), found


@pytest.mark.parametrize(("visibility", "median", "worst"), [(30, 3, 8), (300, 3, 8), (1000, 5, 14)])
def test_recovers_visibility_with_a_horizon_that_is_off(render, road, visibility, median, worst):
    error, _ = errors(render, road.but(visibility=visibility, camera=PAPER), range(5))
    assert 100 * np.median(np.abs(error)) < median
    assert 100 * np.abs(error).max() < worst


@pytest.mark.parametrize("visibility", [60, 300])
def test_albedo_that_drifts_costs_little(render, road, visibility):
    error, _ = errors(render, road.but(visibility=visibility, camera=PAPER, drift=0.15), range(6))
    assert 100 * np.median(np.abs(error)) < 10
    assert 100 * np.abs(error).max() < 20


@pytest.mark.parametrize("visibility", [30.0, 80.0])
def test_a_verge_in_place_of_the_neighbouring_lane_is_left_out(render, road, visibility):
    scene = road.but(visibility=visibility, verge=True)
    found = [estimate(render(scene, seed), road.camera).extinction for seed in range(3)]
    assert np.array(found) * visibility / 3.0 == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize(
    ("visibility", "response"),
    [(13.0, Response.LINEAR), (13.0, Response.SRGB), (16.0, Response.GAMMA), (25.0, Response.SRGB)],
)
def test_the_densest_fog_is_not_taken_for_a_ramp(render, road, visibility, response):
    camera = replace(SMALL, response=response)
    found = estimate(render(road.but(visibility=visibility, camera=camera), 3), camera)
    assert found.valid
    assert found.extinction * visibility / 3.0 == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize(
    ("visibility", "paint", "told"), [(50, 170.0, False), (150, 170.0, True), (150, 30.0, False), (400, 30.0, True)]
)
def test_a_lead_vehicle_is_left_out_tracked_or_not(render, road, visibility, paint, told):
    scene = road.but(visibility=visibility, camera=PAPER, lead_distance=25.0, lead_paint=paint)
    error, _ = errors(render, scene, range(3), lead=25.0 if told else None)
    assert 100 * np.median(np.abs(error)) < 8
    assert 100 * np.abs(error).max() < 18


@pytest.mark.parametrize(("camera", "visibility"), [(SMALL, 50), (SMALL, 150), (LONG, 100), (LONG, 500)])
def test_works_with_other_cameras(render, road, camera, visibility):
    error, _ = errors(render, road.but(visibility=visibility, camera=camera), range(3))
    assert np.median(np.abs(error)) < 0.05


@pytest.mark.parametrize(
    ("response", "airlight"),
    [(Response.LINEAR, 120.0), (Response.LINEAR, 255.0), (Response.SRGB, 255.0), (Response.GAMMA, 120.0)],
)
def test_works_at_any_exposure_and_response(render, road, response, airlight):
    gain = airlight / 200.0
    scene = road.but(airlight=airlight, asphalt=60 * gain, mark=150 * gain, terrain=45 * gain)
    error, _ = errors(render, scene.but(camera=replace(road.camera, response=response)), range(2))
    assert np.abs(error).max() < 0.06


def test_intervals_cover_the_truth(render, road):
    inside = []
    for visibility in (40.0, 80.0, 150.0, 300.0, 600.0):
        error, found = errors(render, road.but(visibility=visibility, camera=SMALL), range(8))
        deviation = np.array([f.standard_deviation for f in found]) * visibility / 3.0
        inside += list(np.abs(error) < 1.645 * deviation)
    assert np.mean(inside) > 0.8


@pytest.mark.parametrize("sky", [90.0, 150.0, 245.0])
def test_clear_air_is_never_fog(render, road, sky):
    scene = road.but(visibility=1e9, sky=sky, airlight=sky)
    found = estimate(render(scene), road.camera)
    assert found.valid
    assert found.visibility > 1000


def test_several_frames_average_patches_and_forget_on_reset(render, road):
    scene = road.but(visibility=200.0, camera=SMALL, patch_contrast=0.08)
    estimator = make("joint_road", SMALL, frames=8)
    for seed in range(8):
        last = estimator.update(Observation(render(scene, seed)))
    single = [estimate(render(scene, seed), SMALL).extinction for seed in range(8)]
    assert abs(last.extinction * 200 / 3 - 1) < np.sqrt(np.mean((np.array(single) * 200 / 3 - 1) ** 2)) + 0.01
    estimator.reset()
    again = estimator.update(Observation(render(scene, 7)))
    assert again.extinction == single[7]


def test_diagnostics_say_what_was_found(render, road):
    details = estimate(render(road.but(camera=PAPER)), PAPER).diagnostics
    assert details["airlight"] == pytest.approx(200, abs=2)
    assert details["road"] == pytest.approx(60, abs=4)
    assert details["horizon_row"] == pytest.approx(PAPER.horizon_row, abs=4)
    left, right, top, bottom = details["band"]
    assert 0 <= left < right < 688
    assert PAPER.horizon_row < top < bottom == 514


def test_a_road_as_bright_as_the_airlight_is_refused(render, road):
    found = estimate(render(road.but(asphalt=195.0, terrain=190.0, mark=200.0)), road.camera)
    assert not found.valid
    assert "bright" in str(found.diagnostics["reason"])


@pytest.mark.parametrize(("wall", "foot"), [(5, 300), (90, 400), (180, 300)])
def test_a_wall_across_the_road_is_refused(render, road, wall, foot):
    image = render(road.but(visibility=1e9))
    image[200:foot] = wall
    assert not estimate(image, road.camera).valid


def drive(render, road, densities, period=0.1):
    """Estimates of a drive, an image every period [s], and of each image alone; fog by its k over the road's."""
    moving, drawn = make("joint_road", road.camera), []
    for i, density in enumerate(densities):
        image = render(road.but(visibility=road.visibility / density), i)
        drawn.append((moving.update(Observation(Frame(period * i, image, road.camera))), estimate(image, road.camera)))
    return drawn


def test_hypotheses_that_a_drive_has_ruled_out_change_no_answer(render, road):
    for along, alone in drive(render, road.but(visibility=120.0, camera=SMALL), [1.0] * 12):
        assert along.extinction == pytest.approx(alone.extinction, abs=0.5 * alone.standard_deviation)
        assert along.standard_deviation == pytest.approx(alone.standard_deviation, rel=0.3)


def test_fog_that_thickens_between_full_looks_is_followed_at_once(render, road):
    for along, alone in drive(render, road.but(visibility=200.0, camera=SMALL), [1.0, 1.0, 1.0, 2.0, 2.0]):
        assert along.extinction == pytest.approx(alone.extinction, rel=0.05)
