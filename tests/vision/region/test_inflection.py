import numpy as np
import pytest

from fogsim.vision.region.inflection import best_inflection, inflection_parameters, koschmieder, steepest_slope
from fogsim.vision.region.profile import RoadCurve, band_profile, decreasing, path_lengths
from fogsim.vision.region.road_region import Band

LAMBDA = 1000.0


def road_curve(extinction, road=60.0, airlight=200.0, rows=300, top=-10, noise=0.0, seed=0, row_distance=LAMBDA):
    below = np.arange(top, rows, dtype=float) + 0.3
    distance = path_lengths(below, row_distance, np.ones(below.size))
    luminance = koschmieder(extinction, road, airlight, distance)
    luminance = luminance + np.random.default_rng(seed).normal(0.0, 1.0, below.size) * noise
    return RoadCurve(below, luminance, distance, np.ones(below.size), row_distance)


@pytest.mark.parametrize("extinction", [0.006, 0.03, 0.15])
def test_closed_form_inverts_the_law(extinction):
    # physics.md section 5.4 has the values for 0.03: v_i − v_h = 15, I_i = 181.053, I' = −2.5263.
    below = 0.5 * extinction * LAMBDA
    transmission = np.exp(-2.0)
    luminance = 200.0 - 140.0 * transmission
    gradient = -140.0 * transmission * extinction * LAMBDA / below**2
    found = inflection_parameters(np.array(below), np.array(luminance), np.array(gradient), LAMBDA)
    assert np.array(found) == pytest.approx([extinction, 60.0, 200.0])


def test_the_law_has_its_limits():
    assert koschmieder(0.03, 60.0, 200.0, np.array([0.0, np.inf])) == pytest.approx([60.0, 200.0])
    assert 200.0 - koschmieder(np.log(20) / 100, 0.0, 200.0, np.array([100.0])) == pytest.approx(0.05 * 200.0)
    below = np.linspace(2.0, 200.0, 400)
    steepest = np.zeros(below.size)
    for extinction in np.geomspace(1e-4, 1.0, 200):
        slope = -np.gradient(koschmieder(extinction, 0.0, 200.0, LAMBDA / below), below)
        steepest = np.maximum(steepest, slope)
    bound = steepest_slope(below + 1.0, 200.0)
    assert np.all(steepest <= bound * 1.02)
    assert steepest[50:350] == pytest.approx(bound[50:350], rel=0.05)


@pytest.mark.parametrize("visibility", [30.0, 100.0, 300.0])
def test_best_inflection_is_within_a_row_of_the_truth(visibility):
    k = 3.0 / visibility
    model = best_inflection(road_curve(k))
    assert model is not None
    assert abs(model.extinction - k) * LAMBDA / 2 <= 1.0
    assert model.standard_deviation >= 0.5 * 2 / LAMBDA


def test_visibility_scales_with_lambda_and_a_flat_curve_has_no_inflection():
    curve = road_curve(0.03)
    twice = RoadCurve(curve.below_horizon, curve.luminance, 2 * curve.distance, curve.weight, 2 * LAMBDA)
    assert best_inflection(curve).extinction == pytest.approx(2 * best_inflection(twice).extinction, rel=1e-6)
    assert best_inflection(road_curve(0.03, road=100.0, airlight=100.0)) is None


def test_distance_is_infinite_at_and_above_the_horizon():
    lengths = path_lengths(np.array([-3.0, 0.0, 10.0]), 1000.0, np.array([1.0, 1.0, 1.1]))
    assert lengths.tolist() == [np.inf, np.inf, 110.0]


def test_smoothing_never_rises_and_keeps_what_falls():
    noisy = 200 - np.arange(50.0) + np.random.default_rng(3).normal(0, 5, 50)
    smooth = decreasing(noisy)
    assert np.all(np.diff(smooth) <= 1e-9)
    falling = 200.0 - np.arange(50.0)
    assert decreasing(falling)[1:-1] == pytest.approx(falling[1:-1])
    # Least squares that never rises gives 5, 3.5, 3.5, 2, 2, 2; the binomial 1-2-1 rounds its steps.
    assert decreasing(np.array([5.0, 3.0, 4.0, 1.0, 2.0, 3.0])) == pytest.approx([4.625, 3.875, 3.125, 2.375, 2, 2])


def test_a_profile_is_indifferent_to_narrow_marks_and_has_the_mean_of_a_slope_across():
    image = np.repeat(np.linspace(200, 60, 50, dtype=np.float32)[:, None], 90, axis=1)
    marked = image.copy()
    marked[:, 40:43] = 255
    assert band_profile(marked, Band(0, 89, 0, 49)) == pytest.approx(image[:, 0])
    slope = np.arange(300.0, dtype=np.float32) + np.zeros((4, 1), np.float32)
    for width in (1, 2, 47, 48, 49, 200):
        middle = band_profile(slope, Band(10, 9 + width, 0, 3))
        assert middle == pytest.approx(np.full(4, 9.5 + 0.5 * width), abs=1.5)
