"""Which picture comes out of a camera when, and with what time."""

import numpy as np
import pytest

from fogsim.camera import Delivered, FrameDelivery
from fogsim.values.fault import Blackout, DroppedFrames, Fault, FaultKind, FrozenFrame, Latency, RunningFault, TimeStamp


def handed_out(*kinds: FaultKind, begin: int = 3, end: int = 8, count: int = 12) -> list[tuple[float, int]]:
    """Time and number of each frame of pictures that are numbered from 1 and taken each second."""
    delivery, rng = FrameDelivery(), np.random.default_rng(3)
    seen = []
    for second in range(count):
        taken = Delivered(float(second), np.full((2, 2, 3), second + 1, np.uint8))
        faults = [RunningFault(Fault(kind), begin, end, rng) for kind in kinds] if begin <= second < end else []
        frame = delivery.deliver(taken, faults)
        seen.append((frame.time, int(frame.pixels[0, 0, 0])))
    return seen


PLAIN = [(float(second), second + 1) for second in range(12)]


def test_black_frames_bear_their_own_time() -> None:
    assert handed_out() == PLAIN
    assert handed_out(Blackout()) == [*PLAIN[:3], *((float(s), 0) for s in range(3, 8)), *PLAIN[8:]]


@pytest.mark.parametrize("time_stamp", TimeStamp)
def test_frozen_frames_are_the_last_one_before(time_stamp: TimeStamp) -> None:
    times = [2.0] * 5 if time_stamp is TimeStamp.EXPOSURE else [3.0, 4.0, 5.0, 6.0, 7.0]
    assert handed_out(FrozenFrame(time_stamp)) == [*PLAIN[:3], *((time, 3) for time in times), *PLAIN[8:]]


def test_late_frames_leave_a_gap_first_and_are_overtaken_at_last() -> None:
    late = [2.0, 2.0, 3.0, 4.0, 5.0]
    assert handed_out(Latency(2.0, TimeStamp.EXPOSURE)) == [
        *PLAIN[:3],
        *((time, int(time) + 1) for time in late),
        *PLAIN[8:],
    ]
    stamped = handed_out(Latency(2.0, TimeStamp.DELIVERY))
    assert stamped[5:8] == [(5.0, 4), (6.0, 5), (7.0, 6)]
    assert handed_out(Latency(2.0, TimeStamp.EXPOSURE), begin=0)[:3] == [(0.0, 0), (0.0, 0), (0.0, 1)]


def test_frames_get_lost_at_the_rate_that_is_asked_for() -> None:
    seen = handed_out(DroppedFrames(0.3), begin=0, end=200, count=200)
    lost = np.mean([time != second for second, (time, _) in enumerate(seen)])
    # Two standard deviations of a share of 200.
    assert lost == pytest.approx(0.3, abs=0.065)
    assert handed_out(DroppedFrames(1.0))[3:8] == [PLAIN[2]] * 5
    assert handed_out(DroppedFrames(0.0)) == PLAIN
