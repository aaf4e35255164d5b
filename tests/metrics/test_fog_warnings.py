"""Leads of fog warnings, false ones and shares of the time: figures by hand."""

import dataclasses

import numpy as np
import pytest

from fogsim.metrics.estimation.belief_ahead import FogWarnings
from fogsim.metrics.metric import JsonValue
from fogsim.units import extinction_from_visibility
from fogsim.values import DriverWarning, FogBank, FogField, FogProfile, Step
from fogsim.values.belief import THINNEST
from tests.metrics.summaries import summarise
from tests.recorders.synthetic import make_step

INSIDE = extinction_from_visibility(60.0)
BANK = FogBank((0.0, 0.0), (1.0, 0.0), 1000.0, 1500.0, 100.0, INSIDE)
PLACES = np.arange(-200.0, 1001.0, 25.0)
FOG, SEE, CAMERA = DriverWarning.FOG_AHEAD, DriverWarning.CANNOT_SEE, DriverWarning.CAMERA_DEGRADED


def at(
    index: int,
    place: float,
    warning: DriverWarning | None = None,
    *,
    bank: FogBank | None = BANK,
    outside: float = 20_000.0,
    speed: float = 30.0,
) -> Step:
    """A step at a place of a road that goes east, with a warning in force; a step takes 10 s."""
    thin = extinction_from_visibility(outside)
    along = place + PLACES
    in_bank = np.zeros(PLACES.size, bool) if bank is None else (along >= bank.start) & (along <= bank.end)
    extinctions = np.where(in_bank, thin + (0.0 if bank is None else bank.extra_extinction), thin)
    logarithms = np.log(np.maximum(extinctions, THINNEST))
    step = make_step(index, time=10.0 * index, route_position=place, visibility=3.0 / thin, speed=speed)
    here = float(extinctions[np.searchsorted(PLACES, 0.0)])
    truth = dataclasses.replace(
        step.truth,
        extinction=here,
        extinction_ahead=here,
        fog=FogField(thin, (1.0, 1.0, 1.0), banks=() if bank is None else (bank,)),
        profile=FogProfile(PLACES, logarithms, np.zeros(PLACES.size)),
    )
    command = dataclasses.replace(step.command, warning=warning)
    return dataclasses.replace(step, truth=truth, command=command, speed_limit=36.0)


def found(*steps: Step) -> dict[str, JsonValue]:
    values = summarise(steps)
    return {key: values[key] for key in FogWarnings.definitions}


def test_the_lead_counts_from_the_first_warning_to_half_the_density():
    way = [(500.0, None), (700.0, FOG), (850.0, None), (950.0, FOG), (1000.0, FOG), (1100.0, FOG)]
    values = found(*(at(i, place, warning) for i, (place, warning) in enumerate(way)))
    assert values["fog_warning_lead_m"] == pytest.approx(300.0)
    assert (values["fog_banks_entered"], values["fog_banks_without_warning"]) == (1, 0)
    assert values["false_fog_warnings"] == 0
    assert values["fog_ahead_time_share"] == pytest.approx(0.8)


def test_a_warning_inside_is_none_before_it_and_one_of_long_ago_is_another_bank_s():
    inside = found(at(0, 900.0), at(1, 1000.0), at(2, 1050.0, FOG))
    assert (inside["fog_warning_lead_m"], inside["fog_banks_without_warning"]) == (0.0, 1)
    far = dataclasses.replace(BANK, start=2000.0, end=2500.0)
    way = [(900.0, FOG), (950.0, None), (1900.0, FOG), (2000.0, None)]
    long_ago = found(*(at(i, place, warning, bank=far) for i, (place, warning) in enumerate(way)))
    assert long_ago["fog_warning_lead_m"] == pytest.approx(100.0)
    assert long_ago["false_fog_warnings"] == 1


def test_banks_in_which_one_can_stop_in_sight_do_not_count():
    thin = dataclasses.replace(BANK, extra_extinction=extinction_from_visibility(500.0))
    clearing = dataclasses.replace(BANK, extra_extinction=-0.001)
    for bank in (thin, clearing, None):
        values = found(at(0, 900.0, bank=bank, outside=2000.0), at(1, 1050.0, bank=bank, outside=2000.0))
        assert (values["fog_banks_entered"], values["fog_warning_lead_m"]) == (0, None)
    # Nor does one in which the run begins.
    assert found(at(0, 1010.0), at(1, 1100.0))["fog_banks_entered"] == 0


def test_false_warnings_are_those_without_reason():
    for place, outside, speed, false in [
        (480.0, 20_000.0, 30.0, 1),  # 520 m before the bank
        (525.0, 20_000.0, 30.0, 0),  # 475 m before it
        (3000.0, 20_000.0, 30.0, 1),  # clear air
        (3000.0, 200.0, 30.0, 0),  # 208 m to stop
        (3000.0, 200.0, 25.0, 1),  # 154 m to stop
    ]:
        steps = [
            at(i, place, warning, outside=outside, speed=speed) for i, warning in enumerate((None, FOG, FOG, None))
        ]
        values = found(*steps)
        assert values["false_fog_warnings"] == false
        assert values["false_fog_warnings_per_h"] == pytest.approx(120.0 * false)


def test_a_warning_for_which_there_was_reason_when_it_was_decided_is_not_false():
    """Who brakes at once is slow enough in sight when it is in force."""
    faster, slower = at(0, 3000.0, outside=200.0, speed=30.0), at(1, 3300.0, FOG, outside=200.0, speed=25.0)
    assert found(faster, slower)["false_fog_warnings"] == 0
    again = at(2, 3600.0, outside=200.0, speed=25.0), at(3, 3800.0, FOG, outside=200.0, speed=25.0)
    assert found(faster, slower, *again)["false_fog_warnings"] == 1


def test_shares_of_the_time_under_the_other_warnings():
    values = found(*(at(i, 0.0, warning) for i, warning in enumerate((None, SEE, SEE, CAMERA, None))))
    assert values["cannot_see_time_share"] == pytest.approx(0.5)
    assert values["camera_degraded_time_share"] == pytest.approx(0.25)
    assert found(at(0, 0.0))["cannot_see_time_share"] is None
