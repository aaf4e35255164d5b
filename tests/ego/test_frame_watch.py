"""Which frames are news."""

import numpy as np

from fogsim.simulation.ego.frame_watch import FrameWatch, LeadHistory, why_useless
from fogsim.values import Camera, Frame, LeadMeasurement

CAMERA = Camera(40, 30, 50.0, (20.0, 15.0), 1.4)


def frame(time: float, seed: int) -> Frame:
    return Frame(time, np.random.default_rng(seed).integers(0, 255, (30, 40, 3)).astype(np.uint8), CAMERA)


def test_a_time_that_does_not_move_on_tells_that_nothing_is_new() -> None:
    watch = FrameWatch()
    assert watch.stale_reason(frame(3.0, 0), 20.0) == ""
    assert "no new frame: the last one is of 3.00 s" in watch.stale_reason(frame(3.0, 1), 20.0)
    assert watch.stale_reason(frame(3.1, 2), 20.0) == ""
    watch.reset()
    assert watch.stale_reason(frame(0.0, 2), 20.0) == ""


def test_a_picture_that_stands_still_is_no_news_only_while_the_vehicle_moves() -> None:
    watch = FrameWatch()
    still = frame(0.0, 0)
    told = [
        watch.stale_reason(Frame(0.1 * i, still.image.copy(), CAMERA), speed) for i, speed in enumerate([20, 0, 20])
    ]
    assert [bool(one) for one in told] == [False, False, True]
    one_pixel = still.image.copy()
    one_pixel[7, 9, 1] ^= 1
    assert watch.stale_reason(Frame(0.4, one_pixel, CAMERA), 20.0) == ""


def test_a_late_frame_belongs_with_what_was_measured_when_it_was_taken() -> None:
    history = LeadHistory()
    assert history.at(0.0) is None
    for number in range(6):
        history.add(0.1 * number, LeadMeasurement(float(number), 0.0) if number != 2 else None)
    found = [history.at(time) for time in (0.1, 0.2, 0.35, 0.5)]
    assert [one and one.distance for one in found] == [1.0, None, 3.0, 5.0]


def test_a_frame_that_is_late_or_shows_nothing_is_useless():
    assert why_useless(frame(3.0, 1), 3.5) == ""
    assert why_useless(frame(3.0, 1), 3.6) == "the frame is 0.60 s late"
    dark = Frame(3.0, np.random.default_rng(0).integers(0, 3, (30, 40, 3)).astype(np.uint8), CAMERA)
    assert why_useless(dark, 3.0) == "the picture shows nothing: 0 … 2 grey levels"
    assert why_useless(Frame(3.0, np.full((30, 40, 3), 255, np.uint8), CAMERA), 3.0).startswith("the picture shows")
    # In the densest fog the road before the bonnet still differs from the airlight.
    assert why_useless(Frame(3.0, np.repeat([200, 203], 600).reshape(30, 40).astype(np.uint8), CAMERA), 3.0) == ""
