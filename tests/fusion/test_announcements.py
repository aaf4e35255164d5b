"""Denser fog ahead is believed once several pictures tell of it, at places that fit together."""

import math

import pytest

from fogsim.fusion import make
from fogsim.values import DenserFog, Estimate, OpticalDepths

CURVE = OpticalDepths((10.0, 100.0), (0.02, 0.2), (0.01, 0.02))


def told(distance: float | None, valid: bool = True) -> Estimate:
    denser = None if distance is None else DenserFog(distance, 10.0, 0.05)
    if not valid:
        return Estimate.invalid("joint_road", "dark")
    return Estimate("joint_road", 0.002, 1e-4, optical_depths=CURVE, denser=denser)


def feed(distances, period=0.1, fusion=None):
    fusion = make("grid_filter") if fusion is None else fusion
    return [fusion.update([told(distance)], i * period).denser for i, distance in enumerate(distances)]


def test_a_bank_that_comes_nearer_is_announced_within_a_second():
    found = feed([None] * 10 + [200.0 - 3.0 * i for i in range(20)])
    assert found[:12] == [None] * 12
    first = next(i for i, one in enumerate(found) if one is not None)
    assert 14 <= first <= 20
    assert found[-1].distance == pytest.approx(200.0 - 3.0 * 19)


def test_single_pictures_announce_nothing():
    assert not any(feed([None, None, 150.0, None, None, None, None, 140.0, None, None, None] * 3))


def test_distances_that_do_not_fit_together_announce_nothing():
    assert not any(feed([300.0 if i % 2 else 60.0 for i in range(30)]))


def test_an_announcement_ends_when_pictures_no_longer_tell_of_it():
    found = feed([200.0] * 20 + [None] * 20)
    assert found[15] is not None
    assert found[-1] is None


def test_silent_methods_and_such_as_know_no_distances_do_not_count():
    fusion = make("grid_filter")
    for i in range(20):
        plain = Estimate("negru2013", 0.002, 1e-4)
        belief = fusion.update([plain, told(150.0), told(None, valid=False)], 0.1 * i)
    assert belief.denser is not None
    fusion.reset()
    assert fusion.update([told(150.0)], 0.0).denser is None


def test_an_estimate_that_saw_little_of_the_way_says_less():
    near = Estimate("joint_road", 0.01, 1e-4, reach=30.0)
    far = Estimate("joint_road", 0.01, 1e-4, reach=math.inf)
    spread = []
    for one in (near, far):
        low, high = make("grid_filter").update([one], 0.0).visibility_quantiles((0.25, 0.75))
        spread.append(math.log(high / low))
    assert spread[0] > 1.3 * spread[1]
