from dataclasses import replace

import numpy as np
import pytest

from fogsim.estimators import make
from fogsim.values import Camera, Frame, LeadMeasurement, Observation, Response

FULL = Camera(640, 480, 577.0, (319.5, 239.5), 1.38, np.radians(2.0))
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


BRIGHT = {"airlight": 255.0, "asphalt": 76.5, "mark": 191.25, "terrain": 57.375}
DIM = {"airlight": 120.0, "asphalt": 36.0, "mark": 90.0, "terrain": 27.0}
LEAD = {"camera": PAPER, "lead_distance": 25.0}


@pytest.mark.parametrize(
    ("changes", "seeds", "tracked", "median", "worst"),
    [
        *(({"visibility": v, "camera": PAPER}, 3, None, m, w) for v, m, w in ((30, 3, 8), (300, 3, 8), (1000, 5, 14))),
        *(({"visibility": v, "camera": PAPER, "drift": 0.15}, 3, None, 10, 20) for v in (60, 300)),
        ({"visibility": 50, "lead_paint": 170.0, **LEAD}, 2, None, 8, 18),
        ({"visibility": 150, "lead_paint": 170.0, **LEAD}, 2, 25.0, 8, 18),
        ({"visibility": 150, "lead_paint": 30.0, **LEAD}, 2, None, 8, 18),
        ({"visibility": 400, "lead_paint": 30.0, **LEAD}, 2, 25.0, 8, 18),
        *(({"visibility": v, "camera": SMALL}, 3, None, 5, np.inf) for v in (50, 150)),
        *(({"visibility": v, "camera": LONG}, 3, None, 5, np.inf) for v in (100, 500)),
        (DIM, 2, None, 6, 6),
        (BRIGHT, 2, None, 6, 6),
        ({**BRIGHT, "camera": replace(FULL, response=Response.SRGB)}, 2, None, 6, 6),
        ({**DIM, "camera": replace(FULL, response=Response.GAMMA)}, 2, None, 6, 6),
    ],
)
def test_recovers_visibility_with_a_horizon_that_is_off(render, road, changes, seeds, tracked, median, worst):
    """Also where albedo drifts, behind a vehicle, with other cameras, at any exposure and response; bounds [%]."""
    error, _ = errors(render, road.but(**changes), range(seeds), tracked)
    assert 100 * np.median(np.abs(error)) < median
    assert 100 * np.abs(error).max() < worst


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


def test_intervals_cover_the_truth(render, road):
    inside = []
    for visibility in (40.0, 80.0, 150.0, 300.0, 600.0):
        error, found = errors(render, road.but(visibility=visibility, camera=SMALL), range(5))
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
    estimator = make("joint_road", SMALL, frames=5)
    for seed in range(5):
        last = estimator.update(Observation(render(scene, seed)))
    single = [estimate(render(scene, seed), SMALL).extinction for seed in range(5)]
    assert abs(last.extinction * 200 / 3 - 1) < np.sqrt(np.mean((np.array(single) * 200 / 3 - 1) ** 2)) + 0.01
    estimator.reset()
    again = estimator.update(Observation(render(scene, 4)))
    assert again.extinction == single[4]


def test_diagnostics_say_what_was_found(render, road):
    details = estimate(render(road.but(camera=PAPER)), PAPER).diagnostics
    assert details["airlight"] == pytest.approx(200, abs=2)
    assert details["road"] == pytest.approx(60, abs=4)
    assert details["horizon_row"] == pytest.approx(PAPER.horizon_row, abs=4)
    left, right, top, bottom = details["band"]
    assert 0 <= left < right < 688
    assert PAPER.horizon_row < top < bottom == 514


@pytest.mark.parametrize("method", ["joint_road", "negru2013"])
def test_a_road_as_bright_as_the_airlight_is_refused(render, road, method):
    image = render(road.but(asphalt=195.0, terrain=190.0, mark=200.0))
    found = make(method, road.camera).update(Observation(image))
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
    for along, alone in drive(render, road.but(visibility=120.0, camera=SMALL), [1.0] * 8):
        assert along.extinction == pytest.approx(alone.extinction, abs=0.5 * alone.standard_deviation)
        assert along.standard_deviation == pytest.approx(alone.standard_deviation, rel=0.3)


def test_fog_that_thickens_between_full_looks_is_followed_at_once(render, road):
    for along, alone in drive(render, road.but(visibility=200.0, camera=SMALL), [1.0, 1.0, 1.0, 2.0, 2.0]):
        assert along.extinction == pytest.approx(alone.extinction, rel=0.05)
