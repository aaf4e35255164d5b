"""The front of a bank is the row from which on ground is airlight; in even fog there is none."""

import math

import numpy as np
import pytest

from fogsim.values import Camera
from fogsim.vision.light.luminance import linear_pixels
from fogsim.vision.strips.joint_fit import JointFit
from fogsim.vision.strips.sky import Sky
from fogsim.vision.strips.strip_geometry import strip_geometry
from fogsim.vision.uneven.uneven_fit import airlight_edge, even_fog

CAMERA = Camera(640, 480, 577.0, (319.5, 239.5), 1.38, math.radians(2.0))
GEOMETRY = strip_geometry(CAMERA, 1.0)
AIRLIGHT, GROUND = 180.0, 40.0
SKY = Sky(AIRLIGHT, 1.0, 1.0, 1.0, 0.0, 0.0)


def drawn(k: float, bank: float = math.inf, dense: float = 0.05, trees: float = 0.5, seed: int = 0):
    """Flat ground under a sky; trees hide a share of the columns about the horizon."""
    rng = np.random.default_rng(seed)
    below = np.arange(480) - CAMERA.horizon_row
    distance = CAMERA.row_distance / np.maximum(below, 1e-6)
    depth = k * distance + dense * np.maximum(distance - bank, 0.0)
    depth[below <= 0] = math.inf
    rows = AIRLIGHT + (GROUND - AIRLIGHT) * np.exp(-depth)
    image = np.repeat(rows[:, None], 640, axis=1)
    hidden = rng.random(640) < trees
    about = np.abs(below) < 12
    image[np.ix_(about, hidden)] = 70.0
    noisy = image + rng.normal(0.0, 1.0, image.shape)
    return linear_pixels(np.clip(np.rint(noisy), 0, 255).astype(np.uint8), CAMERA)


def fitted(k: float):
    used = np.ones((3, GEOMETRY.first.size), bool)
    used[:, GEOMETRY.distance > 180.0] = False
    fit = JointFit(k, 0.02 * k, AIRLIGHT, 0.0, GROUND, 1.0, used, np.zeros(GEOMETRY.first.size, bool))
    return even_fog(fit, GEOMETRY)


@pytest.mark.parametrize(("bank", "trees"), [(130.0, 0.0), (180.0, 0.6), (240.0, 0.0), (240.0, 0.6)])
def test_a_bank_is_found_where_it_begins(bank, trees):
    image = drawn(0.0015, bank, trees=trees)
    place, deviation, extinction = airlight_edge(image, GEOMETRY, CAMERA, SKY, fitted(0.0015), 0.2)
    # Nothing but airlight is left 55 m inside, and the next row that shows it may be much farther.
    assert bank < place < bank + 55.0 + 2.0 * deviation
    assert 2.5 * 0.0015 < extinction <= 0.06


@pytest.mark.parametrize(("k", "seed"), [(0.0, 0), (0.0015, 1), (0.006, 2), (0.02, 0), (0.06, 1)])
def test_even_fog_has_no_front(k, seed):
    assert airlight_edge(drawn(k, seed=seed), GEOMETRY, CAMERA, SKY, fitted(k), 0.2) is None


def test_what_stands_all_along_the_horizon_or_a_clipped_sky_tells_of_none():
    hidden = drawn(0.0015, 150.0, trees=0.9)
    assert airlight_edge(hidden, GEOMETRY, CAMERA, SKY, fitted(0.0015), 0.2) is None
    clipped = Sky(AIRLIGHT, 1.0, 1.0, 1.0, 0.5, 0.5)
    assert airlight_edge(drawn(0.0015, 150.0), GEOMETRY, CAMERA, clipped, fitted(0.0015), 0.2) is None


def test_an_unsure_horizon_and_a_crest_hide_fronts():
    seen = drawn(0.0015, 240.0)
    assert airlight_edge(seen, GEOMETRY, CAMERA, SKY, fitted(0.0015), 0.2) is not None
    assert airlight_edge(seen, GEOMETRY, CAMERA, SKY, fitted(0.0015), 2.0) is None
    hidden = GEOMETRY.distance > 90.0
    below, distance = np.where(hidden, 1.2, GEOMETRY.below), np.where(hidden, 664.0, GEOMETRY.distance)
    crest = GEOMETRY._replace(below=below, distance=distance)
    assert airlight_edge(drawn(0.0015, 130.0), crest, CAMERA, SKY, fitted(0.0015), 0.05) is None


def test_a_horizon_lower_than_stated_is_no_front_where_the_road_seems_to_rise():
    flat = drawn(0.004, trees=0.0)
    lower = flat._replace(pixels=np.roll(flat.pixels, 1, axis=0))
    rising = GEOMETRY._replace(below=np.hypot(GEOMETRY.below, 2.0))
    assert airlight_edge(lower, rising, CAMERA, SKY, fitted(0.004), 0.3) is None
