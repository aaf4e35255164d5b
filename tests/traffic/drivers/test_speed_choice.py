"""How fast drivers drive in fog, and how they follow advice; no simulation runs."""

import math

import numpy as np
import pytest

from fogsim.traffic.drivers.speed_choice import (
    SPEED_CHOICES,
    Compliance,
    DriverSetup,
    DriverTraits,
    complied_speed,
    desired_speed,
    driver_traits,
    perceived_distance_factor,
    too_fast,
    unaffected,
    within_sight,
)


def test_speed_choices() -> None:
    assert unaffected(30.0) == np.inf
    assert within_sight(50.0) * 3.6 == pytest.approx(42.5, abs=0.05)
    assert too_fast(200.0) == np.inf
    assert too_fast(100.0) == pytest.approx(1.4 * within_sight(100.0))
    assert {"unaffected", "too_fast", "within_sight"} <= set(SPEED_CHOICES)


def test_distances_seem_longer_in_dense_fog() -> None:
    """Cavallo, Colomb & Doré 2001: up to 60 % at night in the densest fog."""
    assert perceived_distance_factor(20.0, 0.6) == pytest.approx(1.6)
    assert perceived_distance_factor(90.0, 0.6) == pytest.approx(1.3)
    assert perceived_distance_factor(500.0, 0.6) == 1.0


def test_drivers_advised_30_mph_who_drive_61_can_be_represented() -> None:
    """The field result: advice of 30 mph, mean speed 61 mph; with 65 mph unadvised that is a strength of 4 in 35."""
    mph = 0.44704
    strength = (65 - 61) / (65 - 30)
    assert complied_speed(65 * mph, 30 * mph, strength) == pytest.approx(61 * mph)
    assert complied_speed(65 * mph, 30 * mph, 1.0) == pytest.approx(30 * mph)
    assert complied_speed(65 * mph, 30 * mph, 0.0) == pytest.approx(65 * mph)
    assert complied_speed(20 * mph, 30 * mph, 1.0) == pytest.approx(20 * mph)  # nobody is advised to go faster


def test_a_driver_desires_the_least_of_own_speed_choice_and_advice() -> None:
    setup, driver = DriverSetup("within_sight", spread=0.0), DriverTraits(1.2, follows_advice=True)
    chosen = 1.2 * within_sight(60.0)
    assert desired_speed(setup, driver, 40.0, math.inf) == 40.0
    assert desired_speed(setup, driver, 40.0, 60.0) == pytest.approx(chosen)
    assert desired_speed(setup, driver, 40.0, 60.0, 8.0, advised_for=1.0) == pytest.approx(chosen)  # within the delay
    assert desired_speed(setup, driver, 40.0, 60.0, 8.0, advised_for=3.0) == 8.0
    assert desired_speed(setup, DriverTraits(1.2, follows_advice=False), 40.0, 60.0, 8.0, 3.0) == pytest.approx(chosen)


def test_traits_depend_on_nothing_but_seed_and_id_and_have_the_spread_that_is_asked_for() -> None:
    setup = DriverSetup(spread=0.2, compliance=Compliance(reached_share=0.5, rate=0.8))
    drawn = [driver_traits(setup, f"vehicle {i}", 1) for i in range(4000)]
    assert driver_traits(setup, "vehicle 7", 1) == drawn[7]
    assert driver_traits(setup, "vehicle 7", 2) != drawn[7]
    logarithms = np.log([traits.speed_factor for traits in drawn])
    assert (np.mean(logarithms), np.std(logarithms)) == (pytest.approx(0.0, abs=0.02), pytest.approx(0.2, rel=0.05))
    assert np.mean([traits.follows_advice for traits in drawn]) == pytest.approx(0.4, abs=0.02)
