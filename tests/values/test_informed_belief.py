"""The gate of every decision: whether a belief says enough to act on, and the visibility to act on."""

import dataclasses
import math
from itertools import product

import numpy as np
import pytest

from fogsim.advice import ADVISERS
from fogsim.advice.presentation import PresentedAdviser
from fogsim.fusion import FUSIONS, DatedFusion, make
from fogsim.lighting import LIGHTING_POLICIES, VehicleLightingPolicy
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY, extinction_from_visibility
from fogsim.values import (
    Belief,
    Estimate,
    FogReport,
    Lamp,
    LampChoice,
    LeadMeasurement,
    LightMeasurement,
    Observation,
    SpeedAdvice,
)
from fogsim.values.belief import OLDEST, certain_belief
from fogsim.values.estimate import ExtinctionBounds

LOW = Lamp.POSITION | Lamp.LOW_BEAM
HIGH = Lamp.POSITION | Lamp.HIGH_BEAM
FOG = LOW | Lamp.FRONT_FOG | Lamp.REAR_FOG
CONSTANT = {"low_beam": LOW, "always_low": LOW, "always_high": HIGH}
FOLLOWING = sorted(set(LIGHTING_POLICIES) - set(CONSTANT))
CELLS = np.linspace(math.log(3e-4), math.log(0.3), 241)

IGNORANT = Belief(CELLS, np.full(CELLS.size, 1.0 / CELLS.size), age=math.inf)
OUTDATED = dataclasses.replace(certain_belief(extinction_from_visibility(40.0)), age=OLDEST + 1.0)
OUTDATED_CLEAR = dataclasses.replace(certain_belief(0.0), age=OLDEST + 1.0)


def normal(visibility: float, deviation: float) -> Belief:
    weight = np.exp(-0.5 * ((CELLS - math.log(OPTICAL_DEPTH_AT_VISIBILITY / visibility)) / deviation) ** 2)
    return Belief(CELLS, weight / weight.sum())


def one_sided(most: float = math.inf, least: float = 0.0) -> Belief:
    """Belief by bounds of the visibility [m] alone, repeated for 2 s."""
    bounds = ExtinctionBounds(
        extinction_from_visibility(least) if least else math.inf, extinction_from_visibility(most)
    )
    told = dataclasses.replace(Estimate.invalid("m", "only a bound"), bounds=bounds)
    fusion = DatedFusion(make("grid_filter"))
    for number in range(20):
        belief = fusion.update_at([told], 0.1 * number, 0.0)
    return belief


AT_LEAST_400 = one_sided(least=400.0)
UNINFORMED = {"nothing known": IGNORANT, "wide": normal(80.0, 1.0), "old fog": OUTDATED, "old clear": OUTDATED_CLEAR}

NIGHT = Observation(np.zeros((2, 2), np.uint8), light=LightMeasurement(0.05))
SEEN = {
    "night": NIGHT,
    "oncoming": dataclasses.replace(NIGHT, light=LightMeasurement(0.05, oncoming=True)),
    "lead": dataclasses.replace(NIGHT, lead=LeadMeasurement(20.0, 0.0)),
    "day": dataclasses.replace(NIGHT, light=LightMeasurement(20_000.0)),
    "no light sensor": dataclasses.replace(NIGHT, light=None),
}


def lamps(name: str, belief: Belief, seen: Observation, lit: Lamp = LOW) -> Lamp:
    """Lamps of a policy at once, and after what is believed and seen has lasted for 10 s."""
    policy = LIGHTING_POLICIES[name]()
    if not isinstance(policy, VehicleLightingPolicy):
        return policy.lamps(belief, lit)
    first = policy.choose_lamps(belief, seen, 10.0, LampChoice(lit))
    return policy.choose_lamps(belief, seen, 20.0, first).lamps


