"""A run tells at its end what of its script was not played."""

import contextlib
from pathlib import Path

import pytest

import fogsim
from fogsim.errors import UnplayedWarning
from fogsim.scenario import Scenario, scenario_from_config
from fogsim.values import Ending, Reason

GRID = Path(__file__).parent / "data" / "grid" / "grid.sumocfg"
EGO = "veh18"
SMALL = ("camera.width=160", "camera.height=120", "fog.visibility_m=120", "duration_s=1")
LATE = f"{{kind: brake, vehicle: {EGO}, at_time_s: 300}}"
TOO_FAR = f"{{kind: change_lane, vehicle: {EGO}, lanes: 4, at_time_s: 0}}"


def town(*settings: str) -> Scenario:
    return scenario_from_config(GRID, EGO, [*SMALL, *settings])


def test_a_run_that_is_cut_short_tells_what_it_did_not_reach_and_warns_of_nothing() -> None:
    steps = list(fogsim.run(town(f"traffic.events=[{LATE}]", "traffic.keep_lane=[veh99]"), seed=1))
    assert steps[-1].ending is Ending.TIME
    assert [event.reason for event in steps[-1].unplayed.events] == [Reason.NOT_REACHED]
    assert steps[-1].unplayed.vehicles == ("veh99",)
    assert not any(step.unplayed for step in steps[:-1])


def test_a_run_warns_of_what_a_longer_one_would_not_play_either() -> None:
    told = rf"grid: not played: traffic\.events\.0 \(change_lane of {EGO} at_time_s=0\): there was no such lane$"
    with pytest.warns(UnplayedWarning, match=told):
        list(fogsim.run(town(f"traffic.events=[{TOO_FAR}]"), seed=1))


def test_a_run_that_arrives_warns_of_all_that_was_not_played() -> None:
    at_once = "traffic.stop_before_end_m=100000"
    with pytest.warns(UnplayedWarning, match=r"its time, position or gap was not reached; vehicle 'veh99' was never"):
        steps = list(fogsim.run(town(at_once, f"traffic.events=[{LATE}]", "traffic.keep_lane=[veh99]"), seed=1))
    assert steps[-1].ending is Ending.ARRIVED


def test_a_run_that_its_user_ends_warns_of_nothing() -> None:
    with contextlib.closing(fogsim.run(town(f"traffic.events=[{TOO_FAR}]"), seed=1)) as steps:
        assert not next(steps).unplayed
