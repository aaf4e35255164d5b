"""Strips that follow a bent and curved road, and what an unsure course leaves unsure of the extinction."""

import math
from dataclasses import replace

import numpy as np
import pytest

from fogsim.values import Camera
from fogsim.vision.lines.horizon import Horizon
from fogsim.vision.lines.road_course import RoadCourse, unseen_course
from fogsim.vision.lines.road_course_kernels import PIECES
from fogsim.vision.strips.course_geometry import course_deviation, course_geometry
from fogsim.vision.strips.joint_fit import JointFit
from fogsim.vision.strips.joint_kernels import JointPrior
from fogsim.vision.strips.strip_geometry import strip_geometry

CAMERA = Camera(640, 480, 577.0, (319.5, 239.5), 1.38, math.radians(2.0))
STRAIGHT = strip_geometry(CAMERA, 1.0)
KNOWN = np.zeros((1 + PIECES, 1 + PIECES))
LEVEL = replace(unseen_course(CAMERA, Horizon(CAMERA.horizon_row, 0.3)), covariance=KNOWN, lines=4)
PRIOR = JointPrior(200.0, 1.0, 1.0, 0.0, 0.3, 0.0, 0.1)


def fit_of(extinction: float) -> JointFit:
    used = np.ones(STRAIGHT.path.shape, bool)
    return JointFit(extinction, 0.0, 200.0, 0.0, 60.0, 1.0, used, np.zeros(STRAIGHT.first.size, bool))


def deviation(extinction: float, course: RoadCourse) -> float:
    return course_deviation(fit_of(extinction), STRAIGHT, CAMERA, course, PRIOR, 1.0) / extinction


def test_along_a_straight_and_level_course_strips_are_those_of_a_plane():
    laid = course_geometry(STRAIGHT, CAMERA, LEVEL)
    clear = STRAIGHT.below > 2.0
    for name in ("below", "half", "distance", "extent"):
        assert getattr(laid, name)[clear] == pytest.approx(getattr(STRAIGHT, name)[clear], rel=1e-6)
    for name in ("left", "right", "path"):
        assert getattr(laid, name)[:, clear] == pytest.approx(getattr(STRAIGHT, name)[:, clear], rel=1e-3, abs=0.05)


@pytest.mark.parametrize("sag", [1.0 / 8800.0, -1.0 / 13_000.0])
def test_rows_of_a_sag_are_nearer_and_of_a_crest_farther(sag):
    laid = course_geometry(STRAIGHT, CAMERA, replace(LEVEL, sag=np.full(PIECES, sag)))
    row = int(np.argmin(np.abs(STRAIGHT.distance - 80.0)))
    distance = float(laid.distance[row])
    below = CAMERA.row_distance / distance * (1.0 - 0.5 * sag * distance**2 / CAMERA.mount_height)
    assert STRAIGHT.below[row] == pytest.approx(below, rel=1e-6)
    assert (distance < STRAIGHT.distance[row]) == (sag > 0)


def test_strips_shift_with_a_bend_to_the_right_and_where_it_is_unsure_nothing_is_read():
    laid = course_geometry(STRAIGHT, CAMERA, replace(LEVEL, bend=np.full(PIECES, 1.0 / 400.0)))
    row = int(np.argmin(np.abs(STRAIGHT.distance - 60.0)))
    shift = CAMERA.focal_length * 0.5 * STRAIGHT.distance[row] / 400.0
    assert laid.left[0, row] - STRAIGHT.left[0, row] == pytest.approx(shift, rel=1e-2)
    unsure = replace(LEVEL, bend=np.full(PIECES, 1e-3), bend_covariance=np.full((PIECES, PIECES), (5e-4) ** 2))
    laid = course_geometry(STRAIGHT, CAMERA, unsure)
    width = (laid.right - laid.left)[0]
    # 0.6 m = 5e-4 s² / 2 at s = 49 m.
    assert (width[laid.distance < 48.0] > 0).all()
    assert (width[laid.distance > 50.0] == 0).all()


def test_what_is_not_known_of_the_course_matters_the_more_the_thinner_the_fog_and_what_is_known_not():
    unseen = unseen_course(CAMERA, Horizon(CAMERA.horizon_row, 0.3))
    dense, medium, thin = (deviation(3.0 / visibility, unseen) for visibility in (30.0, 100.0, 300.0))
    assert dense < 0.02
    assert dense < medium < thin
    known = replace(LEVEL, covariance=np.diag([0.09, *np.full(PIECES, 1e-24)]))
    assert deviation(0.02, known) < 1e-6