def test_without_information_every_policy_lights_low_beams_at_once() -> None:
    for name, lit, seen, known in product(FOLLOWING, (LOW, HIGH, FOG), SEEN.values(), UNINFORMED.values()):
        policy = LIGHTING_POLICIES[name]()
        if isinstance(policy, VehicleLightingPolicy):
            assert policy.choose_lamps(known, seen, 10.0, LampChoice(lit)) == LampChoice(LOW), name
        else:
            assert policy.lamps(known, lit) == LOW, name


def test_constant_lamps_ask_nothing() -> None:
    for name, expected in CONSTANT.items():
        assert {lamps(name, belief, NIGHT) for belief in (IGNORANT, certain_belief(0.05))} == {expected}


def test_lamps_by_belief_alone_on_a_dark_road() -> None:
    for belief, gallen2014, fog_lamp_rules in [
        (normal(40.0, 0.1), FOG, FOG),
        # With a quarter of chance or more the visibility is too good for the rear fog lamps, which dazzle.
        (normal(47.0, 0.3), LOW | Lamp.FRONT_FOG, LOW | Lamp.FRONT_FOG),
        (normal(90.0, 0.3), LOW | Lamp.FRONT_FOG, LOW | Lamp.FRONT_FOG),
        (normal(130.0, 0.03), HIGH, LOW),
        (normal(130.0, 0.3), LOW, LOW),
        (AT_LEAST_400, HIGH, LOW),
        (certain_belief(0.0), HIGH, LOW),
    ]:
        assert lamps("gallen2014", belief, NIGHT) == gallen2014
        assert lamps("fog_lamp_rules", belief, NIGHT) == fog_lamp_rules


def test_no_high_beams_by_day_or_toward_others_whatever_is_believed() -> None:
    for name in FOLLOWING:
        for seen in sorted(set(SEEN) - {"night"}):
            for belief in (AT_LEAST_400, certain_belief(0.0)):
                assert Lamp.HIGH_BEAM not in lamps(name, belief, SEEN[seen], HIGH)


def test_bounds_inform_where_they_leave_little_doubt() -> None:
    assert AT_LEAST_400.is_informed()
    assert one_sided(most=60.0).is_informed()
    assert not one_sided(most=800.0).is_informed()
    assert not one_sided(least=40.0).is_informed()
    assert normal(80.0, 0.69).is_informed()
    assert not normal(80.0, 0.71).is_informed()


def test_beliefs_know_how_old_the_last_evidence_is() -> None:
    for name in sorted(FUSIONS):
        fusion = DatedFusion(make(name))
        estimate = Estimate("m", extinction_from_visibility(60.0), 0.002)
        assert fusion.update_at([Estimate.invalid("m", "nothing seen")], 0.0, 0.0).age == math.inf
        assert fusion.update_at([estimate], 1.0, 0.0).age == 0.0
        assert fusion.update_at([], 1.0 + OLDEST, 0.0).age == OLDEST
        assert not fusion.update_at([], 1.1 + OLDEST, 0.0).is_informed()
        report = FogReport("sensor 1", 1, 50.0, 1.1 + OLDEST, extinction_from_visibility(60.0), 0.1)
        belief = fusion.update_at([], 1.2 + OLDEST, 0.0, [report])
        assert belief.age == (0.2 + OLDEST if belief.profile is None else 0.0)  # reports are of places
        fusion.reset()
        assert fusion.update_at([], 0.0, 0.0).age == math.inf


def test_without_information_advice_stays_or_falls_back() -> None:
    for name in [n for n, a in ADVISERS.items() if isinstance(a, type) and issubclass(a, PresentedAdviser)]:
        for known in UNINFORMED.values():
            previous = SpeedAdvice(17.0)
            for speed in (17.0, math.inf):
                assert ADVISERS[name]().advise(known, 36.0, 5.0, SpeedAdvice(speed)).speed == speed
            assert ADVISERS[name](fallback=15.0, rounding=0.01, minimum=0.0).advise(
                known, 36.0, 5.0, previous
            ).speed == pytest.approx(15.0, abs=0.01)
            assert ADVISERS[name](fallback=40.0).advise(known, 36.0, 5.0, previous).speed == math.inf
