import numpy as np
import pytest
from stripes import CENTRE, ROW, road_lines

from fogsim.values import Camera
from fogsim.vision.light.luminance import linear_pixels
from fogsim.vision.lines.canny_deriche import CannyDeriche
from fogsim.vision.lines.horizon import Horizon
from fogsim.vision.lines.road_lines import meeting_lines
from fogsim.vision.lines.vanishing import vanishing_point


def published(image, guess=(325.0, 64.0)):
    edges = CannyDeriche()(image, None)
    return vanishing_point(edges.gradient, edges.pixels, guess, 40.0)


def found(image, guess=(325.0, 64.0), deviation=1.5):
    camera = Camera(640, 300, 600.0, guess, 1.4)
    pixels = np.clip(np.rint(image), 0, 255).astype(np.uint8)
    return meeting_lines(linear_pixels(pixels, camera), camera, Horizon(guess[1], deviation))


def test_sub_pixel_lines_meet_within_a_third_of_a_pixel():
    points = [found(road_lines(seed=seed)) for seed in range(6)]
    rows, cols = np.array([p.row for p in points]), np.array([p.column for p in points])
    assert np.median(np.abs(rows - ROW)) < 0.3
    assert np.abs(rows - ROW).max() < 1.0
    assert np.abs(cols - CENTRE).max() < 1.0
    assert all(p.row_deviation < 1.0 and p.lines >= 2 for p in points)


def test_published_recipe_is_coarser():
    rows = np.array([published(road_lines(seed=seed)).row for seed in range(6)])
    assert np.abs(rows - ROW).max() < 15.0
    fine = np.array([found(road_lines(seed=seed)).row for seed in range(6)])
    assert np.abs(fine - ROW).mean() < np.abs(rows - ROW).mean()


def test_clutter_is_outvoted():
    image = road_lines(offsets=(-5.3, -5.1, -1.9, -1.75, 1.75, 1.9))
    rng = np.random.default_rng(3)
    for _ in range(12):
        u, v = rng.integers(20, 580), rng.integers(120, 270)
        image[v : v + 18, u : u + 30] = rng.uniform(30, 200)
    point = found(image)
    assert point.row == pytest.approx(ROW, abs=1.5)


def test_mirrored_lines_meet_in_the_mirrored_point():
    image = road_lines()
    point, mirrored = found(image), found(np.ascontiguousarray(image[:, ::-1]), guess=(639 - 325.0, 64.0))
    assert mirrored.row == pytest.approx(point.row, abs=0.1)
    assert mirrored.column == pytest.approx(639 - point.column, abs=0.1)


@pytest.mark.parametrize("offsets", [(1.75, 1.76)])
def test_one_faint_line_is_no_point(offsets):
    assert found(road_lines(offsets=offsets, contrast=3.0)) is None


def test_a_plain_image_has_none():
    assert found(np.full((300, 640), 90.0, np.float32)) is None


@pytest.mark.parametrize("offsets", [(-1.9, -1.75, 1.75, 1.9), (-5.4, -5.2, 1.7, 1.85), (-0.9, -0.75, 2.6, 2.75)])
def test_the_row_is_not_biased(offsets):
    # Narrow marks, wide ones and unlike sides: what blurs the edges must not move the point up or down.
    rows = np.array([found(road_lines(offsets, seed=seed)).row for seed in range(5)])
    assert abs(rows.mean() - ROW) < 0.15


def test_a_bend_moves_the_column_not_the_row():
    image = road_lines()
    v = np.arange(300)
    shift = np.rint(np.where(v > ROW + 4, 240.0 / np.maximum(v - ROW, 4.0), 0.0)).astype(int)
    bent = np.stack([np.roll(line, move) for line, move in zip(image, shift, strict=True)])
    assert found(bent).row == pytest.approx(ROW, abs=0.6)


def test_a_point_far_from_the_told_horizon_is_none():
    assert found(road_lines(), guess=(325.0, 90.0), deviation=1.0) is None
