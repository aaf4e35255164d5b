"""The roster is the set of vehicles on the road; they are updated in time and once."""

from pathlib import Path

import pytest

from fogsim.traffic.sumo.libsumo_link import LibsumoLink
from fogsim.traffic.sumo.roster import Roster, UpdateSchedule, closing_speed_bound
from tests.traffic.common import CROWD


def test_the_roster_is_who_is_on_the_road(link: LibsumoLink) -> None:
    api = link.begin(CROWD)
    roster = Roster(api)
    mark, came = 0, set()
    for step in range(900):
        link.step()
        # A step in a hundred is missed, and once somebody is taken away.
        if step % 100:
            roster.update()
            new, mark = roster.entered_since(mark)
            came.update(new)
            assert roster.present == set(api.vehicle.getIDList())
        if step == 450:
            api.vehicle.remove(min(roster.present))
    assert roster.present < came
    assert roster.removals > 0


def test_vehicles_that_a_calibrator_removes_are_gone_at_once(link: LibsumoLink, tmp_path: Path) -> None:
    """SUMO has them arrive a step later, and until then they are at -1e9 m and as fast."""
    calibrated = tmp_path / "calibrated.add.xml"
    none_left = f'period="60" output="{tmp_path}/out.xml"><route id="on" edges="bank exit"/>'
    none_left += '<flow route="on" begin="0" end="90" vehsPerHour="0" speed="20" type="DEFAULT_VEHTYPE"/>'
    calibrated.write_text(
        f'<additional><calibrator id="none" edge="bank" pos="0" {none_left}</calibrator></additional>', encoding="utf-8"
    )
    api = link.begin([*CROWD, "--additional-files", str(calibrated)])
    roster, slowest = Roster(api), 0.0
    for _ in range(900):
        link.step()
        roster.update()
        assert roster.present == set(api.vehicle.getIDList())
        slowest = min([slowest, *map(api.vehicle.getSpeed, roster.present)])
    assert slowest == 0.0
    assert roster.removals > 10


def test_who_is_scheduled_is_due_in_time_and_once() -> None:
    schedule = UpdateSchedule(0.1, 3.0)
    schedule.add(["now"], 3.0)
    schedule.add(["soon"], 3.27)
    schedule.add(["later"], 3.74)
    seen = {}
    for step in range(1, 12):
        time = 3.0 + 0.1 * step
        for vehicle in schedule.pop_due(time):
            seen[vehicle] = time
    assert seen["now"] == pytest.approx(3.1)
    assert seen["soon"] == pytest.approx(3.2)
    assert 3.1 < seen["later"] <= 3.74
    schedule.add(["a", "b"], 4.5)
    assert schedule.unscheduled(["c", "a", "c"]) == ["c"]
    assert schedule.pop_due(9.0) == ["a", "b"]
    assert schedule.unscheduled(["a", "c"]) == ["a", "c"]
    assert schedule.pop_due(10.0) == []


def test_a_gap_closes_no_faster_than_its_bound() -> None:
    """Over 0.5 s an emergency stop of the leader at 20 m/s² adds a mean of 5 m/s."""
    assert closing_speed_bound(30.0, 20.0, 0.5) == closing_speed_bound(20.0, 30.0, 0.5) == 15.0
    assert closing_speed_bound(30.0, 20.0, 0.0) == 10.0


def test_a_state_of_the_same_time_or_an_earlier_one_brings_other_vehicles(link: LibsumoLink, tmp_path: Path) -> None:
    api, state = link.begin(CROWD), str(tmp_path / "state.xml")
    for _ in range(300):
        link.step()
    api.simulation.saveState(state)
    roster = Roster(api)
    for later in (1, 5):
        for _ in range(later):
            link.step()
            roster.update(has_stepped=True)
        _, mark = roster.entered_since(0)
        api.simulation.loadState(state)
        link.step()
        roster.update(has_stepped=True)
        assert roster.present == set(api.vehicle.getIDList()) == set(roster.entered_since(mark)[0])
        _, mark = roster.entered_since(0)
        roster.update()
        assert roster.entered_since(mark)[0] == []
