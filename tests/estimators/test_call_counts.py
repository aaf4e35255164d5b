"""Estimators stay a few compiled functions: Python calls a frame, which other load does not disturb, have ceilings."""

import sys
from collections.abc import Callable
from types import FrameType

import numpy as np
import pytest

from fogsim.estimators import Estimator, make
from fogsim.values import Camera, Frame, LeadMeasurement, Observation

CAMERA = Camera(160, 120, 144.0, (80.0, 60.0), 1.4, pitch=0.03)
FRAMES, PERIOD, NEAREST, SPEED = 20, 0.1, 20.0, 5.0
"""Frames that count, their period [s], first range of the vehicle ahead [m], and how fast it leaves [m/s]."""


def foggy_road(range_: float) -> np.ndarray:
    """A road in fog with a dark vehicle ahead of some range, with noise."""
    rows, cols = np.mgrid[: CAMERA.height, : CAMERA.width].astype(float)
    below = rows - CAMERA.horizon_row
    distance = np.where(below > 0.3, CAMERA.row_distance / np.maximum(below, 0.3), np.inf)
    light = 200.0 - 120.0 * np.exp(-0.03 * distance)
    scale = CAMERA.focal_length / range_
    foot = CAMERA.horizon_row + CAMERA.row_distance / range_
    body = (np.abs(cols - 80.0) < 0.9 * scale) & (rows <= foot) & (rows > foot - 1.5 * scale)
    light = np.where(body, 200.0 - 180.0 * np.exp(-0.03 * range_), light)
    noisy = light + np.random.default_rng(int(10.0 * range_)).normal(0.0, 1.0, light.shape)
    return np.repeat(np.clip(np.rint(noisy), 0, 255).astype(np.uint8)[:, :, None], 3, axis=2)


def drive(frames: int) -> list[Observation]:
    """Images of a vehicle that drives away."""
    ranges = [NEAREST + SPEED * PERIOD * number for number in range(frames)]
    return [
        Observation(Frame(PERIOD * number, foggy_road(one), CAMERA), 20.0, LeadMeasurement(one, SPEED), ())
        for number, one in enumerate(ranges)
    ]


def counted(work: Callable[[], object]) -> int:
    """Calls of Python functions, of compiled kernels and of C functions during some work."""
    calls = 0

    def count(_frame: FrameType, event: str, _argument: object) -> None:
        nonlocal calls
        calls += event in ("call", "c_call")

    sys.setprofile(count)
    try:
        work()
    finally:
        sys.setprofile(None)
    return calls


def run(estimator: Estimator, observations: list[Observation]) -> None:
    for observation in observations:
        estimator.update(observation)


@pytest.mark.parametrize(("method", "most"), [("joint_road", 900), ("lead_contrast", 1100), ("negru2013", 750)])
def test_few_python_calls_are_made_a_frame(method: str, most: int) -> None:
    """The first run compiles what is not compiled yet; the second one counts."""
    estimator, observations = make(method, CAMERA), drive(FRAMES)
    run(estimator, observations)
    assert any(estimator.update(one).valid for one in drive(FRAMES + 1)[-1:])
    estimator.reset()
    calls = counted(lambda: run(estimator, observations)) / FRAMES
    assert calls <= most, f"{calls:.0f} calls a frame"
