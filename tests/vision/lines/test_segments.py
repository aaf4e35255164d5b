"""The vanishing point of line segments, without any calibration."""

import numpy as np
import pytest
from stripes import CENTRE, ROW, road_lines

from fogsim.values import Response
from fogsim.vision.lines.segments import road_segments


def found(image):
    segments = road_segments(np.clip(np.rint(image), 0, 255).astype(np.uint8), Response.LINEAR, 8)
    return None if segments is None else segments.point


@pytest.mark.parametrize("offsets", [(-1.9, -1.75, 1.75, 1.9), (-5.4, -5.2, 1.7, 1.85), (-0.9, -0.75, 2.6, 2.75)])
def test_segments_meet_within_a_pixel(offsets):
    for seed in range(3):
        point = found(road_lines(offsets, seed=seed))
        assert (point.column, point.row) == pytest.approx((CENTRE, ROW), abs=1.0)
        assert point.row_deviation < 0.5
        assert point.lines >= 2
        assert point.support > 300.0


def test_mirrored_segments_meet_in_the_mirrored_point():
    image = road_lines((-1.9, -1.75, 2.4, 2.6))
    point, mirrored = found(image), found(np.ascontiguousarray(image[:, ::-1]))
    assert (mirrored.column, mirrored.row) == pytest.approx((639.0 - point.column, point.row), abs=0.3)


def test_no_segments_segments_to_one_side_and_parallel_ones_have_none():
    for offsets in ((), (1.2, 1.5), (0.6, 0.8, 1.9, 2.1)):
        assert found(road_lines(offsets)) is None
    v, u = np.mgrid[:300, :640]
    assert found(np.where((u - v) % 100 < 20, 120.0, 60.0)) is None
