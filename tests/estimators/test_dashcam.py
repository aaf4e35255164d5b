"""Pictures as cameras behind windscreens and on country roads take them, drawn by a third and a fourth renderer."""

from collections.abc import Iterable
from dataclasses import replace
from itertools import islice

import country
import numpy as np
import pytest
import windscreen

from fogsim.estimators import make
from fogsim.values import Camera, Observation, Response

LENS = Camera(560, 400, 600.0, (279.5, 199.5), 1.3, np.radians(1.5), response=Response.SRGB)
PLAIN = country.Country(LENS, 100.0)
LENSES_AND_COUNTRY = (
    {"corners": 1.0},
    {"corners": 1.0, "visibility": 400.0},
    {"across": 0.1},
    {"upward": 0.4},
    {"hedge": 5.0},
    {"hedge": 0.8, "visibility": 40.0},
    {"tracks": 0.1, "half_road": 5.0},
    {"repairs": 0.2},
    {"dirt": 4},
    {"quality": 70},
    {"vehicle": (20.0, 0.0, 0.3)},
    {"bonnet": 0.05},
)
ALONE = [
    *((windscreen.draw, windscreen.PLAIN, changes, 0.15) for changes in windscreen.IN_THE_WAY),
    *((country.draw, PLAIN, changes, 0.12) for changes in LENSES_AND_COUNTRY),
]


def relative_errors(method: str, pictures: Iterable[tuple[np.ndarray, Camera, float]]) -> np.ndarray:
    """(2, n): error of k of each picture that the method calls valid, and its standard deviation, over the truth."""
    found = []
    for picture, told, visibility in pictures:
        estimate, truth = make(method, told).update(Observation(picture)), np.log(20.0) / visibility
        if estimate.valid:
            found.append((abs(estimate.extinction / truth - 1.0), estimate.standard_deviation / truth))
    return np.array(found).reshape(-1, 2).T


def test_whatever_a_dashcam_sees_is_no_gross_error():
    # The pictures take longer than both methods.
    scenes = islice(windscreen.small_scenes(5000), 24)
    pictures = [(windscreen.draw(scene, seed, over=1), told, scene.visibility) for seed, scene, told in scenes]
    for method, valid in (("joint_road", 0.8), ("negru2013", 0.6)):
        error, deviation = relative_errors(method, pictures)
        assert len(error) >= valid * len(pictures), method
        # What is far off must at least be known to be unsure.
        assert np.all((error < 0.3) | (error < 3.0 * deviation)), method
        assert np.median(error) < 0.06, method


@pytest.mark.parametrize("count", [12, pytest.param(30, marks=pytest.mark.nightly)])
def test_country_roads_are_measured_or_refused_and_intervals_hold(count):
    scenes = [(*country.random_country(seed), seed) for seed in range(300, 300 + count)]
    pictures = ((country.draw(scene, seed, over=1), told, scene.visibility) for scene, told, seed in scenes)
    error, deviation = relative_errors("joint_road", pictures)
    assert len(error) >= 0.8 * count
    assert np.median(error) < 0.07
    assert np.mean((error < 0.25) | (error < 3.0 * deviation)) >= 0.9
    assert np.mean(error < 1.645 * deviation) >= 0.75


@pytest.mark.parametrize(("draw", "plain", "changes", "most"), ALONE, ids=[str(one[2]) for one in ALONE])
def test_what_stands_in_the_way_costs_little(draw, plain, changes, most):
    scene = replace(plain, **changes)
    ((error,), _) = relative_errors("joint_road", [(draw(scene, 0), plain.camera, scene.visibility)])
    assert error < most
