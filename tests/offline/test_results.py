"""JSON lines and table rows, from estimates that are known."""

import json
import math

import numpy as np

from fogsim.offline import FrameEstimates, ImageFiles, Picture, csv_lines, record_lines, table_heading, table_rows
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import Estimate

KEYS = [
    "frame",
    "time_s",
    "method",
    "valid",
    "visibility_m",
    "visibility_low_m",
    "visibility_high_m",
    "extinction_per_m",
    "category",
    "horizon_row",
    "reason",
]
IMAGE = np.zeros((4, 4), np.uint8)


def refuse(constant: str) -> None:
    raise AssertionError(f"{constant} is no JSON")


def records(*estimates: Estimate, name: str | int = 7, error: str = "") -> list[dict]:
    lines = record_lines(FrameEstimates(Picture(name, 0.0, IMAGE, error), estimates))
    return [json.loads(line, parse_constant=refuse) for line in lines]


def test_a_valid_estimate_has_every_key_in_its_unit() -> None:
    (record,) = records(Estimate("negru2013", 0.03, 0.003, diagnostics={"horizon_row": 219.5}))
    assert list(record) == KEYS
    assert record["frame"] == 7
    assert record["method"] == "negru2013"
    assert record["valid"] is True
    assert record["extinction_per_m"] == 0.03
    assert math.isclose(record["visibility_m"], OPTICAL_DEPTH_AT_VISIBILITY / 0.03, rel_tol=1e-5)
    # The 90 % interval of a normal k is ± 1.645 deviations.
    assert math.isclose(record["visibility_low_m"], OPTICAL_DEPTH_AT_VISIBILITY / 0.0349346, rel_tol=1e-5)
    assert math.isclose(record["visibility_high_m"], OPTICAL_DEPTH_AT_VISIBILITY / 0.0250654, rel_tol=1e-5)
    assert record["category"] == "dense"
    assert record["horizon_row"] == 219.5


def test_an_invalid_estimate_says_why() -> None:
    (record,) = records(Estimate.invalid("negru2013", "too dark", horizon_row=3.0))
    known = {"frame": 7, "time_s": 0.0, "method": "negru2013", "valid": False, "reason": "too dark"}
    assert record == {**dict.fromkeys(KEYS), **known}


def test_no_fog_has_no_largest_visibility() -> None:
    (record,) = records(Estimate("negru2013", 0.0, 0.001), name="a.png")
    assert record["valid"] is True
    assert record["visibility_m"] is None
    assert record["visibility_high_m"] is None
    assert math.isclose(record["visibility_low_m"], OPTICAL_DEPTH_AT_VISIBILITY / 0.001644854, rel_tol=1e-5)
    assert record["category"] == "none"


def test_an_image_that_cannot_be_used_has_an_error_alone() -> None:
    assert records(name="b.png", error="b.png: broken") == [{"frame": "b.png", "time_s": 0.0, "error": "b.png: broken"}]


def test_frames_of_a_long_drive_have_times_of_their_own() -> None:
    for time, written in [(33.366666, "33.3667"), (999.9996, "1000.0"), (12345.6667, "12345.667")]:
        (line,) = csv_lines(FrameEstimates(Picture(7, time, None, "broken"), ()))
        assert line.split(",")[1] == written


def test_odd_diagnostics_leave_the_line_strict_json() -> None:
    for horizon in (math.nan, math.inf, np.float64(12.25), "row"):
        (record,) = records(Estimate("m", 0.01, math.inf, diagnostics={"horizon_row": horizon}))
        assert record["horizon_row"] == (12.25 if isinstance(horizon, np.float64) else None)
        assert record["visibility_high_m"] is None


def test_rows_stand_under_their_heading() -> None:
    source = ImageFiles((), temporal=False, period=0.1)
    methods = ("negru2013", "joint_road")
    estimates = (
        Estimate("negru2013", 0.03, 0.003, diagnostics={"horizon_row": 219.5}),
        Estimate.invalid("joint_road", "the road is hidden"),
    )
    heading = table_heading(source, methods)
    first, second = table_rows(source, methods, FrameEstimates(Picture("a.png", 0.0, IMAGE), estimates))
    assert "no estimate: the road is hidden" in second
    for word, cell in (("visibility", "100 m"), ("90 % interval", "86 – 120 m"), ("horizon", "row 219.5")):
        assert heading.index(word) + len(word) == first.index(cell) + len(cell), word
