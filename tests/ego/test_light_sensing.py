"""What the light sensor tells of others' lamps, and the glare that the ego's deal, on plain values."""

import math

import pytest

from fogsim.simulation.ego.light_sensing import LightSensing, lamp_effects
from fogsim.simulation.run_config import LightSensor
from fogsim.units import extinction_from_visibility
from fogsim.values import FogField, Lamp, LightMeasurement, TrafficState
from fogsim.values.eye import disability_glare
from tests.helpers.vehicles import vehicles

LOW, HIGH = int(Lamp.POSITION | Lamp.LOW_BEAM), int(Lamp.POSITION | Lamp.HIGH_BEAM)
NIGHT = 0.05
SENSING = LightSensing(LightSensor())


def fog(visibility: float) -> FogField:
    return FogField(extinction_from_visibility(visibility), (0.0, 0.0, 0.0))


def road(*others: tuple[float, float, float, int], own: int = LOW) -> TrafficState:
    """The ego at the origin, eastward, and others by east, north, heading and lamps."""
    rows = [(0.0, 0.0, 0.0, own), *others]
    places = [(east, north, 0.0) for east, north, _, _ in rows]
    return vehicles(places, heading=[one[2] for one in rows], speed=20.0, lane="road_0", lamps=[one[3] for one in rows])


def measured(state: TrafficState, visibility: float = math.inf, illuminance: float = NIGHT) -> LightMeasurement:
    return SENSING.measure(state, 0, fog(visibility), illuminance)


def test_head_lamps_are_found_as_far_as_told_in_clear_air_and_less_far_in_fog() -> None:
    for distance, visibility, lamps, found in [
        (380.0, math.inf, LOW, True),
        (420.0, math.inf, LOW, False),
        (390.0, math.inf, HIGH, True),
        (380.0, 200.0, LOW, False),
        (100.0, 200.0, LOW, True),
        (200.0, math.inf, int(Lamp.POSITION), False),
    ]:
        assert measured(road((distance, 3.5, math.pi, lamps)), visibility) == LightMeasurement(NIGHT, oncoming=found)


def test_tail_lamps_are_found_ahead_and_nothing_behind_or_aside() -> None:
    assert measured(road((95.0, 0.0, 0.0, LOW))) == LightMeasurement(NIGHT, preceding=True)
    assert measured(road((120.0, 0.0, 0.0, LOW))) == LightMeasurement(NIGHT)
    assert measured(road((-50.0, 3.5, math.pi, LOW), (20.0, 30.0, math.pi, LOW))) == LightMeasurement(NIGHT)
    assert measured(road()) == LightMeasurement(NIGHT)


def test_by_day_it_tells_the_light_alone() -> None:
    state = road((50.0, 3.5, math.pi, LOW))
    assert measured(state, illuminance=1000.0) == LightMeasurement(1000.0)


def test_the_veil_dealt_is_that_of_both_beams_through_the_fog() -> None:
    state = road((50.0, 3.5, math.pi, LOW), own=HIGH)
    clear, dense = (lamp_effects(state, 0, fog(v), 0.0) for v in (math.inf, 100.0))
    angle = math.atan2(3.5, 50.0)
    beam = 32585.0 * math.exp(-((math.degrees(angle) / 5.669) ** 1.202)) + 1674.0 * math.exp(
        -((math.degrees(angle) / 23.30) ** 1.5)
    )
    squared = 50.0**2 + 3.5**2
    expected = float(disability_glare(2.0 * beam / (squared + 0.43**2), angle))
    assert clear.veils == pytest.approx((expected,), rel=1e-6)
    depth = extinction_from_visibility(100.0) * math.sqrt(squared)
    assert dense.veils[0] == pytest.approx(expected * math.exp(-depth), rel=1e-6)


def test_who_is_ahead_is_dazzled_less_than_who_comes_and_who_is_behind_not_at_all() -> None:
    effects = lamp_effects(road((30.0, 0.0, 0.0, LOW), (-30.0, 3.5, math.pi, LOW), own=HIGH), 0, fog(1e5), 0.0)
    oncoming = lamp_effects(road((30.0, 3.5, math.pi, LOW), own=HIGH), 0, fog(1e5), 0.0)
    assert len(effects.veils) == 1
    assert 0.0 < effects.veils[0] < oncoming.veils[0]
    dark = lamp_effects(road((30.0, 3.5, math.pi, LOW), own=int(Lamp.POSITION)), 0, fog(1e5), 0.0)
    assert (dark.own_sight, dark.veils) == (0.0, ())
