import math
from dataclasses import replace

import numpy as np
import pytest

from fogsim.vision.vehicle.patch import Patch, PixelGrid, Placement, downsample_to
from fogsim.vision.vehicle.registration import PlacementPrior, RoadBehind, coarse_placement, register

SKY = 200.0
RNG = np.random.default_rng(11)
BLOCKS = np.kron(RNG.uniform(20.0, 160.0, (10, 11)), np.ones((6, 6)))
NEAR = Patch(BLOCKS, 32.3, 29.1, 24.0, 22.0)


def far_patch(at: Placement, left: float, noise: float = 0.0) -> Patch:
    """The near patch seen from farther, through fog that leaves a share of its contrast."""
    grid = PixelGrid(np.arange(44.0), np.arange(46.0), np.zeros((44, 46)))
    shown = SKY - left * (SKY - downsample_to(NEAR, grid, at))
    return Patch(shown + np.random.default_rng(1).normal(0.0, noise, shown.shape), 22.0, 21.0, 12.0, 11.0)


def prior(at: Placement, across: float = 0.0, down: float = 0.0, scale: float = 1.0) -> PlacementPrior:
    return PlacementPrior(Placement(at.column + across, at.row + down, at.scale * scale), 3.0, 3.0, 0.05)


@pytest.mark.parametrize(("across", "down", "scale"), [(0.0, 0.0, 1.0), (1.7, -2.2, 1.0), (-2.4, 0.6, 1.02)])
@pytest.mark.parametrize("left", [0.8, 0.25])
def test_register_returns_place_size_and_contrast_that_were_put_in(across, down, scale, left):
    at = Placement(22.4, 21.3, 0.55)
    found = register(NEAR, far_patch(at, left), prior(at, across, down, scale), 0.05)
    assert found.placement.column == pytest.approx(at.column, abs=0.05)
    assert found.placement.row == pytest.approx(at.row, abs=0.05)
    assert found.placement.scale == pytest.approx(at.scale, rel=0.004)
    assert found.slope == pytest.approx(left, rel=0.01)


def test_noise_is_in_the_deviation_and_takes_nothing_from_the_slope():
    at = Placement(22.0, 21.0, 0.6)
    found = register(replace(NEAR, luminance=BLOCKS), far_patch(at, 0.5, noise=3.0), prior(at), 3.0)
    assert abs(found.slope - 0.5) < 3.0 * found.slope_deviation
    assert found.noise_deviation == pytest.approx(3.0 / math.sqrt(found.pixels) / BLOCKS.std(), rel=0.5)


def test_coarse_placement_moves_by_whole_pixels():
    at = Placement(22.4, 21.3, 0.55)
    found = coarse_placement(NEAR, far_patch(at, 0.5), prior(at, 2.0, -3.0))
    assert (found.column, found.row, found.scale) == pytest.approx((at.column, at.row, at.scale))
    at = Placement(22.0, 21.0, 0.55)
    even = replace(NEAR, luminance=np.full_like(BLOCKS, 90.0))
    assert coarse_placement(even, far_patch(at, 0.5), prior(at)) is None
    assert register(even, far_patch(at, 0.5), prior(at), 1.0) is None
    lost = register(NEAR, replace(far_patch(at, 0.0), luminance=np.full((44, 46), SKY)), prior(at, 1.0), 1.0)
    assert lost.placement == prior(at, 1.0).placement
    assert lost.slope == pytest.approx(0.0, abs=1e-9)


def test_road_behind_fades_as_its_range_says():
    behind = RoadBehind(mount_height=1.4, ratio=0.3)
    # A line of sight at half the camera's height ends twice as far, and one at the camera's height never.
    found = behind.contrast_ratio(np.array([0.0, 0.7, 0.7 / 1.5, 1.4, 2.0]))
    assert found == pytest.approx([1.0, 0.3, 0.3**0.5, 0.3**9, 0.3**9])
