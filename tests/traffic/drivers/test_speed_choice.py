"""How fast drivers drive in fog, and how they follow advice; no simulation runs."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from fogsim.core.kinematics import safe_speed
from fogsim.errors import InputError
from fogsim.traffic.drivers.speed_choice import (
    COMPLIANCES,
    SPEED_CHOICES,
    Compliance,
    DriverSetup,
    DriverTraits,
    HeardAdvice,
    chosen_speed,
    complied_speed,
    desired_speed,
    driver_traits,
    observed,
    too_fast,
    unaffected,
    within_sight,
)
from fogsim.values import Display


def test_speed_choices() -> None:
    assert unaffected(30.0) == np.inf
    assert within_sight(50.0) * 3.6 == pytest.approx(42.5, abs=0.05)
    assert too_fast(200.0) == np.inf
    assert too_fast(100.0) == pytest.approx(1.4 * within_sight(100.0))
    assert {"observed", "unaffected", "too_fast", "within_sight"} <= set(SPEED_CHOICES)


@pytest.mark.parametrize(
    ("make", "wrong"),
    [
        (lambda: DriverSetup(spread=-0.1), "spread must be a number 0 … 1, got -0.1"),
        (lambda: DriverSetup(misjudgement=math.nan), "misjudgement must be a number 0 … 10, got nan"),
        (lambda: DriverSetup("too_fast"), "speed_choice must be callable, got 'too_fast'"),
        (lambda: DriverSetup(following={"carefull": 1.0}), "unknown following model 'carefull'.*careful"),
        (lambda: DriverSetup(following={"careful": 0.5}), "following: shares must together be 1, and are 0.5"),
        (lambda: Compliance(rate=1.5), "rate must be a number 0 … 1, got 1.5"),
        (lambda: Compliance(delay=-1.0), "delay must be a number ≥ 0 s, got -1.0"),
    ],
)
def test_drivers_that_cannot_be_are_refused(make: Callable[[], object], wrong: str) -> None:
    with pytest.raises(InputError, match=wrong):
        make()


KMH = 3.6


def test_observed_speeds_are_the_published_ones() -> None:
    """A motorway whose drivers want 112 km/h; sources in `ObservedSpeed`."""
    own = 112.0 / KMH

    def speed(visibility: float) -> float:
        return chosen_speed(observed, 1.0, own, visibility) * KMH

    assert speed(200.0) == speed(np.inf) == pytest.approx(112.0)  # LR958: unaffected down to 200 m
    assert speed(30.0) == pytest.approx(29.0, rel=0.03)  # A16 without signs, below 35 m: 29 km/h
    assert speed(100.0) / 112.0 == pytest.approx(0.9, abs=0.02)  # SHRP2, near fog: -10 %
    assert speed(150.0) / 112.0 == pytest.approx(0.97, abs=0.01)  # SHRP2, distant fog: -3 %
    assert speed(50.0) == pytest.approx(2.0 * within_sight(50.0) * KMH, rel=0.1)  # I-77: twice the safe speed
    overdriving = {v: speed(v) / (within_sight(v) * KMH) for v in (20.0, 30.0, 40.0, 50.0, 60.0, 100.0, 150.0)}
    assert max(overdriving, key=overdriving.__getitem__) in {40.0, 50.0, 60.0, 100.0}  # Hogema & van der Horst 1994


def test_more_than_half_overdrive_what_they_see_at_50_m() -> None:
    """TRL SR281; the Highway Code's stopping distance has 0.67 s and 6.57 m/s²."""
    setup = DriverSetup()
    factors = [driver_traits(setup, f"vehicle {i}", 2).speed_factor for i in range(2000)]
    speeds = [chosen_speed(observed, factor, 112.0 / KMH, 50.0) for factor in factors]
    assert np.mean(np.array(speeds) > safe_speed(50.0, 0.67, 6.57)) > 0.5
    # And down to 150 m most can stop (LR958).
    at_150 = [chosen_speed(observed, factor, 112.0 / KMH, 150.0) for factor in factors]
    assert np.mean(np.array(at_150) < safe_speed(150.0, 0.67, 6.57)) > 0.9


