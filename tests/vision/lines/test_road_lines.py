from dataclasses import replace

import numpy as np
import pytest
from flat_road import Road, photograph, scan
from stripes import CENTRE, ROW, road_lines

from fogsim.estimators import make
from fogsim.values import Camera, Observation, Response
from fogsim.vision.light.luminance import linear_pixels
from fogsim.vision.lines.horizon import Horizon, calibrated_horizon
from fogsim.vision.lines.road_line_kernels import Points, RoadLines, fit_road_lines, hough_road_lines, refitted_lines
from fogsim.vision.lines.road_lines import road_vanishing_point, seen_horizon


def found(image, guess=(325.0, 64.0), deviation=1.5):
    camera = Camera(640, 300, 600.0, guess, 1.4)
    pixels = np.clip(np.rint(image), 0, 255).astype(np.uint8)
    return road_vanishing_point(linear_pixels(pixels, camera), camera, Horizon(guess[1], deviation))


def test_clutter_is_outvoted():
    image = road_lines(offsets=(-5.3, -5.1, -1.9, -1.75, 1.75, 1.9))
    rng = np.random.default_rng(3)
    for _ in range(12):
        u, v = rng.integers(20, 580), rng.integers(120, 270)
        image[v : v + 18, u : u + 30] = rng.uniform(30, 200)
    assert found(image).row == pytest.approx(ROW, abs=1.5)


def test_a_plain_image_one_faint_line_and_lines_far_from_the_supposed_horizon_have_no_point():
    assert found(np.full((300, 640), 90.0, np.float32)) is None
    assert found(road_lines(offsets=(1.75, 1.76), contrast=3.0)) is None
    assert found(road_lines(), guess=(325.0, 90.0), deviation=1.0) is None


@pytest.mark.parametrize("method", ["joint_road", "zhu2015", "negru2013", "huang2015_rough"])
def test_lines_that_meet_far_from_the_stated_horizon_say_what_the_pitch_is(method):
    road = Road(visibility=150.0)
    image = photograph(road, scan(road, 0, 2), 0)
    for pitch in (1.0, 3.0):
        stated = replace(road.camera, pitch=np.radians(pitch))
        reason = make(method, stated).update(Observation(image)).diagnostics["reason"]
        assert reason.startswith(f"the road's lines meet at a pitch of 2.0°, not of {pitch}°: correct it")
    # Edges of a vehicle or a kerb, all to one side, meet anywhere.
    pixels = np.clip(np.rint(road_lines((1.2, 1.35, 1.75, 1.9, 2.5, 2.65))), 0, 255).astype(np.uint8)
    camera = Camera(640, 300, 600.0, (325.0, 64.0 - 10.0), 1.4)
    assert seen_horizon(linear_pixels(pixels, camera), camera, Horizon(54.0, 1.0)) == (Horizon(54.0, 1.0), None)


@pytest.mark.parametrize("offsets", [(-1.9, -1.75, 1.75, 1.9), (-5.4, -5.2, 1.7, 1.85), (-0.9, -0.75, 2.6, 2.75)])
def test_sub_pixel_lines_meet_within_a_third_of_a_pixel_and_the_row_is_not_biased(offsets):
    # Narrow marks, wide ones and unlike sides: what blurs the edges must not move the point up or down.
    points = [found(road_lines(offsets, seed=seed)) for seed in range(4)]
    rows, cols = np.array([(p.row, p.column) for p in points]).T
    assert abs(rows.mean() - ROW) < 0.15
    assert np.median(np.abs(rows - ROW)) < 0.3
    assert max(np.abs(rows - ROW).max(), np.abs(cols - CENTRE).max()) < 1.0
    assert all(p.row_deviation < 1.0 and p.lines >= 2 for p in points)


def test_a_bend_moves_the_column_not_the_row():
    image = road_lines()
    v = np.arange(300)
    shift = np.rint(np.where(v > ROW + 4, 240.0 / np.maximum(v - ROW, 4.0), 0.0)).astype(int)
    bent = np.stack([np.roll(line, move) for line, move in zip(image, shift, strict=True)])
    assert found(bent).row == pytest.approx(ROW, abs=0.6)


