"""Bends, sags and crests of drawn roads, as their lines show them."""

import math
from dataclasses import replace

import numpy as np
import pytest
from flat_road import Road, photograph, scan

from fogsim.values import Camera
from fogsim.vision.light.luminance import linear_pixels
from fogsim.vision.lines.horizon import calibrated_horizon
from fogsim.vision.lines.road_course import RoadCourse, road_course
from fogsim.vision.lines.road_course_kernels import KNOTS, row_on_plane, turned
from fogsim.vision.lines.road_lines import seen_lines

CAMERA = Camera(640, 480, 577.0, (319.5, 239.5), 1.38, math.radians(2.0))
SAG, CREST = 1.0 / 8800.0, -1.0 / 13_000.0


def course_of(road: Road, seed: int) -> RoadCourse | None:
    image = linear_pixels(photograph(road, scan(road, seed, 3), seed), CAMERA)
    horizon = calibrated_horizon(CAMERA)
    seen = seen_lines(image, CAMERA, horizon)
    return None if seen is None else road_course(seen, image, CAMERA, horizon)


def pitched(pitch_deg: float, **road) -> Road:
    return Road(camera=replace(CAMERA, pitch=CAMERA.pitch + math.radians(pitch_deg)), **road)


@pytest.mark.parametrize(("sag", "seed"), [(SAG, 0), (CREST, 1), (1.0 / 4000.0, 2)])
def test_a_sag_and_a_crest_are_found_within_their_deviation_whatever_the_pitch(sag, seed):
    road = pitched((-0.1, 0.0, 0.06, 0.12)[seed], visibility=200.0, sag=sag)
    course = course_of(road, seed)
    assert course.sag[0] == pytest.approx(sag, abs=3.0 * course.sag_deviation[0])
    assert course.sag_deviation[0] < 0.25 * abs(sag)
    assert course.row == pytest.approx(road.camera.horizon_row, abs=3.0 * course.horizon.standard_deviation + 0.1)
    assert not course.bend.any()


@pytest.mark.parametrize("bend", [1.0 / 400.0, -1.0 / 400.0, 1.0 / 800.0])
def test_a_bend_is_found_and_its_sign_is_positive_to_the_right(bend):
    course = course_of(pitched(0.05, visibility=150.0, bend=bend), 3)
    deviation = math.sqrt(course.bend_covariance[0, 0])
    assert course.bend[0] == pytest.approx(-bend, abs=3.0 * deviation)
    assert deviation < 0.2 * abs(bend)
    assert not course.sag.any()


@pytest.mark.parametrize(("visibility", "seed"), [(60.0, 0), (200.0, 1), (600.0, 2)])
def test_a_straight_and_level_road_is_straight_and_level(visibility, seed):
    course = course_of(pitched((-0.1, 0.0, 0.06, 0.12)[seed], visibility=visibility), seed)
    assert course.is_straight
    assert (course.sag_deviation > 0).all()


def test_the_farther_lines_are_seen_the_surer_is_the_course():
    near, far = (course_of(pitched(0.0, visibility=visibility), 1).sag_deviation for visibility in (60.0, 600.0))
    assert far[1] < 0.5 * near[1]
    assert far[2] < 0.6 * near[2]


def test_without_lines_or_where_they_meet_too_far_from_the_supposed_horizon_there_is_no_course():
    assert course_of(pitched(0.0, marks=False), 1) is None
    assert course_of(pitched(1.0, visibility=200.0), 1) is None


def test_a_vehicle_ahead_is_no_bend():
    for seed in range(3):
        course = course_of(pitched(0.0, visibility=200.0, lead_distance=25.0), seed)
        assert course is None or course.is_straight


def test_rows_on_a_plane_are_those_of_rays_on_the_curve_and_none_shows_road_behind_a_crest():
    unit, height, sag = 800.0, 1.4, np.array([1e-4, 2e-4, 0.0, -1e-4, 0.0, 1e-5])
    for distance in (20.0, 60.0, 110.0, 150.0):
        rise = sum(c * turned(distance, piece)[0] for piece, c in enumerate(sag))
        below = unit / distance * (1.0 - rise / height)
        row, change = row_on_plane(below, sag, unit, height, below)
        assert row == pytest.approx(unit / distance, rel=1e-5)
        nearby, _ = row_on_plane(below + 1e-3, sag, unit, height, below)
        assert (nearby - row) / 1e-3 == pytest.approx(change, rel=1e-3)
    crest = np.full(len(KNOTS) - 1, -1.0 / 2000.0)
    # It hides what lies beyond √(2 h R) = 75 m, which is seen 2 h / 75 m below the tangent's horizon.
    limit = 2.0 * 1.4 / math.sqrt(2.0 * 1.4 * 2000.0)
    unit = 800.0 * 1.4
    assert row_on_plane(800.0 * 1.3 * limit, crest, unit, 1.4, 800.0 * 1.3 * limit)[0] > 0.0
    assert row_on_plane(800.0 * 0.95 * limit, crest, unit, 1.4, 800.0 * limit)[0] == 0.0


def test_edges_on_the_very_row_of_the_horizon_are_no_points_of_the_road():
    # An image of noise, whose edges lie on all rows, the horizon's among them.
    image = (255 * (np.random.default_rng(6).random((120, 160)) > 0.9)).astype(np.uint8)
    camera = Camera(160, 120, 100.0, (80.0, 58.0), 1.4)
    pixels, horizon = linear_pixels(image, camera), calibrated_horizon(camera)
    seen = seen_lines(pixels, camera, horizon)
    assert seen is not None
    assert road_course(seen, pixels, camera, horizon) is None
