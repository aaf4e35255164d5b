"""Belaroussi & Gruyer (2015): from first detections of signs to the visibility."""

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest

from fogsim.core.linear_algebra import majority, reduced
from fogsim.errors import InputError
from fogsim.estimators.signs.belaroussi2015 import Belaroussi2015
from fogsim.estimators.signs.operating_range import OperatingRange
from fogsim.estimators.signs.regions import ProjectedSign
from fogsim.estimators.signs.watch import SignTrack, Watched
from fogsim.values import Camera, Frame, Observation, SignSighting

CAMERA = Camera(140, 60, 140.0, (69.5, 29.5), 1.4)
RANGE = OperatingRange(
    140.0,
    0.9,
    visibility=(50.0, 100.0, 200.0, 300.0, 400.0),
    operating_range=(50.0, 100.0, 190.0, 200.0, 200.0),
    first_detection=(60.0, 120.0, 200.0, 210.0, 210.0),
    deviation=(3.0, 4.0, 5.0, 2.0, 2.0),
)


def test_the_mixture_is_that_of_equation_2() -> None:
    mean, deviation = reduced([240.0, 250.0, 260.0], [1.0, 1.0, 0.5])
    assert mean == pytest.approx(248.0)
    assert deviation**2 == pytest.approx(84.0)
    assert reduced([250.0], [1.0]) == (250.0, pytest.approx(0.398942, abs=1e-6))


def test_the_majority_is_kept() -> None:
    values = [98.0, 101.0, 103.0, 99.0, 240.0, 20.0]
    assert majority(values, [1.0] * 6).tolist() == [True, True, True, True, False, False]
    assert majority(values, [0.1, 0.1, 0.1, 0.1, 1.0, 0.1]).tolist() == [False] * 4 + [True, False]
    assert majority([5.0, 50.0, 500.0], [1.0] * 3).all()
    assert majority([7.0] * 9, [1.0] * 9).all()


def test_the_curve_is_monotone_and_ends_where_resolution_sets_the_distance() -> None:
    low, high = RANGE.reach
    assert (low, high) == (60.0, pytest.approx(210.0 - 1.5 * 2.0, abs=1.0))
    told = [RANGE.visibility_at(distance) for distance in np.linspace(low, high, 20)]
    visibilities = [one[0] for one in told if one is not None]
    assert len(visibilities) == 20
    assert visibilities == sorted(visibilities)
    middle = RANGE.visibility_at(120.0)
    assert middle is not None
    assert middle[0] == pytest.approx(100.0)
    assert 2.0 < middle[1] < 8.0
    assert RANGE.visibility_at(40.0) is None
    assert RANGE.visibility_at(209.5) is None
    assert 200.0 < RANGE.farthest < 300.0


def test_a_detector_that_resolution_alone_limits_tells_nothing() -> None:
    flat = dataclasses.replace(RANGE, first_detection=(80.0,) * 5)
    assert flat.reach[0] > flat.reach[1]
    assert flat.visibility_at(80.0) is None


def test_the_published_cubic_goes_through_the_operating_ranges() -> None:
    truth = np.array([1e-5, 0.002, 1.5, 10.0])
    ranges = (40.0, 80.0, 120.0, 160.0, 200.0)
    visibility = tuple(np.polyval(truth, ranges).tolist())
    measured = OperatingRange(140.0, 0.9, visibility, ranges, ranges, (1.0,) * 5)
    assert measured.cubic == pytest.approx(truth.tolist(), rel=1e-3)
    assert measured.visibility_by_cubic(100.0) == pytest.approx(np.polyval(truth, 100.0))
    # A fog in which no distance has 80 % is not fitted.
    more = {name: (*getattr(measured, name), 0.0) for name in ("operating_range", "first_detection", "deviation")}
    with_none = dataclasses.replace(measured, visibility=(*visibility, 2.0 * visibility[-1]), **more)
    assert with_none.cubic == pytest.approx(measured.cubic, rel=1e-6)
    assert math.isnan(dataclasses.replace(measured, operating_range=(0.0,) * 5).visibility_by_cubic(50.0))


def test_the_file_comes_back_and_mistakes_are_named(tmp_path: Path) -> None:
    file = tmp_path / "range.json"
    file.write_text(RANGE.as_json(), encoding="utf-8")
    assert OperatingRange.read(file) == RANGE
    data = json.loads(RANGE.as_json())
    for change, message in (
        ({"visibility_m": [50, 40, 200, 300, 400]}, "visibilities above 0 that ascend"),
        ({"deviation_m": [1.0]}, "as many distances each"),
        ({"deviation_m": ["wide"] * 5}, "deviation_m: 0 must be a number"),
        ({"visibilty_m": []}, "expected the keys"),
        ({"diameter_m": -1.0}, "none below 0"),
    ):
        file.write_text(json.dumps({**data, **change}), encoding="utf-8")
        with pytest.raises(InputError, match=rf"range\.json.*{message}"):
            OperatingRange.read(file)
    with pytest.raises(InputError, match=r"none\.json: cannot be read: No such file"):
        Belaroussi2015(CAMERA, operating_range=str(tmp_path / "none.json"))
    with pytest.raises(InputError, match="focal length of 140 px, and the camera has 700 px"):
        Belaroussi2015(dataclasses.replace(CAMERA, focal_length=700.0)).calibrated(RANGE)


