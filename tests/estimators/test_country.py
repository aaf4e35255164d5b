"""Country roads under other lenses, with hedges and worn asphalt: drawn by a fourth renderer, `country`."""

from dataclasses import replace

import numpy as np
import pytest
from country import Country, draw, random_country

from fogsim.estimators import make
from fogsim.values import Camera, Observation, Response

PLAIN = Country(Camera(560, 400, 600.0, (279.5, 199.5), 1.3, np.radians(1.5), response=Response.SRGB), 100.0)


def seen(scene, told, seed):
    """Error of k relative to the truth, and its standard deviation; None if it is not valid."""
    found, truth = make("joint_road", told).update(Observation(draw(scene, seed))), np.log(20.0) / scene.visibility
    return (found.extinction / truth - 1.0, found.standard_deviation / truth) if found.valid else None


@pytest.mark.parametrize("count", [12, pytest.param(30, marks=pytest.mark.nightly)])
def test_country_roads_are_measured_or_refused_and_intervals_hold(count):
    scenes = [(*random_country(seed), seed) for seed in range(300, 300 + count)]
    found = [one for one in (seen(*scene) for scene in scenes) if one is not None]
    assert len(found) >= 0.8 * len(scenes)
    error, deviation = np.abs(np.array(found)).T
    assert np.median(error) < 0.07
    assert np.mean((error < 0.25) | (error < 3.0 * deviation)) >= 0.9
    assert np.mean(error < 1.645 * deviation) >= 0.75


@pytest.mark.parametrize(
    "changes",
    [
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
    ],
    ids=str,
)
def test_each_of_it_costs_little(changes):
    found = seen(replace(PLAIN, **changes), PLAIN.camera, 0)
    assert found is not None
    assert abs(found[0]) < 0.12
