"""Leaders in the sublane model against geometry: positions, lengths and widths on a straight road along x."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fogsim
from fogsim.metrics.following import find_following
from fogsim.metrics.surrogate import time_to_collision
from fogsim.scenario import scenario_from_config
from fogsim.traffic import DriverSight
from fogsim.traffic.sumo.libsumo_link import LibsumoLink
from fogsim.traffic.sumo.roster import Roster
from fogsim.traffic.sumo.vehicle_reader import VehicleReader
from fogsim.traffic.sumo_drivers.perception import Perception
from fogsim.traffic.sumo_drivers.vehicle_sight import DriversView
from fogsim.traffic.sumo_lanes.leaders import Courses, Leaders
from fogsim.values import TrafficState
from tests.traffic.common import DATA, QUIET, even

CASES = DATA / "sumo_cases"
REACH = 250.0

NET = """<net version="1.20" {side}><location netOffset="0,0" convBoundary="0,0,800,0" origBoundary="0,0,800,0"
 projParameter="!"/>
 <edge id=":m_0" function="internal">{inner}</edge>
 <edge id="x" from="w" to="m">{first}</edge><edge id="y" from="m" to="e">{second}</edge>
 <junction id="w" type="dead_end" x="0" y="0" incLanes="" intLanes="" shape="0,0 0,-9"/>
 <junction id="m" type="priority" x="400" y="0" incLanes="x_0 x_1" intLanes=":m_0_0 :m_0_1" shape="395,0 405,-9">
  <request index="0" response="00" foes="00" cont="0"/><request index="1" response="00" foes="00" cont="0"/></junction>
 <junction id="e" type="dead_end" x="800" y="0" incLanes="y_0 y_1" intLanes="" shape="800,-9 800,0"/>
 {links}</net>"""
LINK = '<connection from="{0}" to="{1}" fromLane="{2}" toLane="{2}" {3} dir="s" state="M"/>'
DEMAND = """<routes><route id="r" edges="x y"/>
 <vType id="motorcycle" vClass="motorcycle" length="2.2" width="0.8" maxSpeed="9" sigma="0.5" latAlignment="arbitrary"/>
 <vType id="car" vClass="passenger" length="4.6" width="1.8" maxSpeed="13" latAlignment="arbitrary"/>
 <vType id="lorry" vClass="truck" length="9" width="2.5" maxSpeed="7" latAlignment="arbitrary"/>
 {flows}</routes>"""
FLOW = '<flow id="{0}" type="{0}" route="r" begin="0" end="200" period="{1}" departLane="{2}" departPosLat="{2}"/>'


@pytest.fixture(params=["right-hand", "left-hand"])
def crowd(link: LibsumoLink, request: pytest.FixtureRequest, tmp_path: Path) -> tuple[LibsumoLink, Any]:
    """Two wide lanes across a junction, full of vehicles side by side."""
    middles = (-6.75, -2.25) if request.param == "right-hand" else (-2.25, -6.75)

    def lanes(name: str, start: float, end: float) -> str:
        lane = '<lane id="{0}_{1}" index="{1}" speed="14" length="{2}" width="4.5" shape="{3},{5} {4},{5}"/>'
        return "".join(lane.format(name, n, end - start, start, end, y) for n, y in enumerate(middles))

    links = [LINK.format("x", "y", n, f'via=":m_0_{n}"') + LINK.format(":m_0", "y", n, "") for n in (0, 1)]
    parts = {"first": lanes("x", 0, 395), "second": lanes("y", 405, 800), "inner": lanes(":m_0", 395, 405)}
    side = 'lefthand="true"' if request.param == "left-hand" else ""
    (tmp_path / "a.net.xml").write_text(NET.format(side=side, links="".join(links), **parts))
    flows = "".join(FLOW.format(*flow, "random") for flow in (("motorcycle", 4), ("car", 3), ("lorry", 9)))
    (tmp_path / "a.rou.xml").write_text(DEMAND.format(flows=flows))
    names = ("-n", str(tmp_path / "a.net.xml"), "-r", str(tmp_path / "a.rou.xml"))
    return link, link.begin([*names, "--lateral-resolution", "0.5", *QUIET])


def leader_by_geometry(state: TrafficState, row: int, reach: float, end: float = 1e9) -> tuple[str, float] | None:
    """Nearest rear of those ahead whose rectangle is in the strip that the vehicle sweeps going straight on."""
    x, y = state.position[:, 0], state.position[:, 1]
    overlaps = np.abs(y - y[row]) < 0.5 * (state.width + state.width[row])
    gap = np.where(overlaps & (x > x[row]) & (x <= end), x - state.length - x[row], np.inf)
    nearest = int(gap.argmin())
    return (state.ids[nearest], float(gap[nearest])) if gap[nearest] < reach else None


def test_leaders_and_the_metrics_pairs_are_those_whose_widths_overlap(crowd: tuple[LibsumoLink, Any]) -> None:
    link, api = crowd
    compared = paired = differing = across = 0
    ends = {"x": 395.0, ":m": 405.0, "y": 800.0}
    for _ in range(120):
        link.step()
        state, leaders = Courses(api).add(VehicleReader(api, None, 0.0).state(fogsim.values.Lamp.NONE)), Leaders(api)
        following = find_following(state)
        pairs = {i: (j, gap) for i, j, gap in zip(following.follower, following.leader, following.gap, strict=True)}
        x, y = state.position[:, 0], state.position[:, 1]
        for row, vehicle in enumerate(state.ids):
            road = state.lane[row].split("_")[0]
            expected, found = leader_by_geometry(state, row, REACH), leaders.of_ego(vehicle)
            if expected is None:
                assert found is None or found.gap >= REACH
            else:
                assert found is not None
                assert found.vehicle_id == expected[0]
                assert found.gap == pytest.approx(expected[1], abs=0.02)
                in_lane = api.vehicle.getLeader(vehicle, REACH)
                differing += in_lane is None or in_lane[0] != found.vehicle_id
                across += state.lane[state.ids.index(found.vehicle_id)].split("_")[0] != road
                compared += 1
            expected = leader_by_geometry(state, row, np.inf, ends[road])
            assert (row in pairs) == (expected is not None)
            if expected is None:
                continue
            leader, gap = pairs[row]
            # The nearest by its front, and by its rear: among vehicles of differing length not always the same.
            if state.ids[leader] != expected[0]:
                assert x[leader] <= x[state.ids.index(expected[0])]
                assert abs(y[leader] - y[row]) < 0.5 * (state.width[leader] + state.width[row])
            else:
                assert gap == pytest.approx(max(expected[1], 0.0), abs=0.02)
                paired += 1
    assert min(compared, paired) > 1000
    assert differing > 100
    assert across > 50


def test_a_motorcycle_in_the_same_wide_lane_is_no_leader() -> None:
    """SUMO's own: a time to collision of 0.01 s, and a gap of −4.8 m, while the car passes at 5 m to its side."""
    settings = ("renderer=none", "estimators=[]", "fog.visibility_m=5000", "duration_s=30")
    beside = 0
    for step in fogsim.run(scenario_from_config(CASES / "side_by_side.sumocfg", "ego", settings), seed=1):
        assert step.leader is None
        found = find_following(step.traffic)
        remaining = time_to_collision(found.gap, found.speed, found.leader_speed)
        assert not len(remaining)
        x = step.traffic.position[:, 0]
        beside += len(x) == 2 and abs(x[0] - x[1]) < 4.0
    assert beside > 3


