"""Gaps to the ego from bumper to bumper, and the events that wait for them."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import libsumo
import pytest

from fogsim.errors import InputError
from fogsim.scenario import load_scenario
from fogsim.traffic import BrakeEvent, LampFailureEvent, Trigger, libsumo_traffic
from fogsim.traffic.drivers.events import Script, Situation
from fogsim.traffic.sumo.gaps import GapToEgo, signed_gap
from fogsim.values import Command
from tests.traffic.test_libsumo_traffic import SETUP

GRID = Path(__file__).resolve().parents[2] / "data" / "grid" / "grid.sumocfg"


@pytest.mark.parametrize(
    ("ahead", "behind", "gap"),
    [
        (20.0, None, 15.0),  # a truck of 5 m whose front is 20 m ahead
        (None, 20.0, -16.0),  # its front is 20 m behind that of an ego of 4 m
        (3.0, None, 0.0),
        (0.0, 0.0, 0.0),
        (None, 3.0, 0.0),
        (None, None, None),
        (20.0, 500.0, 15.0),
        (500.0, 20.0, -16.0),
    ],
)
def test_a_gap_has_the_sign_of_who_is_ahead(ahead: float | None, behind: float | None, gap: float | None) -> None:
    assert signed_gap(ahead, behind, 5.0, 4.0) == gap


def fired_at(wanted: float, gaps: Sequence[float | None]) -> int | None:
    """Step in which an event begins."""
    script = Script([LampFailureEvent("a", Trigger(at_gap_to_ego=wanted))])
    for step, gap in enumerate(gaps):
        script.play(Situation(float(step), {"a"}, lambda _: 0.0, lambda _, gap=gap: gap, lambda *_: True))  # type: ignore[misc]  # bound
        if script.dark:
            return step
    return None


@pytest.mark.parametrize(
    ("wanted", "gaps", "step"),
    [
        (15.0, [30.0, 20.0, 14.0], 2),  # the ego closes in
        (15.0, [-30.0, -5.0, 0.0, 5.0, 16.0], 4),  # overtakes and gets away: not as soon as it is ahead
        (15.0, [-15.0, -10.0, -15.0], None),  # the other side
        (-15.0, [-30.0, -14.0], 1),
        (-15.0, [14.0, 0.0, -16.0], 2),
        (15.0, [10.0], 0),  # nearer when it is first seen
        (15.0, [-10.0], None),
        (-15.0, [-10.0], 0),
        (15.0, [20.0, None, 10.0], 2),
        (0.0, [-3.0, 0.0], 1),
        (0.0, [-3.0, 3.0], 1),
        (15.0, [None, None], None),
    ],
)
def test_an_event_begins_when_its_gap_is_reached(wanted: float, gaps: Sequence[float | None], step: int | None) -> None:
    assert fired_at(wanted, gaps) == step


def test_gaps_are_those_that_sumo_keeps_to_its_leaders_on_roads_and_junctions() -> None:
    libsumo.start(["sumo", "-c", str(GRID), "--no-step-log", "true", "--no-warnings", "true"])
    try:
        compared = 0
        for _ in range(120):
            libsumo.simulationStep()
            there = libsumo.vehicle.getIDList()
            for ego in there:
                leader = libsumo.vehicle.getLeader(ego, 100.0)
                # Of a vehicle that comes from a side road the gap is known once it is on the ego's.
                if leader is None or not set(libsumo.vehicle.getRoute(leader[0])) & {libsumo.vehicle.getRoadID(ego)}:
                    continue
                gap = max(leader[1] + libsumo.vehicle.getMinGap(ego), 0.0)
                assert GapToEgo(libsumo, ego).measure(leader[0]) == pytest.approx(gap, abs=0.05)
                assert GapToEgo(libsumo, leader[0]).measure(ego) == pytest.approx(-gap, abs=0.05)
                compared += 1
        assert compared > 50
    finally:
        libsumo.close()


def test_lamps_fail_at_sixty_metres_from_bumper_to_bumper() -> None:
    slow = BrakeEvent("lead", Trigger(at_time=0.0), to_speed=15.0)
    event = LampFailureEvent("lead", Trigger(at_gap_to_ego=60.0))
    traffic = libsumo_traffic(replace(SETUP, events=(slow, event)))
    try:
        traffic.start(1)
        gaps = [math.inf]
        for _ in range(150):
            traffic.advance(Command())
            snapshot = traffic.observe()
            assert snapshot is not None
            state, lead = snapshot.state, snapshot.state.row("lead")
            assert lead is not None
            if state.lamps[lead] == 0:
                break
            gaps.append(math.dist(state.position[lead], state.position[snapshot.ego]) - state.length[lead])
        else:
            pytest.fail("the lamps never failed")
    finally:
        traffic.close()
    assert gaps[-1] == pytest.approx(60.0, abs=1.5)


def test_of_two_events_that_brake_a_vehicle_the_lower_speed_counts_until_both_are_over() -> None:
    events = [
        BrakeEvent("a", Trigger(at_time=1.0), to_speed=5.0, hold=4.0),
        BrakeEvent("a", Trigger(at_time=0.0), to_speed=10.0, hold=9.0),
    ]
    script = Script(events)
    situations = [Situation(t, {"a"}, lambda _: 0.0, lambda _: None, lambda *_: True) for t in range(11)]
    wanted = [script.play(situation).orders.get("a") for situation in situations]
    assert [o and o[0] for o in wanted] == [10.0, *[5.0] * 4, *[10.0] * 4, math.inf, None]


def test_the_ego_has_no_gap_to_itself() -> None:
    event = "traffic.events=[{kind: lamps_fail, vehicle: ego, at_gap_to_ego_m: 5}]"
    with pytest.raises(InputError, match=r"events\.0\.at_gap_to_ego_m: 'ego' is the ego itself"):
        load_scenario("motorway_fog_bank", [event])
