"""A vehicle that no sensor reports, drawn by hand on a grey road in fog: the day model leaves it out."""

import math

import numpy as np
import pytest

from fogsim.units import extinction_from_visibility
from fogsim.values import Camera
from fogsim.values.camera import Response
from fogsim.vision.day.day_fit import fit_day
from fogsim.vision.day.row_data import free_depth, row_bins
from fogsim.vision.lines.horizon import Horizon

CAMERA = Camera(512, 384, 400.0, (255.5, 160.0), 1.3, response=Response.LINEAR)
HORIZON = Horizon(160.0, 0.7)


def picture(visibility: float, depth: float = math.inf, aside: float = 0.0) -> np.ndarray:
    """A dark vehicle of 1.8 × 1.5 m at a depth, in fog of a visibility."""
    rows, columns = np.mgrid[: CAMERA.height, : CAMERA.width].astype(float)
    below = rows - HORIZON.row
    distance = np.where(below > 0, CAMERA.row_distance / np.maximum(below, 1e-6), math.inf)
    scene = np.full(distance.shape, 0.3)
    if depth < math.inf:
        right = (columns - CAMERA.principal_point[0]) * depth / CAMERA.focal_length - aside
        height = CAMERA.mount_height - below * depth / CAMERA.focal_length
        vehicle = (abs(right) < 0.9) & (height > 0.0) & (height < 1.5)
        scene, distance = np.where(vehicle, 0.05, scene), np.where(vehicle, depth, distance)
    clear = np.exp(-extinction_from_visibility(visibility) * distance)
    noise = np.random.default_rng(1).normal(0.0, 0.8, distance.shape)
    return np.rint(200.0 * (scene * clear + 1.0 - clear) + noise).clip(0, 255).astype(np.uint8)


def free(image: np.ndarray) -> float:
    bins = row_bins(CAMERA, HORIZON.standard_deviation, round(HORIZON.row))
    return free_depth(image[:, :, None], bins, CAMERA, HORIZON.row)


@pytest.mark.parametrize("visibility", [50.0, 100.0, 300.0])
@pytest.mark.parametrize("share", [0.25, 0.5, 0.75])
@pytest.mark.parametrize("aside", [-0.3, 0.0])
def test_a_vehicle_stands_where_the_lane_differs_from_both_sides(visibility, share, aside):
    depth = share * min(visibility, 120.0)
    assert free(picture(visibility, depth, aside)) == pytest.approx(depth, rel=0.25)


def test_of_a_mirrored_image_it_is_the_same_and_an_empty_road_has_none():
    image = picture(100.0, 40.0, 0.3)
    assert free(image) == free(np.ascontiguousarray(image[:, ::-1]))
    assert free(picture(100.0)) == math.inf


@pytest.mark.parametrize("visibility", [50.0, 100.0])
def test_the_fog_before_it_is_read_all_the_same(visibility):
    fit = fit_day(picture(visibility, 0.6 * visibility), CAMERA, HORIZON)
    assert fit.quantile(0.05) < visibility < fit.quantile(0.95)
