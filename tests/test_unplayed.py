"""A run tells at its end what of its script was not played."""

import contextlib
import json
from pathlib import Path

import pytest

import fogsim
from fogsim.cli.app import app
from fogsim.errors import UnplayedWarning
from fogsim.scenario import Scenario, scenario_from_config
from fogsim.simulation.recording import record_run
from fogsim.values import Ending, Reason

GRID = Path(__file__).parent / "data" / "grid" / "grid.sumocfg"
EGO = "veh18"
BLIND = ("renderer=none", "estimators=[]", "fog.visibility_m=120", "duration_s=1")
LATE = f"{{kind: brake, vehicle: {EGO}, at_time_s: 300}}"
TOO_FAR = f"{{kind: change_lane, vehicle: {EGO}, lanes: 4, at_time_s: 0}}"


def town(*settings: str) -> Scenario:
    # Without a look into the files, which would refuse some of these events at once.
    return scenario_from_config(GRID, EGO, [*BLIND, *settings], others_add_vehicles=True)


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


def test_a_recorded_run_is_whole_before_it_warns(tmp_path: Path) -> None:
    with pytest.raises(UnplayedWarning):  # warnings are errors here
        record_run(town(f"traffic.events=[{TOO_FAR}]", "traffic.keep_lane=[veh99]"), 1, tmp_path, recorders=["report"])
    manifest = json.loads((tmp_path / "manifest.json").read_text(encoding="utf-8"))
    event = f"traffic.events.0 (change_lane of {EGO} at_time_s=0): there was no such lane"
    assert (manifest["status"], manifest["message"]) == ("complete", "")
    assert (manifest["events_not_fired"], manifest["vehicles_never_seen"]) == ([event], ["veh99"])
    report = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert f"Not played: {event}" in report
    assert "Not played: vehicle &#39;veh99&#39; was never on the road" in report


def test_the_command_tells_each_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    blind = [part for setting in BLIND[:2] for part in ("--set", setting)]
    arguments = ["run", "--sumocfg", str(GRID), "--ego", EGO, "--visibility", "120", "--out", str(tmp_path), *blind]
    # A road of two lanes: to one of the sides there is no lane.
    sides = [f"{{kind: change_lane, vehicle: {EGO}, lanes: {lanes}, at_time_s: 0}}" for lanes in (1, -1)]
    events = f"traffic.events=[{', '.join(sides)}, {LATE}]"
    app([*arguments, "--set", "duration_s=1", "--set", events, "--no-video", "--no-report"], standalone_mode=False)
    told = capsys.readouterr()
    assert told.out.count("not played: ") == 2
    assert f"not played: traffic.events.2 (brake of {EGO} at_time_s=300): its time, position or gap was" in told.out
    assert "no such lane" not in told.err