class Told:
    """A watch that finds what it is told, in place of one that looks at pixels."""

    trouble = ""

    def __init__(self) -> None:
        self.tracks: tuple[SignTrack, ...] = ()
        self.passed: tuple[SignTrack, ...] = ()

    def look(self, *_: object) -> Watched:
        return Watched((), (), self.passed)

    def reset(self) -> None: ...


def track(name: str, first: float, *, before: float | None = 400.0) -> SignTrack:
    sighting = SignSighting(name, "stop", 0.0, first, -5.0, 0.9)
    sign = ProjectedSign(sighting, first, 0.0, 0.0, 5.0, 1.0, 1.0, expected=True)
    return SignTrack(sign, 0.0, first_seen=first, confidence=0.9, unseen_before=before, detections=2)


def estimator(**options: object) -> tuple[Belaroussi2015, Told]:
    made, told = Belaroussi2015(CAMERA, **options).calibrated(RANGE), Told()  # type: ignore[arg-type]  # any
    made._watch = told  # type: ignore[assignment]  # a stand-in
    return made, told


def seen(time: float) -> Observation:
    return Observation(Frame(time, np.zeros((60, 140, 3), np.uint8), CAMERA), speed=20.0)


def test_first_detections_give_the_visibility_and_fade() -> None:
    made, told = estimator()
    told.tracks = tuple(track(name, first) for name, first in (("a", 118.0), ("b", 122.0), ("c", 120.0)))
    first = made.update(seen(0.0))
    assert first.valid
    assert first.visibility == pytest.approx(100.0, rel=0.03)
    assert 0.08 <= first.standard_deviation / first.extinction < 0.12
    again = made.update(seen(1.0))
    assert again.diagnostics["signs"] == 3
    told.tracks = ()
    assert not made.update(seen(300.0)).valid


def test_an_outlier_is_set_aside_and_comes_back_as_the_majority() -> None:
    made, told = estimator()
    told.tracks = tuple(track(str(i), first) for i, first in enumerate((119.0, 120.0, 121.0, 65.0, 200.0)))
    estimate = made.update(seen(0.0))
    assert estimate.diagnostics["signs"] == 3
    assert estimate.visibility == pytest.approx(100.0, rel=0.03)


def test_signs_from_beyond_the_curve_are_a_bound_and_no_number() -> None:
    made, told = estimator()
    told.tracks = (track("a", 210.0),)
    estimate = made.update(seen(0.0))
    assert not estimate.valid
    assert estimate.diagnostics["visibility_at_least"] == pytest.approx(RANGE.farthest)
    assert "at least" in str(estimate.diagnostics["reason"])
    assert estimate.bounds is not None
    assert math.log(20.0) / estimate.bounds.most == pytest.approx(RANGE.farthest)
    published, told = estimator(as_published=True)
    told.tracks = (track("a", 199.0),)
    assert published.update(seen(0.0)).valid


def missed(name: str, nearest: float) -> SignTrack:
    return dataclasses.replace(track(name, nearest, before=nearest), first_seen=None, detections=0, misses=5)


def test_signs_that_are_missed_are_a_bound_once_the_map_has_been_found_to_hold() -> None:
    made, told = estimator()
    told.tracks = (missed("a", 60.0), missed("b", 120.0))
    assert made.update(seen(0.0)).bounds is None  # the map may be another place's
    told.tracks = (track("c", 100.0, before=None),)
    made.update(seen(1.0))
    told.tracks = (missed("a", 60.0),)
    made.update(seen(2.0))
    found = made.update(seen(3.0))
    assert found.bounds is not None
    # The farther one of two counts, for one may be missing: first seen from nearer than 120 m is fog below 100 m.
    assert math.log(20.0) / found.bounds.least == pytest.approx(100.0, rel=0.01)
    assert found.diagnostics["visibility_at_most"] == pytest.approx(100.0, rel=0.01)
    assert "not seen" in str(found.diagnostics["reason"])
    assert made.update(seen(90.0)).bounds is None  # long ago


def test_one_sign_that_is_missed_or_one_that_is_found_after_all_bounds_nothing() -> None:
    made, told = estimator()
    told.tracks = (track("c", 100.0, before=None), missed("a", 60.0))
    assert made.update(seen(0.0)).bounds is None
    told.tracks = (missed("a", 60.0), missed("b", 80.0))
    assert made.update(seen(1.0)).bounds is not None
    told.tracks = (missed("a", 60.0), track("b", 50.0, before=None))
    assert made.update(seen(2.0)).bounds is None


def test_a_sign_that_was_seen_at_the_first_look_tells_no_first_detection() -> None:
    made, told = estimator()
    told.tracks = (track("a", 100.0, before=None),)
    assert not made.update(seen(0.0)).valid


def test_without_a_calibration_it_says_so() -> None:
    estimate = Belaroussi2015(CAMERA).update(seen(0.0))
    assert not estimate.valid
    assert "fogsim calibrate signs" in str(estimate.diagnostics["reason"])
    assert math.isinf(estimate.visibility_interval[1])
