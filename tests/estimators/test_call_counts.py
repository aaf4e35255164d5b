"""Estimators stay a few compiled functions: Python calls a frame, which other load does not disturb, have ceilings."""

import cProfile
import pstats
from typing import Any

import numpy as np
import pytest

from fogsim.estimators import make
from fogsim.values import Camera, Frame, LeadMeasurement, Observation

CAMERA = Camera(160, 120, 144.0, (80.0, 60.0), 1.4, pitch=0.03)
FRAMES, PERIOD, NEAREST, SPEED = 20, 0.1, 20.0, 5.0
"""Frames that count, their period [s], first range of the vehicle ahead [m], and how fast it leaves [m/s]."""


@pytest.mark.parametrize(("method", "most"), [("joint_road", 630), ("lead_contrast", 1000), ("negru2013", 400)])
def test_few_python_calls_are_made_a_frame(render, road, method: str, most: int) -> None:
    """The first run compiles what is not compiled yet; the second one counts."""
    estimator, observations = make(method, CAMERA), []
    for number in range(FRAMES):
        distance = NEAREST + SPEED * PERIOD * number
        image = render(road.but(camera=CAMERA, lead_distance=distance + 1.7), number)
        frame = Frame(PERIOD * number, np.repeat(image[:, :, None], 3, axis=2), CAMERA)
        observations.append(Observation(frame, 20.0, LeadMeasurement(distance, SPEED), ()))
    assert [estimator.update(one) for one in observations][-1].valid
    estimator.reset()
    with cProfile.Profile() as profiler:
        for one in observations:
            estimator.update(one)
    stats: Any = pstats.Stats(profiler)
    assert stats.total_calls / FRAMES <= most