CAMERAS = (
    Camera(320, 240, 288.0, (159.5, 119.5), 1.38, np.radians(2.0), response=Response.GAMMA),
    Camera(800, 400, 1400.0, (399.5, 150.0), 2.1, np.radians(1.0), response=Response.SRGB),
)


@pytest.mark.parametrize(("told", "paint"), [(CAMERAS[0], 30.0), (CAMERAS[1], 170.0)], ids=["320", "800"])
def test_a_vehicle_ahead_moves_no_horizon(told, paint):
    """Its sides and a dash of its lane's line once made a line: 1 to 5 px off, and surer than that."""
    rng, errors = np.random.default_rng(5), []
    for seed in range(3):
        true = replace(told, pitch=told.pitch + np.radians(rng.normal(0.0, 0.1)))
        road = Road(camera=true, lead_distance=25.0, lead_paint=paint)
        drawing = scan(road, seed, 2)
        for visibility in (30.0, 60.0, 170.0, 400.0):
            image = photograph(road.but(visibility=visibility), drawing, seed)
            point = road_vanishing_point(linear_pixels(image, told), told, calibrated_horizon(told))
            if point is not None:
                errors.append(abs(point.row - true.horizon_row))
    assert len(errors) >= 8
    assert max(errors) < 0.8
    assert np.median(errors) < 0.1


SLOPES = np.array([-4.0, -1.5, 1.25, 3.5])


def points_on(column=0.0, row=0.0, bend=0.0):
    """Points without noise, by row, on lines that meet in a point: every slope has its own kind but the last."""
    below = np.repeat(np.arange(15.0, 215.0, 2.0), SLOPES.size)
    slope, kind = (np.tile(part, below.size // SLOPES.size) for part in (SLOPES, np.array([0, 1, 2, 2])))
    return Points(column + slope * (below - row) + bend / (below - row), below, kind.astype(np.int64))


def test_lines_of_exact_points_are_found_exactly():
    points = points_on(column=2.0, row=3.0)
    offsets, slopes = np.linspace(-40.0, 40.0, 25), np.linspace(-6.5, 6.5, 373)
    found = hough_road_lines(points, offsets, slopes, 12, 12)
    lines = refitted_lines(points, found, 4.0)
    order = np.argsort(lines.slope)
    assert lines.slope[order] == pytest.approx(SLOPES, abs=1e-9)
    assert lines.offset[order] == pytest.approx(2.0 - 3.0 * SLOPES, abs=1e-7)
    assert lines.kind[order].tolist() == [0, 1, 2, 2]
    assert (lines.points == 100.0).all()


@pytest.mark.parametrize("bend", [0.0, 300.0, -300.0])
def test_the_fit_gives_back_point_and_bend_does_not_move_it(bend):
    points = points_on(column=2.0, row=3.0, bend=bend)
    lines = RoadLines(np.zeros(4), SLOPES + 0.01, np.array([0, 1, 2, 2]), np.full(4, 100.0))
    fit = fit_road_lines(points, lines, 1.0, 2.0, 1e6)
    assert (fit.column, fit.row) == pytest.approx((2.0, 3.0), abs=2e-3)
    assert (fit.lines, fit.points) == (4, 400.0)
    assert fit.span == pytest.approx(7.5, abs=1e-3)


def test_parallel_lines_have_no_span_and_no_points_no_lines():
    rows = np.arange(15.0, 215.0, 2.0)
    points = Points(np.full(rows.size, 7.0), rows, np.zeros(rows.size, np.int64))
    one = RoadLines(np.array([7.0]), np.zeros(1), np.zeros(1, np.int64), np.array([100.0]))
    fit = fit_road_lines(points, one, 7.0, 0.0, 1e3)
    assert (fit.lines, fit.span) == (1, 0.0)
    nothing = Points(np.empty(0), np.empty(0), np.empty(0, np.int64))
    assert hough_road_lines(nothing, np.linspace(-4.0, 4.0, 5), np.linspace(-1.0, 1.0, 5), 12, 10).slope.size == 0
