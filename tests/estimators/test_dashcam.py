"""Pictures as cameras behind windscreens take them, drawn by a third renderer: no gross error may pass as valid."""

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from windscreen import IN_THE_WAY, PLAIN, draw, small_scenes

from fogsim.estimators import make
from fogsim.values import Observation

GROSS = 0.3


def relative_errors(method, scenes, pictures):
    """Error of k of each scene that the method calls valid, and its standard deviation, relative to the truth."""
    found = []
    for (_, scene, told), picture in zip(scenes, pictures, strict=True):
        estimate, truth = make(method, told).update(Observation(picture)), np.log(20.0) / scene.visibility
        if estimate.valid:
            found.append((estimate.extinction / truth - 1.0, estimate.standard_deviation / truth))
    return np.array(found).reshape(-1, 2).T


def drawn(scenes):
    return [draw(scene, seed) for seed, scene, _ in scenes]


def test_whatever_a_dashcam_sees_is_no_gross_error():
    scenes = list(islice(small_scenes(5000), 24))
    # The pictures take longer than both methods.
    pictures = drawn(scenes)
    for method, valid in (("joint_road", 0.8), ("negru2013", 0.6)):
        error, deviation = np.abs(relative_errors(method, scenes, pictures))
        assert len(error) >= valid * len(scenes), method
        # What is far off must at least be known to be unsure.
        assert np.all((error < GROSS) | (error < 3.0 * deviation)), method
        assert np.median(error) < 0.06, method


@pytest.mark.parametrize("changes", IN_THE_WAY, ids=str)
def test_what_stands_in_the_way_costs_little(changes):
    scene = replace(PLAIN, **changes)
    scenes = [(0, scene, PLAIN.camera)]
    error, _ = relative_errors("joint_road", scenes, drawn(scenes))
    assert len(error) == 1
    assert np.abs(error).max() < 0.15
