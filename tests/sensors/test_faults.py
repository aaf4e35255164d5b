"""What faults do to radar, satellite positioning and signs."""

import math
from typing import get_args

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.scenario.sensors.faults import AnyFault, fault_of
from fogsim.sensors import (
    Fix,
    Gps,
    LeadSensor,
    check_sign_ids,
    faulty_fix,
    faulty_lead,
    faulty_lead_sensor,
    faulty_signs,
    measure_fix,
    measure_lead,
)
from fogsim.values import Fault, Leader, LeadMeasurement, RunningFault, Sign, SignMap
from fogsim.values.fault import (
    Blackout,
    FaultKind,
    HeadingBias,
    LeadBias,
    LeadDropout,
    LeadNarrowView,
    LeadNoise,
    Outage,
    PositionBias,
    SignsMissing,
    SignsMoved,
    Where,
)

MEASURED = LeadMeasurement(40.0, -3.0)
NORTH = Fix(np.array([100.0, 50.0, 2.0]), math.pi / 2)
SIGNS = SignMap(tuple(Sign(name, "speed_limit", 25.0, (100.0 * i, 0.0, 2.0), 0.0, 0.9) for i, name in enumerate("abc")))


def running(*kinds: FaultKind) -> list[RunningFault]:
    return [RunningFault(Fault(kind), 0.0, math.inf, np.random.default_rng(5)) for kind in kinds]


def test_faults_of_others_change_nothing() -> None:
    other = running(Blackout())
    assert faulty_lead(MEASURED, other) == MEASURED
    assert faulty_lead_sensor(LeadSensor(), other) == LeadSensor()
    assert faulty_fix(NORTH, other) is NORTH
    assert faulty_signs(SIGNS, [Blackout()], Where.WORLD) == SIGNS


def test_a_radar_loses_its_measurements_at_the_rate_that_is_asked_for() -> None:
    (half,) = running(LeadDropout(0.5))
    lost = np.mean([faulty_lead(MEASURED, [half]) is None for _ in range(400)])
    assert lost == pytest.approx(0.5, abs=0.05)
    assert faulty_lead(MEASURED, running(LeadDropout(1.0))) is None


def test_a_biased_radar_never_measures_less_than_nothing() -> None:
    assert faulty_lead(MEASURED, running(LeadBias(5.0, 1.0))) == LeadMeasurement(45.0, -2.0)
    assert faulty_lead(MEASURED, running(LeadBias(-50.0, 0.0))) == LeadMeasurement(0.0, -3.0)
    assert faulty_lead(None, running(LeadBias(5.0, 0.0))) is None


def test_a_noisier_radar_spreads_as_much_more() -> None:
    sensor = faulty_lead_sensor(LeadSensor(), running(LeadNoise(4.0)))
    rng = np.random.default_rng(1)
    distances = [measure_lead(Leader("a", 60.0, 20.0), 20.0, sensor, rng).distance for _ in range(4000)]
    assert np.std(distances) == pytest.approx(1.0, rel=0.05)


def test_a_radar_measures_within_its_field_of_view_only() -> None:
    for bearing, seen in [(0.0, True), (0.9, True), (-1.1, False), (1.1, False)]:
        narrow = faulty_lead_sensor(LeadSensor(), running(LeadNarrowView(math.radians(2.0))))
        found = measure_lead(Leader("a", 60.0, 20.0), 20.0, narrow, np.random.default_rng(1), math.radians(bearing))
        assert (found is not None) is seen
        # A fault never widens it.
        assert faulty_lead_sensor(narrow, running(LeadNarrowView(1.0))) == narrow


def test_a_position_is_displaced_in_the_world_or_along_the_way() -> None:
    fix = faulty_fix(NORTH, running(PositionBias(east=1.0, north=2.0, along=10.0, left=4.0)))
    assert fix is not None
    np.testing.assert_allclose(fix.position, [100.0 + 1.0 - 4.0, 50.0 + 2.0 + 10.0, 2.0])
    turned = faulty_fix(NORTH, running(HeadingBias(0.1)))
    assert turned is not None
    assert turned.heading == pytest.approx(math.pi / 2 + 0.1)
    assert faulty_fix(NORTH, running(Outage())) is None


def test_a_position_without_noise_is_the_true_one_to_the_last_bit() -> None:
    rng = np.random.default_rng(2)
    fix = measure_fix(NORTH.position, NORTH.heading, Gps(), rng)
    np.testing.assert_array_equal(fix.position, NORTH.position)
    assert fix.heading == NORTH.heading
    noisy = [measure_fix(NORTH.position, NORTH.heading, Gps(2.0, 0.01), rng) for _ in range(4000)]
    assert np.std([fix.position for fix in noisy], axis=0) == pytest.approx([2.0, 2.0, 0.0], rel=0.05)
    assert np.std([fix.heading for fix in noisy]) == pytest.approx(0.01, rel=0.05)


def test_signs_go_missing_in_the_world_or_on_the_map() -> None:
    gone = SignsMissing(Where.MAP, ("b",))
    assert [sign.sign_id for sign in faulty_signs(SIGNS, [gone], Where.MAP).signs] == ["a", "c"]
    assert faulty_signs(SIGNS, [gone], Where.WORLD) == SIGNS
    assert faulty_signs(SIGNS, [SignsMissing(Where.WORLD, ())], Where.WORLD) == SignMap()


def test_signs_are_moved_as_seen_by_those_they_speak_to() -> None:
    moved = faulty_signs(SIGNS, [SignsMoved(Where.WORLD, ("b",), along=5.0, left=2.0, up=1.0)], Where.WORLD)
    assert [sign.position for sign in moved.signs] == [(0.0, 0.0, 2.0), (105.0, 2.0, 3.0), (200.0, 0.0, 2.0)]


def test_a_sign_that_is_not_there_cannot_be_missing() -> None:
    with pytest.raises(InputError, match="signs missing: there is no sign 'bb'; did you mean 'b'"):
        check_sign_ids([SignsMissing(Where.WORLD, ("bb",))], SIGNS)


def test_each_section_makes_the_fault_that_it_names() -> None:
    for section in get_args(get_args(AnyFault)[0]):
        (name,) = get_args(section.model_fields["fault"].annotation)
        written = section(fault=name)
        assert fault_of(written).name == f"{written.sensor} {name}"
