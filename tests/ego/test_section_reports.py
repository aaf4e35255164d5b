"""Sections of road that are advised by what sensors beside the road have reported: wrong, late and not everywhere."""

import math

import pytest
from early_motorway import EARLY

import fogsim
from fogsim.errors import InputError
from fogsim.scenario import Scenario
from fogsim.values import Step

BANK = "fog={outside_visibility_m: 2000, banks: [{start_m: 1300, end_m: 3000, edge_m: 100, visibility_m: 60}]}"
CLOCKS = ("duration_s=5", "clocks.camera_period_s=1", "clocks.decision_period_s=1")
QUIET = (EARLY, "renderer=none", "estimators=[]", *CLOCKS)
SIGNS = ("drivers.advised=signs", "drivers.harmonisation=null")


def scenario(*settings: str) -> Scenario:
    return fogsim.load_scenario("motorway_fog_bank", [*QUIET, BANK, *SIGNS, *settings])


def by_sensors(written: str) -> list[Step]:
    settings = "advice={method: stopping_sight_distance, informed_by: sensors}", f"sensors.reports.roadside={written}"
    return list(fogsim.run(scenario(*settings), 1))


def test_sections_go_by_the_nearest_sensor_from_the_beginning_of_a_run():
    steps = by_sensors("{deviation: 0.0001, delay_s: 5, every_m: 500}")
    assert steps[0].observation.reports
    assert {report.time for report in steps[0].observation.reports} == {-5.0}
    for section in steps[-1].truth.sections:
        if section.stretch.start % 500 == 0:
            assert section.reported == pytest.approx(section.extinction, rel=0.2)
    told = {one.stretch.start: one.speed for one in steps[-1].command.stretches}
    inside = [speed for start, speed in told.items() if 1500.0 <= start < 2500.0]
    assert inside
    assert max(inside) < 20.0
    assert not any(start < 1000.0 for start in told)


@pytest.fixture(scope="module")
def by_truth() -> Step:
    """The last step of a run in which signs go by the truth."""
    return list(fogsim.run(scenario("advice={method: stopping_sight_distance, informed_by: truth}"), 1))[-1]


def test_wrong_sensors_make_wrong_signs_and_the_truth_does_not(by_truth: Step):
    told = {one.stretch.start for one in by_sensors("{wrong: 1.0, every_m: 500}")[-1].command.stretches}
    assert told != {one.stretch.start for one in by_truth.command.stretches}


def test_signs_are_read_from_afar(by_truth: Step):
    truth = "advice={method: stopping_sight_distance, informed_by: truth}"
    settings, near = (truth, "drivers.signs={reading_distance_m: 150}"), by_truth.command.stretches
    far = list(fogsim.run(scenario(*settings), 1))[-1].command.stretches
    assert [one.stretch.start for one in far] == [one.stretch.start - 150.0 for one in near]
    assert [one.stretch.end for one in far if math.isfinite(one.stretch.end)] == [
        one.stretch.end - 150.0 for one in near if math.isfinite(one.stretch.end)
    ]


def test_what_cannot_inform_is_told():
    sensors = "advice={method: fixed_speed, informed_by: sensors}"
    for settings, told in [
        ((sensors,), "needs sensors.reports.roadside"),
        ((sensors, "sensors.reports.roadside={}", "drivers.advised=all"), "signs, equipped or law"),
        (("advice={method: fixed_speed, informed_by: sensor}",), "sensors"),
        (("lighting={method: legal, informed_by: sensors}",), "informed_by"),
    ]:
        with pytest.raises(InputError, match=told):
            scenario(*settings)
