"""negru2013's vanishing point, as published: Hough's transform along the gradient and the consensus of pairs."""

import math

import numpy as np
import pytest
from stripes import CENTRE, ROW, road_lines

from fogsim.values import Camera
from fogsim.vision.light.luminance import linear_pixels
from fogsim.vision.lines.edges import CannyDeriche
from fogsim.vision.lines.horizon import Horizon
from fogsim.vision.lines.road_lines import road_vanishing_point
from fogsim.vision.lines.vanishing_point import consensus_vanishing_point, edge_points, hough_peaks


def found(image, guess=(325.0, 64.0)):
    edges = CannyDeriche()(image, None)
    return consensus_vanishing_point(edges.gradient, edges.pixels, guess, 40.0)


def test_the_published_recipe_is_right_within_its_cells():
    """Cells of 1° and 2 px: several pixels."""
    points = [found(road_lines(seed=seed)) for seed in range(6)]
    assert np.abs([point.row - ROW for point in points]).max() < 15.0
    assert np.abs([point.column - CENTRE for point in points]).max() < 15.0
    assert all(point.lines >= 2 and point.row_deviation >= 1.0 and point.support >= 60 for point in points)


def test_the_published_recipe_is_coarser_than_the_road_s_own_lines():
    camera, horizon, errors = Camera(640, 300, 600.0, (325.0, 64.0), 1.4), Horizon(64.0, 1.5), []
    for seed in range(6):
        image = road_lines(seed=seed)
        pixels = linear_pixels(np.clip(np.rint(image), 0, 255).astype(np.uint8), camera)
        fine = road_vanishing_point(pixels, camera, horizon)
        errors.append((abs(fine.row - ROW), abs(found(image).row - ROW)))
    ours, published = np.mean(errors, axis=0)
    assert ours < published


def test_the_same_image_has_the_same_point():
    image = road_lines()
    assert found(image) == found(image.copy())


@pytest.mark.parametrize("image", [np.full((300, 640), 90.0, np.float32), road_lines((1.75, 2.9))[:, :330]])
def test_fewer_than_two_lines_have_none(image):
    assert found(np.ascontiguousarray(image)) is None


def test_parallel_lines_have_none():
    image = np.full((300, 640), 60.0, np.float32)
    for left in (200, 300, 400):
        image[:, left : left + 20] = 120.0
    guess = (310.0, 20.0)
    edges = CannyDeriche()(image, None)
    points = edge_points(edges.gradient.across, edges.gradient.down, edges.pixels, *guess)
    assert hough_peaks(points, 150.0, 6, 30)[0][:, 0] % math.pi == pytest.approx([0.0] * 6, abs=1e-9)
    assert consensus_vanishing_point(edges.gradient, edges.pixels, guess, 150.0) is None


@pytest.mark.parametrize("slope", [-0.8, 0.0, 0.5])
def test_an_edge_is_a_line_with_the_direction_of_its_gradient(slope):
    """cos θ (u − slope · v) = ρ with tan θ = −slope."""
    v, u = np.mgrid[:200, :200]
    image = np.clip(60.0 + 60.0 * (u - 100.3 - slope * (v - 100)), 60.0, 120.0).astype(np.float32)
    edges = CannyDeriche()(image, None)
    points = edge_points(edges.gradient.across, edges.gradient.down, edges.pixels, 100.0, 0.0)
    assert np.median(points[:, 0] - slope * (points[:, 1] - 100.0)) == pytest.approx(0.8, abs=0.1)
    assert np.median(points[:, 2]) == pytest.approx(math.atan(-slope), abs=0.02)
    lines, votes = hough_peaks(points, 120.0, 1, 30)
    angle, offset = lines[0]
    assert math.remainder(angle - math.atan(-slope), 2.0 * math.pi) == pytest.approx(0.0, abs=math.radians(1.5))
    assert offset == pytest.approx(math.cos(angle) * (0.8 - 100.0 * slope), abs=3.0)
    assert 30 <= votes[0] <= len(points)
