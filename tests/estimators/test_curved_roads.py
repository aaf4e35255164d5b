"""The joint fit on drawn roads that bend, sag and crest."""

import math
from dataclasses import replace

import numpy as np
import pytest
from flat_road import Road, photograph, scan

from fogsim.estimators import make
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import Camera, Observation
from fogsim.values.estimate import NORMAL_90_PERCENT

CAMERA = Camera(640, 480, 577.0, (319.5, 239.5), 1.38, math.radians(2.0))
SAG, CREST, BEND = 1.0 / 8800.0, -1.0 / 13_000.0, 1.0 / 400.0


def errors(visibilities: tuple[float, ...], **course) -> tuple[np.ndarray, np.ndarray]:
    """Errors of V_met [%], and the 90 % intervals' half-widths."""
    error, half = [], []
    for seed in range(3):
        true = replace(CAMERA, pitch=CAMERA.pitch + math.radians((-0.1, 0.0, 0.12)[seed]))
        road = Road(camera=true, **course)
        drawing = scan(road, seed, 2)
        for visibility in visibilities:
            image = photograph(road.but(visibility=visibility), drawing, seed)
            found = make("joint_road", CAMERA).update(Observation(image))
            assert found.valid
            truth = OPTICAL_DEPTH_AT_VISIBILITY / visibility
            error.append(100.0 * (truth / found.extinction - 1.0))
            half.append(100.0 * NORMAL_90_PERCENT * found.standard_deviation / truth)
    return np.abs(error), np.array(half)


# A bend to the right is one to the left mirrored, which test_mirror compares.
@pytest.mark.parametrize("course", [{"sag": SAG}, {"sag": CREST}, {"bend": BEND}, {"bend": BEND, "sag": SAG}])
def test_curved_roads_are_read_as_well_as_straight_ones(course):
    error, half = errors((60.0, 120.0), **course)
    assert np.median(error) < 2.0
    assert error.max() < 10.0
    assert np.mean(error < half) >= 0.85


def test_what_no_lines_show_widens_the_interval():
    _, marked = errors((300.0,))
    error, bare = errors((300.0,), marks=False)
    assert np.median(bare) > 1.5 * np.median(marked)
    assert (error < bare).all()
