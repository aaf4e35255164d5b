"""Which droplets a fog has, learnt over the way."""

import numpy as np
import pytest

from fogsim.vision.strips.airlight_slopes import DROPLET_CHANCES, LASTS, MOST, OTHER_ROAD, DropletMemory

LARGE = (-2.0, -1.0, 0.0)
"""What a picture says of droplets that are large."""


def learnt(*pictures, speed=20.0, period=1.0):
    """Chances after pictures."""
    memory = DropletMemory()
    for number, picture in enumerate(pictures):
        memory.learn(picture, number * period, speed)
    return memory.chances


def test_before_and_after_pictures_that_say_nothing_chances_are_those_beforehand():
    assert DropletMemory().chances == pytest.approx(DROPLET_CHANCES)
    assert learnt((), (), ()) == pytest.approx(DROPLET_CHANCES)
    assert learnt(*[(0.0, 0.0, 0.0)] * 5) == pytest.approx(DROPLET_CHANCES)


def test_a_picture_counts_by_the_road_in_it_that_is_new():
    standing = learnt(*[LARGE] * 50, speed=0.0)
    assert standing == pytest.approx(DROPLET_CHANCES)
    far = learnt(LARGE, LARGE, speed=2.0 * OTHER_ROAD)
    expected = np.array(DROPLET_CHANCES) * np.exp(LARGE)
    assert far == pytest.approx(expected / expected.sum(), rel=0.2)
    # As often as one likes: the way decides.
    often, seldom = learnt(*[LARGE] * 101, period=0.05), learnt(*[LARGE] * 6, period=1.0)
    assert often == pytest.approx(seldom, abs=0.02)


def test_over_a_way_pictures_overrule_what_is_usual_and_one_alone_cannot():
    assert learnt(*[LARGE] * 12)[2] > 0.9
    alone = learnt(LARGE, (0.0, -50.0, -90.0), speed=2.0 * OTHER_ROAD)
    assert alone[1] / alone[0] >= DROPLET_CHANCES[1] / DROPLET_CHANCES[0] * np.exp(-MOST) * 0.9


def test_what_was_learnt_is_forgotten_over_the_way():
    memory = DropletMemory()
    for number in range(20):
        memory.learn(LARGE, float(number), 20.0)
    memory.learn((0.0, 0.0, 0.0), 20.0 + 10.0 * LASTS / 20.0, 20.0)
    assert memory.chances == pytest.approx(DROPLET_CHANCES, abs=0.01)
