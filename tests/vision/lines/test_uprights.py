from dataclasses import replace

import numpy as np
import pytest
from flat_road import Road, photograph, scan

from fogsim.values import Camera, Response
from fogsim.vision.light.luminance import linear_pixels
from fogsim.vision.lines.horizon import calibrated_horizon
from fogsim.vision.lines.road_lines import meeting_lines
from fogsim.vision.lines.uprights import lying

STEP = 3


def edge(top, height, column, slope=0.0, noise=0.1, seed=0):
    """Points every third row of a straight edge."""
    rows = np.arange(top, top + height + 1, STEP, dtype=float)
    scatter = np.random.default_rng(seed).normal(0.0, noise, rows.size)
    return np.column_stack((column + slope * (rows - top) + scatter, rows))


def together(*edges):
    """All points by row, and of which edge each is."""
    place = np.concatenate(edges)
    which = np.repeat(np.arange(len(edges)), [len(one) for one in edges])
    order = np.argsort(place[:, 1], kind="stable")
    return place[order], which[order]


@pytest.mark.parametrize("slope", [-4.0, -1.3, -0.5, 0.5, 0.8, 2.0])
def test_sides_of_a_vehicle_are_told_from_lines_beside_it(slope):
    place, which = together(edge(160, 20, 360.0), edge(160, 200, 300.0, slope), edge(160, 20, 440.0))
    assert np.array_equal(lying(place, STEP), which == 1)


@pytest.mark.parametrize("missed", [1, 2])
def test_an_upright_edge_may_miss_rows(missed):
    whole = edge(160, 24, 360.0)
    place = np.delete(whole, np.s_[3 : 3 + missed], axis=0)
    assert not lying(place, STEP).any()


@pytest.mark.parametrize("points", [1, 2])
def test_what_is_too_short_may_lie(points):
    assert lying(edge(160, 20, 360.0)[:points], STEP).all()


def test_no_points_are_none():
    assert lying(np.empty((0, 2)), STEP).shape == (0,)


CAMERAS = (
    Camera(320, 240, 288.0, (159.5, 119.5), 1.38, np.radians(2.0), response=Response.GAMMA),
    Camera(800, 400, 1400.0, (399.5, 150.0), 2.1, np.radians(1.0), response=Response.SRGB),
)


@pytest.mark.parametrize("paint", [30.0, 170.0])
@pytest.mark.parametrize("told", CAMERAS, ids=lambda camera: f"{camera.width}")
def test_a_vehicle_ahead_moves_no_horizon(told, paint):
    """Its sides and a dash of its lane's line once made a line: 1 to 5 px off, and surer than that."""
    rng, errors = np.random.default_rng(5), []
    for seed in range(5):
        true = replace(told, pitch=told.pitch + np.radians(rng.normal(0.0, 0.1)))
        road = Road(camera=true, lead_distance=25.0, lead_paint=paint)
        drawing = scan(road, seed, 2)
        for visibility in (30.0, 60.0, 170.0, 400.0):
            image = photograph(road.but(visibility=visibility), drawing, seed)
            point = meeting_lines(linear_pixels(image, told), told, calibrated_horizon(told))
            if point is not None:
                errors.append(abs(point.row - true.horizon_row))
    assert len(errors) >= 8
    assert max(errors) < 0.8
    assert np.median(errors) < 0.1
