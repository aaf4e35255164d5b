"""How early dense fog was known, and what other equipped vehicles believed: figures by hand."""

import dataclasses
import math

import numpy as np
import pytest

from fogsim.units import extinction_from_visibility
from fogsim.values import EquippedVehicle, FogProfile, Lamp, SpeedAdvice, Step
from tests.metrics.summaries import summarise
from tests.recorders.synthetic import belief, make_step

BANK = 1000.0
PLACES = np.arange(-300.0, 1001.0, 10.0)


def before_bank(
    index: int, place: float, believed: float | None, everywhere: float = 800.0, length: float = math.inf
) -> Step:
    """A step at a place before a bank of 60 m, of which a visibility is believed; none if no places are known."""
    at = place + PLACES

    def profile(in_bank: float, outside: float, deviation: float) -> FogProfile:
        visibility = np.where((at >= BANK) & (at < BANK + length), in_bank, outside)
        logarithms = np.array([math.log(extinction_from_visibility(one)) for one in visibility])
        return FogProfile(PLACES, logarithms, np.full(PLACES.size, deviation))

    here = 60.0 if BANK <= place < BANK + length else 800.0
    step = make_step(index, time=float(index), route_position=place, visibility=here, believed=belief(everywhere, 0.1))
    known = None if believed is None else profile(believed, 800.0, 0.1)
    return dataclasses.replace(
        step,
        belief=dataclasses.replace(step.belief, profile=known),
        truth=dataclasses.replace(step.truth, profile=profile(60.0, 800.0, 0.0)),
    )


def known_before(*believed: tuple[float, float | None, float]) -> object:
    """What the metric says of steps at places, with what is believed of the bank, and of everywhere."""
    steps = [before_bank(i, place, in_bank, everywhere) for i, (place, in_bank, everywhere) in enumerate(believed)]
    return summarise(steps)["dense_fog_known_before_m"]


def test_a_bank_is_known_from_where_it_was_believed_and_stayed_so():
    way = [(400.0, 800.0), (500.0, 100.0), (600.0, 800.0), (700.0, 90.0), (900.0, 60.0), (1100.0, 60.0), (1310.0, 60.0)]
    assert known_before(*((place, in_bank, 800.0) for place, in_bank in way)) == pytest.approx(300.0, abs=11.0)


def test_a_short_bank_that_was_known_stays_so_behind_it():
    steps = [before_bank(i, place, 60.0, length=150.0) for i, place in enumerate((600.0, 1010.0, 1160.0, 1320.0))]
    assert summarise(steps)["dense_fog_known_before_m"] == pytest.approx(400.0, abs=11.0)


def test_who_knows_no_places_knows_it_when_inside():
    way = [(700.0, 800.0), (950.0, 800.0), (1050.0, 200.0), (1200.0, 70.0), (1310.0, 60.0)]
    assert known_before(*((place, None, everywhere) for place, everywhere in way)) == pytest.approx(-50.0, abs=11.0)


def test_nothing_is_said_without_dense_fog_or_of_a_run_that_ends_in_it():
    assert known_before((700.0, 100.0, 800.0), (1100.0, 60.0, 60.0)) is None
    assert summarise([make_step(0, visibility=400.0)])["dense_fog_known_before_m"] is None
    missed = [(700.0, None, 800.0), (1200.0, None, 800.0), (1320.0, None, 800.0)]
    assert known_before(*missed) == pytest.approx(-300.0)


def test_beliefs_of_other_equipped_vehicles_are_judged_in_fog():
    def equipped(believed: float, true: float) -> EquippedVehicle:
        k = extinction_from_visibility(true)
        return EquippedVehicle("a", 0.0, k, k, (), belief(believed, 0.05), SpeedAdvice(), Lamp.NONE)

    others = [(equipped(110.0, 100.0), equipped(100.0, 100.0)), (equipped(200.0, 100.0), equipped(100.0, 3000.0)), ()]
    summary = summarise(
        dataclasses.replace(make_step(i, time=float(i)), equipped=seen) for i, seen in enumerate(others)
    )
    assert summary["equipped_vehicles_mean"] == pytest.approx(4.0 / 3.0)
    assert summary["equipped_belief_median_error_percent"] == pytest.approx(10.0, abs=1.0)
    assert summary["equipped_belief_coverage_share"] == pytest.approx(1.0 / 3.0)
    assert summarise([make_step()])["equipped_belief_median_error_percent"] is None
