"""Sources of light, their branches and their halos, in pictures that FogSim did not draw."""

import math

import numpy as np
import pytest

from fogsim.vision.sources.halo_profile import UP, direction_of, half_of, halos_of, is_selected, source_tree
from fogsim.vision.sources.tree_kernels import AREA
from tests.vision.sources.night_pictures import in_colour, picture

TWO = ((80.0, 100.0, 4.0, 300.0), (220.0, 120.0, 6.0, 300.0))


def test_lamps_are_found_where_they_are() -> None:
    tree = source_tree(picture(TWO))
    assert len(tree) == 2
    assert np.array([tree.centres(one)[0] for one in range(2)]) == pytest.approx(np.array(TWO)[:, :2], abs=0.3)
    assert tree.nodes[0, :, AREA] == pytest.approx([math.pi * 16, math.pi * 36], rel=0.15)
    many = tuple((float(x), float(y), 2.5, 300.0) for x in range(0, 320, 20) for y in range(0, 240, 20))
    tree = source_tree(picture(many))
    assert len(tree) == 48
    assert np.isfinite([one.steepness for one in halos_of(tree)]).all()


def test_red_lamps_are_as_good_as_white_ones_and_more_bits_change_nothing() -> None:
    grey = picture(TWO, glow=20.0)
    steep = [one.steepness for one in halos_of(source_tree(grey))]
    red = in_colour(grey, (1.0, 0.1, 0.05))
    assert [one.steepness for one in halos_of(source_tree(red))] == steep
    assert [one.steepness for one in halos_of(source_tree(red.astype(np.uint16) << 4, 12))] == steep


def test_marks_lines_and_surfaces_are_no_sources() -> None:
    level = picture(TWO)
    level[200:203, 20:120] = 255  # a mark across
    level[130:230, 300:303] = 255  # and one along
    level[10:40, 10:40], level[14:36, 14:36] = 255, 60  # the rim of a sign
    level[60, 60] = 255  # a defective pixel
    tree = source_tree(level)
    assert sorted(tree.centres(one)[0][0].round() for one in range(len(tree))) == [80, 220]


def test_a_glow_is_less_steep_and_br50_is_height_over_width() -> None:
    clear, wide = (halos_of(source_tree(picture(TWO, glow=glow))) for glow in (0.0, 30.0))
    assert len(clear) == len(wide) == 2
    assert max(one.steepness for one in wide) < 15.0
    assert min(one.steepness for one in clear) > 60.0
    profile = np.concatenate((np.full(6, 255.0), 255.0 - 10.0 * np.arange(1, 25)))
    height, width = half_of(profile)
    assert height == pytest.approx(120.0)
    assert width == pytest.approx(12.0 - 0.51, abs=0.01)  # from 2 % below the top
    assert half_of(np.full(5, 255.0)) is None


def test_branches_grow_until_they_merge() -> None:
    near = source_tree(picture(((140.0, 120.0, 4.0, 260.0), (170.0, 120.0, 5.0, 260.0)), glow=8.0))
    assert len(near) == 2
    merged = near.merged_into
    assert sorted(merged.tolist()) in ([0, 0], [1, 1])
    last = int(near.last[0])
    assert last == near.last[1] < len(near.thresholds) - 1
    assert near.nodes[last + 1, 0, AREA] == near.nodes[last + 1, 1, AREA] > near.nodes[last, :, AREA].sum()
    areas = near.areas(0)
    assert (np.diff(areas) >= 0).all()
    left, right, top, bottom = near.box(0, last)
    assert left < near.centres(0)[0][0] < right
    assert top < near.centres(0)[0][1] < bottom
    level = picture(((100.0, 100.0, 4.0, 300.0),))
    level[96:200, 105:200] = 230  # a lit wall that touches the lamp
    tree = source_tree(level)
    assert tree.leaked[0]
    assert not is_selected(tree, 0)


def test_a_halo_points_where_its_centre_drifts() -> None:
    v, u = np.mgrid[:240, :320].astype(float)
    beyond = np.hypot(u - 160.0, v - 120.0)
    down = np.clip((v - 120.0) / np.maximum(beyond, 1.0), 0.0, 1.0)
    level = np.where(beyond < 5.0, 255.0, 8.0 + 230.0 * down * np.exp(-beyond / 30.0))
    tree = source_tree(level.astype(np.uint8))
    along = direction_of(tree, 0)
    assert along[1] == pytest.approx(1.0, abs=0.05)
    assert direction_of(source_tree(picture(((100.0, 100.0, 4.0, 300.0),))), 0) == UP


def test_pictures_without_lamps_say_why() -> None:
    assert "brightest pixel" in source_tree(picture(())).trouble
    assert "daylight, or saturated" in source_tree(np.full((120, 160), 250, np.uint8)).trouble
    road = picture(())
    road[100:103, 10:200] = 255
    assert "shape of a lamp" in source_tree(road).trouble
    assert halos_of(source_tree(road)) == ()
