import numpy as np
import pytest

from fogsim.vision.light.luminance import linear_pixels
from fogsim.vision.strips.sky import Sky
from fogsim.vision.strips.strip_curves import (
    lowest_road_row,
    mean_curves,
    strip_curves,
    without_clipped,
    without_rows_below,
)
from tests.vision.strips.koschmieder_strips import CAMERA, GEOMETRY

ROWS, COLS = np.indices((480, 640))
SKY = Sky(200.0, 1.0, 1.0, 1.0, 0.0, 0.0)


def photographed(light, noise=1.0):
    grey = np.rint(light + np.random.default_rng(0).normal(0.0, noise, light.shape))
    return linear_pixels(np.clip(grey, 0, 255).astype(np.uint8), CAMERA)


def test_a_strip_has_the_luminance_of_its_rows_and_marks_count_only_as_scatter():
    light = 200.0 - 0.25 * ROWS
    plain = strip_curves(photographed(light), GEOMETRY, 1.0, CAMERA)
    rows = 0.5 * (GEOMETRY.first + GEOMETRY.last)
    off = (plain.luminance - (200.0 - 0.25 * rows)) / np.sqrt(np.where(plain.variance > 0, plain.variance, np.inf))
    assert np.sqrt((off**2).mean()) < 1.2
    marked = strip_curves(photographed(np.where(np.abs(COLS - 322) < 3, 250.0, light)), GEOMETRY, 1.0, CAMERA)
    near = GEOMETRY.distance < 15.0
    assert marked.luminance[0][near] == pytest.approx(plain.luminance[0][near], abs=1.0)
    assert (marked.scatter[0][near] > plain.scatter[0][near] + 1.0).all()


def test_what_a_tracked_vehicle_hides_is_left_out_and_may_be_read_later():
    image = photographed(200.0 - 0.25 * ROWS)
    whole, free = (strip_curves(image, GEOMETRY, 1.0, CAMERA, depth) for depth in (np.inf, 20.0))
    hidden = GEOMETRY.distance > 21.0
    assert not free.variance[0][hidden].any()
    assert (free.variance[0][GEOMETRY.distance < 19.0] > 0).all()
    again = strip_curves(image, GEOMETRY, 1.0, CAMERA, 20.0, whole)
    assert np.array_equal(again.luminance, free.luminance)
    assert np.array_equal(again.variance, free.variance)


def test_frames_are_averaged_at_the_last_ones_exposure():
    curves = strip_curves(photographed(np.full(ROWS.shape, 100.0)), GEOMETRY, 1.0, CAMERA)
    darker = curves._replace(luminance=0.5 * curves.luminance, variance=0.25 * curves.variance)
    mean = mean_curves(((darker, SKY._replace(luminance=100.0)), (curves, SKY)))
    assert mean.luminance == pytest.approx(np.where(curves.variance > 0, curves.luminance, 0.0))
    assert mean.variance == pytest.approx(0.5 * curves.variance)
    assert mean_curves(((curves, SKY),)) is curves


def test_clipped_bins_and_rows_below_the_last_of_the_road_are_left_out():
    curves = strip_curves(photographed(250.0 - 0.1 * (480.0 - ROWS)), GEOMETRY, 1.0, CAMERA)
    assert not without_clipped(curves).variance[curves.luminance > 0.95 * 255.0].any()
    kept = without_rows_below(curves, GEOMETRY, 400)
    assert not kept.variance[:, GEOMETRY.last > 400].any()
    assert np.array_equal(kept.variance[:, GEOMETRY.last <= 400], curves.variance[:, GEOMETRY.last <= 400])


@pytest.mark.parametrize("edge", [430, 460])
def test_the_road_ends_at_the_bonnets_edge(edge):
    road = 200.0 - 0.25 * ROWS
    image = photographed(np.where(edge <= ROWS, 20.0, road))
    assert edge - 12 <= lowest_road_row(image, CAMERA, 200.0) < edge
    assert lowest_road_row(photographed(road), CAMERA, 200.0) == 479