def test_in_a_town_they_slow_down_too() -> None:
    """By a share of their own speed, from 200 m on; up to 18 % (Pretto et al. 2012) before sight limits it."""
    own = 50.0 / KMH
    speeds = [chosen_speed(observed, 1.0, own, visibility) for visibility in (200.0, 150.0, 100.0, 60.0, 40.0, 30.0)]
    assert speeds[0] == own
    assert all(np.diff(speeds) < 0.0)
    assert speeds[4] / own == pytest.approx(0.83, abs=0.01)
    assert chosen_speed(too_fast, 1.0, own, 60.0) == own  # which a choice that is not relative does not tell


def told(speed: float, since: float = 10.0) -> tuple[HeardAdvice, ...]:
    """Advice in the car, for longer than it takes to answer."""
    return (HeardAdvice(Display.IN_CAR, speed, since),)


def test_drivers_advised_30_mph_who_drive_61_can_be_represented() -> None:
    """The field result: advice of 30 mph, mean speed 61 mph; with 65 mph unadvised that is a strength of 4 in 35."""
    mph = 0.44704
    strength = (65 - 61) / (65 - 30)
    assert complied_speed(65 * mph, 30 * mph, strength) == pytest.approx(61 * mph)
    assert complied_speed(65 * mph, 30 * mph, 1.0) == pytest.approx(30 * mph)
    assert complied_speed(65 * mph, 30 * mph, 0.0) == pytest.approx(65 * mph)
    assert complied_speed(20 * mph, 30 * mph, 1.0) == pytest.approx(20 * mph)  # nobody is advised to go faster


def test_measured_compliances_give_what_was_measured() -> None:
    """Means over a population, in kinds of advice of `COMPLIANCES`; sources there."""

    def mean(kind: str, own: float, advised: float, visibility: float) -> float:
        setup = DriverSetup(unaffected, compliance=COMPLIANCES[kind])
        drivers = [driver_traits(setup, f"vehicle {i}", 1) for i in range(2000)]
        return float(np.mean([desired_speed(setup, d, own, visibility, told(advised)) for d in drivers]))

    mph = 0.44704
    # CAWS: 61 mph where 30 mph are advised, 1.1 mph less than without.
    assert mean("advisory_sign", 62.1 * mph, 30.0 * mph, 50.0) == pytest.approx(61.0 * mph, rel=0.005)
    # A16: 8 to 10 km/h less by a limit of 80 km/h; where drivers would drive 95 without.
    assert 8.0 < 95.0 - mean("speed_limit_sign", 95.0 / KMH, 80.0 / KMH, 100.0) * KMH < 10.0
    assert mean("full", 95.0 / KMH, 80.0 / KMH, 100.0) == pytest.approx(80.0 / KMH)
    # By vehicles that are equipped alone.
    assert 95.0 - mean("vehicle_to_vehicle", 95.0 / KMH, 80.0 / KMH, 100.0) * KMH == pytest.approx(
        0.3 * (95.0 - mean("in_car", 95.0 / KMH, 80.0 / KMH, 100.0) * KMH), rel=0.08
    )


def test_who_trusts_a_sign_takes_its_speed_for_safe() -> None:
    """A16 below 35 m: 29 km/h without signs, 60 km/h with signs that say 60."""
    setup = DriverSetup(spread=0.0, compliance=replace(COMPLIANCES["speed_limit_sign"], rate=1.0))
    driver, own = DriverTraits(1.0), 112.0 / KMH
    assert desired_speed(setup, driver, own, 30.0) * KMH == pytest.approx(29.0, rel=0.03)
    assert desired_speed(setup, driver, own, 30.0, told(60.0 / KMH)) * KMH == pytest.approx(60.0)
    assert desired_speed(setup, driver, 12.0, 30.0, told(60.0 / KMH)) == 12.0  # but not faster than in clear air
    distrusting = replace(setup, compliance=Compliance())
    assert desired_speed(distrusting, driver, own, 30.0, told(60.0 / KMH)) * KMH == pytest.approx(29.0, rel=0.03)


