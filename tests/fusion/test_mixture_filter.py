"""The papers' own combination of measurements, by their printed equations."""

import math

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.fusion import make
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import Estimate


def seen(visibility: float) -> Estimate:
    k = OPTICAL_DEPTH_AT_VISIBILITY / visibility
    return Estimate("test", k, 0.1 * k)


def test_outliers_are_set_aside_by_three_clusters_and_not_by_one():
    beliefs = {}
    for clusters in (1, 3):
        fusion = make("mixture_filter", clusters=clusters)
        for i in range(20):
            beliefs[clusters] = fusion.update_at([seen(100.0 + i % 3 if i % 5 else 400.0)], float(i), 10.0 * i)
    assert beliefs[3].visibility == pytest.approx(101.0, rel=0.02)
    assert beliefs[1].visibility > 130.0


def test_weights_decay_with_way_and_time():
    for way in (0.0, 20.0):
        fusion = make("mixture_filter", clusters=1, decay_time=30.0, decay_distance=1e6 if way == 0.0 else 600.0)
        for i in range(11):
            belief = fusion.update_at([seen(100.0 if i < 10 else 200.0)], float(i), way * i)
        age = np.arange(10, -1, -1) / 30.0 + (way * np.arange(10, -1, -1) / 600.0 if way else 0.0)
        weights = np.exp(-age)
        expected = (weights * np.array([100.0] * 10 + [200.0])).sum() / weights.sum()
        assert belief.visibility == pytest.approx(expected, rel=0.02)


def test_what_is_old_is_dropped_and_nothing_known_is_anything():
    fusion = make("mixture_filter")
    fusion.update_at([seen(100.0)], 0.0, 0.0)
    later = fusion.update_at([Estimate.invalid("test", "dark"), Estimate("test", 0.0, 0.01)], 300.0, 0.0)
    assert later.probability == pytest.approx(1.0 / len(later.probability))
    assert later.profile is None


def test_measurements_of_one_method_are_taken_as_far_apart_as_is_asked():
    often, seldom = make("mixture_filter", spacing=0.0), make("mixture_filter", spacing=1.0)
    for i in range(10):
        told = [seen(100.0 if i else 300.0)]
        belief, sparse = (fusion.update_at(told, 0.1 * i, 0.0) for fusion in (often, seldom))
    assert belief.visibility < 150.0
    assert sparse.visibility == pytest.approx(300.0, rel=0.02)


def test_it_lags_behind_a_bank_where_the_grid_filter_does_not():
    mixture, grid = make("mixture_filter"), make("grid_filter")
    for i in range(400):
        told = [seen(400.0 if i < 350 else 60.0)]
        lagging, quick = mixture.update_at(told, 0.1 * i, 2.5 * i), grid.update(told, 0.1 * i)
    assert quick.visibility == pytest.approx(60.0, rel=0.1)
    assert lagging.visibility > 200.0


def test_impossible_instants_are_refused():
    for time, place in [(math.nan, 0.0), (0.0, math.inf), (-1.0, 0.0)]:
        fusion = make("mixture_filter")
        fusion.update_at([], 0.0, 0.0)
        with pytest.raises(InputError, match="mixture_filter"):
            fusion.update_at([], time, place)