def test_drivers_look_for_those_ahead_of_their_width(link: LibsumoLink, tmp_path: Path) -> None:
    """A motorcycle next to a car does not hide from its driver's reckoning that the car ahead is out of sight."""
    (tmp_path / "a.rou.xml").write_text(
        """<routes><vType id="m" vClass="motorcycle" latAlignment="right" sigma="0"/>
        <vType id="c" vClass="passenger" latAlignment="left" sigma="0"/><route id="r" edges="x"/>
        <vehicle id="me" type="c" route="r" depart="0" departPos="100" departSpeed="10" departPosLat="left"/>
        <vehicle id="m" type="m" route="r" depart="0" departPos="102" departSpeed="10" departPosLat="right"/>
        <vehicle id="c" type="c" route="r" depart="0" departPos="180" departSpeed="10" departPosLat="left"/></routes>"""
    )
    names = ("-n", str(CASES / "side_by_side.net.xml"), "-r", str(tmp_path / "a.rou.xml"))
    api = link.begin([*names, "--lateral-resolution", "0.8", *QUIET])
    link.step()
    assert api.vehicle.getLeader("me", REACH)[0] == "m"
    perception = Perception(DriversView(api, even(25.0), DriverSight(1000.0), Roster(api)))
    perception.update({})
    assert perception.hidden["me"] == "c"


def test_leaders_that_turn_round_are_sumos(link: LibsumoLink, tmp_path: Path) -> None:
    """Inside a junction even a short vehicle's angle, that of the chord between its ends, may be against its lane."""
    (tmp_path / "a.rou.xml").write_text(
        """<routes><route id="r" edges="we2 ew2 ew1 we1 ew1"/>
        <vType id="c" lcOpposite="0"/>
        <flow id="f" type="c" route="r" begin="0" end="60" period="5" departPos="400" departSpeed="max"/></routes>"""
    )
    names = ("-n", str(CASES / "overtaking_lights.net.xml"), "-r", str(tmp_path / "a.rou.xml"))
    api = link.begin([*names, *QUIET])
    leaders, turning = Leaders(api), 0
    for _ in range(200):
        link.step()
        for vehicle in api.vehicle.getIDList():
            sumos, ours = api.vehicle.getLeader(vehicle, 500.0), leaders.of_ego(vehicle)
            assert (ours and ours.vehicle_id) == (sumos and sumos[0])
            turning += sumos is not None and api.vehicle.getLaneID(sumos[0]) in (":e_0_0", ":m_7_0", ":w_0_0")
    assert turning > 20
