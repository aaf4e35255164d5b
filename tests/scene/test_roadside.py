"""Stations along lines, places that keep a distance, and copies that stand there."""

import math

import numpy as np
import pytest

from fogsim.scene.roadside import Spacing, placed, stations


def test_stations_on_a_circle_lie_on_a_parallel_at_even_angles() -> None:
    angle = np.linspace(0.0, math.pi, 2001)
    circle = np.column_stack((100 * np.cos(angle), 100 * np.sin(angle), np.full(len(angle), 3.0)))
    places, heading = stations(circle, 10.0, -5.0)
    assert np.hypot(places[:, 0], places[:, 1]) == pytest.approx(105.0, abs=1e-3)
    assert places[:, 2] == pytest.approx(3.0)
    assert len(places) == round(100 * math.pi / 10)
    assert np.diff(np.arctan2(places[:, 1], places[:, 0])) == pytest.approx(0.1, abs=1e-4)
    around = np.arctan2(places[:, 1], places[:, 0]) + 0.5 * math.pi
    assert np.cos(heading - around) == pytest.approx(1.0, abs=1e-5)


def test_places_that_are_taken_keep_their_distance_and_fill_the_room() -> None:
    rng, spacing = np.random.default_rng(4), Spacing(5.0)
    places = rng.uniform(-40.0, 40.0, (3000, 2))
    taken = np.array([place for place in places if spacing.takes(place)])
    between = np.linalg.norm(taken[:, None] - taken, axis=2) + 100.0 * np.eye(len(taken))
    assert between.min() > 5.0
    # Nothing that was refused had room.
    assert np.linalg.norm(places[:, None] - taken, axis=2).min(axis=1).max() <= 5.0


def test_a_copy_is_scaled_then_turned_then_placed() -> None:
    batch = placed("post", np.array([[1.0, 2.0, 3.0]]), np.array([0.5 * math.pi]), np.array([[2.0, 3.0, 4.0]]))
    corner = batch.transforms[0] @ np.array([1.0, 1.0, 1.0, 1.0], np.float32)
    assert corner == pytest.approx([1.0 - 3.0, 2.0 + 2.0, 3.0 + 4.0, 1.0], abs=1e-6)
