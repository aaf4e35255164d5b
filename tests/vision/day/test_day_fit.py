"""The day model's posterior, the vehicles that it leaves out, drawn by hand, and curves that cameras may have."""

import math
from dataclasses import replace

import numpy as np
import pytest

from fogsim.units import extinction_from_visibility
from fogsim.values import Camera
from fogsim.values.camera import Response
from fogsim.values.camera_response import exposure_of, respond
from fogsim.vision.day.day_fit import fit_day
from fogsim.vision.day.row_data import MOST_SLOPE, STATED, chances_of, curves_of, free_depth, row_bins
from fogsim.vision.lines.horizon import Horizon, calibrated_horizon, levelled


def test_a_response_that_explains_nothing_leaves_probabilities():
    rows = np.arange(48)[:, None] / 47.0
    light = np.where(rows < 0.45, 0.7, 0.7 - 0.5 * np.exp(-0.08 / np.maximum(rows - 0.45, 1e-3)))
    image = np.rint(4095.0 * np.repeat(light, 64, axis=1)).astype(np.uint16)
    camera = Camera(64, 48, 8.1, (32.0, 21.6), 1.4, roll=0.28, response="srgb", bits=12, black_level=0.25)
    fit = fit_day(levelled(image, camera), camera, calibrated_horizon(camera))
    assert fit.responses[0] == 0.0
    assert fit.surfaces.sum() == pytest.approx(1.0)


def test_an_image_that_is_black_but_for_little_sky_is_dark():
    image = np.zeros((96, 128), np.uint8)
    image[:3] = 200
    fit = fit_day(image, Camera(128, 96, 110.0, (63.5, 47.5), 1.35), Horizon(47.5, 0.2))
    assert math.isfinite(fit.contrast)
    assert 0.0 < fit.brightest < 0.01


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
def test_a_vehicle_stands_where_the_lane_differs_from_both_sides(visibility, share):
    depth = share * min(visibility, 120.0)
    assert free(picture(visibility, depth, -0.3)) == pytest.approx(depth, rel=0.25)


def test_of_a_mirrored_image_it_is_the_same_and_an_empty_road_has_none():
    image = picture(100.0, 40.0, 0.3)
    assert free(image) == free(np.ascontiguousarray(image[:, ::-1]))
    assert free(picture(100.0)) == math.inf


@pytest.mark.parametrize("visibility", [50.0, 100.0])
def test_the_fog_before_it_is_read_all_the_same(visibility):
    fit = fit_day(picture(visibility, 0.6 * visibility), CAMERA, HORIZON)
    assert fit.quantile(0.05) < visibility < fit.quantile(0.95)


@pytest.mark.parametrize("response", list(Response))
@pytest.mark.parametrize("black_level", [0.0, 0.05])
def test_the_stated_curve_comes_first_and_all_rise_from_dark_to_full(response, black_level):
    curves = curves_of(replace(CAMERA, response=response, black_level=black_level))
    assert curves.chance[0] == STATED
    assert curves.chance.sum() == pytest.approx(1.0)
    assert np.all(np.diff(curves.light, axis=1) >= 0.0)
    assert curves.light[:, -1] == pytest.approx(1.0, abs=0.01)
    assert np.all((curves.slope >= 1.0 / MOST_SLOPE) & (curves.slope <= MOST_SLOPE))


def stretched(visibility: float) -> np.ndarray:
    """A road in fog, in sRGB, its levels stretched to the full range."""
    light = exposure_of(picture(visibility) / 255.0, Response.LINEAR)
    signal = respond(light, Response.SRGB)
    black, white = np.quantile(signal, [0.005, 0.995])
    return np.rint(255.0 * np.clip((signal - black) / (white - black), 0.0, 1.0)).astype(np.uint8)


@pytest.mark.parametrize("visibility", [60.0, 120.0])
def test_levels_that_were_stretched_to_black_are_seen_as_such(visibility):
    image, camera = stretched(visibility), replace(CAMERA, response=Response.SRGB)
    curves = curves_of(camera)
    assert chances_of(image[:, :, None], camera).sum() == pytest.approx(1.0)
    assert np.array_equal(chances_of(np.maximum(image, 4)[:, :, None], camera), curves.chance)
    fit = fit_day(image, camera, HORIZON)
    assert fit.responses[curves.chance == 0.0].sum() > 0.9
    assert fit.quantile(0.5) == pytest.approx(visibility, rel=0.15)


def test_the_mean_over_responses_counts_the_more_the_less_likely_the_stated_one_is():
    fit = fit_day(picture(100.0), CAMERA, HORIZON)
    means, others = np.full(fit.responses.size, -0.2), np.full(fit.responses.size, 1.0 / (fit.responses.size - 1))
    means[0] = 0.0
    shifts = [
        replace(fit, responses=np.append(stated, (1.0 - stated) * others[1:]), log_means=means).response_shift
        for stated in (0.3, 0.16, 0.1, 0.02, 0.0)
    ]
    assert shifts[:2] == [0.0, 0.0]
    assert np.all(np.diff(shifts[1:]) < 0.0)
    assert shifts[-1] == pytest.approx(-0.2)


def test_no_curve_is_there_twice():
    for response in Response:
        light = curves_of(replace(CAMERA, response=response)).light
        apart = np.abs(light[:, None] - light[None]).max(axis=2) + np.eye(len(light))
        assert apart.min() > (0.01 if response is not Response.GAMMA else 0.005)