def test_a_driver_desires_the_least_of_own_speed_choice_and_advice() -> None:
    setup, driver = DriverSetup(within_sight, spread=0.0), DriverTraits(1.2)
    chosen = 1.2 * within_sight(60.0)
    assert desired_speed(setup, driver, 40.0, math.inf) == 40.0
    assert desired_speed(setup, driver, 40.0, 60.0) == pytest.approx(chosen)
    assert desired_speed(setup, driver, 40.0, 60.0, told(8.0, 1.0)) == pytest.approx(chosen)  # within the delay
    assert desired_speed(setup, driver, 40.0, 60.0, told(8.0, 3.0)) == 8.0
    assert desired_speed(setup, DriverTraits(1.2, moved_from=1.0), 40.0, 60.0, told(8.0)) == pytest.approx(chosen)
    foreseeing = DriverSetup(unaffected, compliance=Compliance(foreseen=0.25))  # believes less before the fog is seen
    assert desired_speed(foreseeing, DriverTraits(1.0), 30.0, math.inf, told(20.0)) == pytest.approx(27.5)
    assert desired_speed(foreseeing, DriverTraits(1.0), 30.0, 100.0, told(20.0)) == pytest.approx(20.0)


def test_traits_depend_on_nothing_but_seed_and_id_and_have_the_spread_that_is_asked_for() -> None:
    setup = DriverSetup(spread=0.2, compliance=Compliance(reached_share=0.5, rate=0.8))
    drawn = [driver_traits(setup, f"vehicle {i}", 1) for i in range(4000)]
    assert driver_traits(setup, "vehicle 7", 1) == drawn[7]
    assert driver_traits(setup, "vehicle 7", 2) != drawn[7]
    logarithms = np.log([traits.speed_factor for traits in drawn])
    assert (np.mean(logarithms), np.std(logarithms)) == (pytest.approx(0.0, abs=0.02), pytest.approx(0.2, rel=0.05))
    assert np.mean([traits.follows(setup.compliance) for traits in drawn]) == pytest.approx(0.4, abs=0.02)


def test_who_follows_depends_on_where_it_is_heard_and_the_drivers_stay_the_same() -> None:
    by_display = {Display.MESSAGE_SIGN: Compliance(rate=0.3), Display.IN_CAR: Compliance(rate=0.9, strength=0.5)}
    setup = DriverSetup(unaffected, compliance_by_display=by_display)
    heard = {display: (HeardAdvice(display, 20.0, 10.0),) for display in Display}
    slow = {display: set[int]() for display in Display}
    for i in range(1000):
        driver = driver_traits(setup, f"vehicle {i}", 1)
        for display, advice in heard.items():
            if desired_speed(setup, driver, 30.0, 100.0, advice) < 30.0:
                slow[display].add(i)
    assert slow[Display.MESSAGE_SIGN] < slow[Display.IN_CAR] < slow[Display.LAW]
    assert [len(slow[display]) for display in Display] == [pytest.approx(n, abs=40) for n in (300, 900, 1000)]
    # Of several that are followed, what makes a driver slowest counts.
    both = (*heard[Display.MESSAGE_SIGN], HeardAdvice(Display.IN_CAR, 15.0, 10.0))
    assert desired_speed(setup, DriverTraits(1.0), 30.0, 100.0, both) == pytest.approx(20.0)
    assert desired_speed(setup, DriverTraits(1.0, moved_from=0.5), 30.0, 100.0, both) == pytest.approx(22.5)
