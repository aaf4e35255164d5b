"""Foggy roads that FogSim's own renderer did not draw, for all tests of estimators."""

from functools import lru_cache

import numpy as np
import pytest
from flat_road import Road, photograph, scan


def render_grey(road: Road, seed: int = 0, samples: int = 2) -> np.ndarray:
    """One 8-bit image, the caller's own."""
    return drawn(road, seed, samples).copy()


@lru_cache(maxsize=256)
def drawn(road: Road, seed: int, samples: int) -> np.ndarray:
    """The image: many methods look at the same roads."""
    return photograph(road, scan(road, seed, samples), seed)


@pytest.fixture(scope="session")
def render():
    """Function from a road and a seed to an 8-bit grey image."""
    return render_grey


@pytest.fixture(scope="session")
def road():
    """The road as it is if nothing is said."""
    return Road()
