"""Gaps to the ego from bumper to bumper, and the events that wait for them."""

import math
from dataclasses import replace

import pytest

from fogsim.errors import InputError
from fogsim.scenario import load_scenario
from fogsim.traffic import BrakeEvent, LampFailureEvent, Trigger
from fogsim.traffic.sumo.libsumo_link import LibsumoLink
from fogsim.traffic.sumo_lanes.route_position import GapToEgo
from tests.traffic.common import DATA, QUIET, SETUP, driven, running

GRID = DATA / "grid" / "grid.sumocfg"


def test_gaps_are_those_that_sumo_keeps_to_its_leaders_on_roads_and_junctions(link: LibsumoLink) -> None:
    api, compared = link.begin(["-c", str(GRID), *QUIET]), 0
    get = api.vehicle
    for _ in range(120):
        link.step()
        for ego in get.getIDList():
            leader = get.getLeader(ego, 100.0)
            # Of a vehicle that comes from a side road the gap is known once it is on the ego's.
            if leader is None or get.getRoadID(ego) not in get.getRoute(leader[0]):
                continue
            gap = max(leader[1] + get.getMinGap(ego), 0.0)
            assert GapToEgo(api, ego).measure(leader[0]) == pytest.approx(gap, abs=0.05)
            assert GapToEgo(api, leader[0]).measure(ego) == pytest.approx(-gap, abs=0.05)
            compared += 1
    assert compared > 50


def test_lamps_fail_at_sixty_metres_from_bumper_to_bumper() -> None:
    slow = BrakeEvent("lead", Trigger(at_time=0.0), to_speed=15.0)
    event = LampFailureEvent("lead", Trigger(at_gap_to_ego=60.0))
    with running(replace(SETUP, events=(slow, event))) as traffic:
        gaps = [math.inf]
        for _ in range(150):
            (snapshot,) = driven(traffic, 1)
            state, lead = snapshot.state, snapshot.state.row("lead")
            assert lead is not None
            if state.lamps[lead] == 0:
                break
            gaps.append(math.dist(state.position[lead], state.position[snapshot.ego]) - state.length[lead])
        else:
            pytest.fail("the lamps never failed")
    assert gaps[-1] == pytest.approx(60.0, abs=1.5)


def test_the_ego_has_no_gap_to_itself() -> None:
    event = "traffic.events=[{kind: lamps_fail, vehicle: ego, at_gap_to_ego_m: 5}]"
    with pytest.raises(InputError, match=r"events\.0\.at_gap_to_ego_m: 'ego' is the ego itself"):
        load_scenario("motorway_fog_bank", [event])
