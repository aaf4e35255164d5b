import numpy as np
import pytest

from fogsim.vision.region.inflection import best_inflection, inflection_parameters, koschmieder, steepest_slope
from fogsim.vision.region.profile import RoadCurve, path_lengths

LAMBDA = 1000.0


def road_curve(extinction, road=60.0, airlight=200.0, rows=300, top=-10, noise=0.0, seed=0, row_distance=LAMBDA):
    below = np.arange(top, rows, dtype=float) + 0.3
    distance = path_lengths(below, row_distance, np.ones(below.size))
    luminance = koschmieder(extinction, road, airlight, distance)
    luminance = luminance + np.random.default_rng(seed).normal(0.0, 1.0, below.size) * noise
    return RoadCurve(below, luminance, distance, np.ones(below.size), row_distance)


def test_published_check_value_with_the_right_signs():
    # physics.md section 5.4: k = 0.03, λ = 1000, A = 200, R = 60 → v_i − v_h = 15, I_i = 181.053, I' = −2.5263
    k, road, airlight = inflection_parameters(np.array(15.0), np.array(181.053), np.array(-2.5263), LAMBDA)
    assert k == pytest.approx(0.03)
    assert airlight == pytest.approx(200.0, abs=0.01)
    assert road == pytest.approx(60.0, abs=0.02)


@pytest.mark.parametrize("extinction", [0.006, 0.03, 0.15])
def test_closed_form_inverts_the_law(extinction):
    below = 0.5 * extinction * LAMBDA
    transmission = np.exp(-2.0)
    luminance = 200.0 - 140.0 * transmission
    gradient = -140.0 * transmission * extinction * LAMBDA / below**2
    found = inflection_parameters(np.array(below), np.array(luminance), np.array(gradient), LAMBDA)
    assert np.array(found) == pytest.approx([extinction, 60.0, 200.0])


def test_the_law_has_its_limits():
    assert koschmieder(0.03, 60.0, 200.0, np.array([0.0, np.inf])) == pytest.approx([60.0, 200.0])
    assert 200.0 - koschmieder(np.log(20) / 100, 0.0, 200.0, np.array([100.0])) == pytest.approx(0.05 * 200.0)


@pytest.mark.parametrize("visibility", [30.0, 100.0, 300.0])
def test_best_inflection_is_within_a_row_of_the_truth(visibility):
    k = 3.0 / visibility
    model = best_inflection(road_curve(k))
    assert model is not None
    assert abs(model.extinction - k) * LAMBDA / 2 <= 1.0
    assert model.standard_deviation >= 0.5 * 2 / LAMBDA


def test_visibility_scales_with_lambda():
    curve = road_curve(0.03)
    twice = RoadCurve(curve.below_horizon, curve.luminance, 2 * curve.distance, curve.weight, 2 * LAMBDA)
    assert best_inflection(curve).extinction == pytest.approx(2 * best_inflection(twice).extinction, rel=1e-6)


def test_a_flat_curve_has_no_inflection():
    flat = road_curve(0.03, road=100.0, airlight=100.0)
    assert best_inflection(flat) is None


def test_no_fog_is_steeper_than_the_bound():
    below = np.linspace(2.0, 200.0, 400)
    steepest = np.zeros(below.size)
    for extinction in np.geomspace(1e-4, 1.0, 200):
        slope = -np.gradient(koschmieder(extinction, 0.0, 200.0, LAMBDA / below), below)
        steepest = np.maximum(steepest, slope)
    bound = steepest_slope(below + 1.0, 200.0)
    assert np.all(steepest <= bound * 1.02)
    assert steepest[50:350] == pytest.approx(bound[50:350], rel=0.05)
