"""Lighting policies that go by what the vehicle senses, on plain values."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.lighting import FogLampRules, VehicleLightingPolicy
from fogsim.lighting.legal import LAWS, LegalRules
from fogsim.lighting.optimiser import SightOptimiser, glare_dealt
from fogsim.lighting.own_sight import FARTHEST, headlamp_sight_distance, own_veil
from fogsim.lighting.rules import Gallen2014, settled
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import Belief, Lamp, LampChoice, LampWish, LeadMeasurement, LightMeasurement, Observation

LOW = Lamp.POSITION | Lamp.LOW_BEAM
HIGH = Lamp.POSITION | Lamp.HIGH_BEAM
NIGHT = Observation(np.zeros((2, 2), np.uint8), light=LightMeasurement(0.05))
CLEAR = 2000.0


def believe(visibility: float) -> Belief:
    cells = np.linspace(math.log(3e-4), math.log(0.3), 241)
    weight = np.exp(-0.5 * ((cells - math.log(OPTICAL_DEPTH_AT_VISIBILITY / visibility)) / 0.03) ** 2)
    return Belief(cells, weight / weight.sum())


def sensed(**what: Any) -> Observation:
    return dataclasses.replace(NIGHT, light=LightMeasurement(0.05, **what))


def with_lead(distance: float) -> Observation:
    return dataclasses.replace(NIGHT, lead=LeadMeasurement(distance, 0.0))


def lasting(policy: VehicleLightingPolicy, visibility: float, seen: Observation, lit: Lamp = LOW) -> Lamp:
    """Lamps once the belief and what is sensed have lasted for long enough."""
    first = policy.choose_lamps(believe(visibility), seen, 10.0, LampChoice(lit))
    return policy.choose_lamps(believe(visibility), seen, 20.0, first).lamps


def test_hysteresis_keeps_a_lamp_lit_until_visibility_is_clearly_better() -> None:
    rules = FogLampRules()
    assert Lamp.REAR_FOG in rules.lamps(believe(55.0), Lamp.REAR_FOG)
    assert Lamp.REAR_FOG not in rules.lamps(believe(55.0), Lamp.NONE)
    assert Lamp.REAR_FOG not in rules.lamps(believe(65.0), Lamp.REAR_FOG)


def test_gallen2014_prefers_high_beams_above_100_m_where_nobody_is_dazzled() -> None:
    for visibility, seen, expected in [
        (110.0, NIGHT, LOW),
        (CLEAR, sensed(preceding=True), LOW),
        (CLEAR, with_lead(80.0), LOW),
        (CLEAR, with_lead(120.0), HIGH),
        (CLEAR, dataclasses.replace(NIGHT, light=LightMeasurement(1000.0)), LOW),
    ]:
        assert lasting(Gallen2014(), visibility, seen) == expected


def test_high_beams_stay_to_100_m_and_come_from_120_m_on() -> None:
    assert lasting(Gallen2014(), 110.0, NIGHT, HIGH) == HIGH
    assert lasting(Gallen2014(), 95.0, NIGHT, HIGH) == LOW | Lamp.FRONT_FOG


def test_a_wish_must_last_and_high_beams_are_left_at_once() -> None:
    wished = settled(HIGH, 10.0, LampChoice(LOW), 2.0)
    assert wished == LampChoice(LOW, LampWish(HIGH, 10.0))
    assert settled(HIGH, 11.9, wished, 2.0) == wished
    assert settled(HIGH, 12.0, wished, 2.0) == LampChoice(HIGH)
    assert settled(LOW, 11.0, wished, 2.0) == LampChoice(LOW)
    assert settled(HIGH, 11.5, LampChoice(LOW), 2.0).wish == LampWish(HIGH, 11.5)
    assert settled(LOW, 12.5, LampChoice(HIGH), 2.0) == LampChoice(LOW)
    assert settled(LOW | Lamp.REAR_FOG, 3.0, LampChoice(LOW, LampWish(HIGH, 1.0)), 2.0).wish == LampWish(
        LOW | Lamp.REAR_FOG, 3.0
    )


def test_a_lamp_does_not_wait_for_another_that_flickers() -> None:
    choice = LampChoice(LOW)
    for second in range(4):
        flickering = Lamp.REAR_FOG if second % 2 else Lamp.NONE
        choice = settled(LOW | Lamp.FRONT_FOG | flickering, float(second), choice, 2.0)
    assert choice.lamps == LOW | Lamp.FRONT_FOG


def test_countries_allow_what_is_written() -> None:
    for country, rear_fog, front_fog, high_in_fog in [
        ("germany", {40.0}, {40.0, 90.0}, True),
        ("united_kingdom", {40.0, 90.0}, {40.0, 90.0}, True),
        ("france", {40.0, 90.0, 300.0, 600.0}, {40.0, 90.0, 300.0, 600.0}, False),
        ("unece", {40.0}, {40.0, 90.0, 300.0, 600.0}, False),
    ]:
        policy = LegalRules(country)
        found = {v: lasting(policy, v, sensed(oncoming=True)) for v in (40.0, 90.0, 300.0, 600.0, CLEAR)}
        assert {v for v, lamps in found.items() if Lamp.REAR_FOG in lamps} == rear_fog
        assert {v for v, lamps in found.items() if Lamp.FRONT_FOG in lamps} == front_fog
        assert all(Lamp.LOW_BEAM in lamps for lamps in found.values())
        assert (Lamp.HIGH_BEAM in lasting(policy, 300.0, NIGHT)) is high_in_fog
        assert lasting(policy, CLEAR, NIGHT) == HIGH
        assert lasting(policy, CLEAR, with_lead(90.0)) == LOW


def test_each_rule_names_its_source() -> None:
    for law in LAWS.values():
        rules = {field.name for field in dataclasses.fields(law)} - {"sources"}
        assert set(law.sources) == rules
        assert all(len(source) >= 8 for source in law.sources.values())


def test_an_unknown_country_is_refused_with_those_there_are() -> None:
    with pytest.raises(InputError, match=r"country must be 'germany' or 'france' or .*got 'spain'"):
        LegalRules("spain")  # type: ignore[arg-type]  # what is to be refused


def test_own_sight_falls_with_fog_and_glare_and_high_beams_lose_by_their_veil() -> None:
    low, high = ([headlamp_sight_distance(beam, v) for v in (50.0, 100.0, 300.0, math.inf)] for beam in (LOW, HIGH))
    assert low == sorted(low)
    assert high == sorted(high)
    assert high[-1] > 1.1 * low[-1]
    assert all(by_high < by_low for by_high, by_low in zip(high[:-1], low[:-1], strict=True))
    assert headlamp_sight_distance(LOW, 100.0, glare=1.0) < low[1]
    assert headlamp_sight_distance(Lamp.POSITION, 100.0) == 0.0
    assert headlamp_sight_distance(LOW, 5.0) == 0.0
    assert max(high) < FARTHEST


def test_the_veil_before_the_road_is_that_of_photons() -> None:
    """0.31, 1.58 cd/m² at V_met = 100 m, 1.5 m above the road (docs/explanation/night.md); car drivers sit lower."""
    assert 0.31 < own_veil(LOW, 100.0, 40.0) < 3.0 * 0.31
    assert 1.58 < own_veil(HIGH, 100.0, 40.0) < 2.0 * 1.58
    assert own_veil(LOW, math.inf, 40.0) == 0.0


def test_the_optimiser_takes_what_shows_most_and_pays_for_glare() -> None:
    policy = SightOptimiser()
    assert lasting(policy, 200.0, NIGHT) == LOW
    assert lasting(policy, 20_000.0, NIGHT) == HIGH
    assert lasting(policy, 20_000.0, sensed(oncoming=True)) == LOW
    assert lasting(SightOptimiser(price=0.0), 20_000.0, sensed(oncoming=True)) == HIGH
    assert lasting(policy, 20_000.0, dataclasses.replace(NIGHT, light=LightMeasurement(5000.0))) == LOW


def test_glare_is_dealt_to_those_of_whom_the_vehicle_knows() -> None:
    high = Lamp.HIGH_BEAM
    assert glare_dealt(high, CLEAR, NIGHT) == 0.0
    oncoming = glare_dealt(high, CLEAR, sensed(oncoming=True))
    assert oncoming == glare_dealt(high, CLEAR, dataclasses.replace(NIGHT, light=None)) > 1.0
    assert glare_dealt(high, 50.0, sensed(oncoming=True)) < 0.1 * oncoming
    assert 0.0 < glare_dealt(high, CLEAR, with_lead(50.0)) < glare_dealt(high, CLEAR, with_lead(20.0))
    assert glare_dealt(Lamp.LOW_BEAM, CLEAR, sensed(oncoming=True)) < 0.1 * oncoming
