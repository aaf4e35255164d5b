"""SUMO's vehicles change lane in one step; the camera sees them glide."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from fogsim.traffic import AttachedTraffic
from fogsim.traffic.sumo.lane_changes import DURATION, LaneChangeSmoothing
from fogsim.traffic.sumo.libsumo_link import LibsumoLink
from fogsim.traffic.sumo.vehicle_reader import VehicleReader
from fogsim.traffic.sumo_traffic import command_line
from fogsim.values import Command, SpeedAdvice, TrafficState
from tests.helpers.vehicles import vehicles
from tests.traffic.common import MOTORWAY, SETUP, seen

BUSY = replace(SETUP, routes=(MOTORWAY / "motorway.rou.xml",), additional=(), keep_lane=())
LARGEST_STEP = 0.2
"""Farther than this nobody is to move sideways within 0.1 s [m]."""


def test_nobody_jumps_and_everybody_ends_in_sumos_lane(link: LibsumoLink) -> None:
    """Shown and true states in a simulation that its owner steps."""
    api = link.begin(command_line(BUSY, 1))
    while "ego" not in api.vehicle.getIDList():
        api.simulationStep()
    traffic = AttachedTraffic(BUSY, api)
    traffic.start(1)
    truth, states = VehicleReader(api, "ego", BUSY.reading_radius), []
    for _ in range(350):
        traffic.obey(Command(SpeedAdvice(28.0)))
        api.simulationStep()
        traffic.look()
        states.append((seen(traffic).state, truth.state(Command().lamps)))
    traffic.release()
    aside: list[list[float]] = []
    for (last, now), (last_true, true) in zip(*map(itertools.pairwise, zip(*states, strict=True)), strict=True):
        for name in ("ids", "lane", "speed", "acceleration", "lamps"):
            assert np.array_equal(getattr(now, name), getattr(true, name)), name
        for new, vehicle in enumerate(now.ids):
            if (old := last.row(vehicle)) is not None:
                heading = true.heading[new]
                moved = [b.position[new] - a.position[old] for a, b in ((last, now), (last_true, true))]
                aside.append([abs(way[1] * np.cos(heading) - way[0] * np.sin(heading)) for way in moved])
    shown, sumos = np.array(aside).T
    assert np.count_nonzero(sumos > 3.0) >= 10
    assert shown.max() < LARGEST_STEP
    arrived, longest = 0, round(DURATION / BUSY.step_length) + 3
    for i in range(longest, len(states)):
        now, true = states[i]
        for row, vehicle in enumerate(now.ids):
            past = [s.lane[r] for s, _ in states[i - longest : i + 1] if (r := s.row(vehicle)) is not None]
            indices = [lane.rpartition("_")[2] for lane in past]
            if len(past) > longest and len(set(indices[1:])) == 1:
                assert np.array_equal(now.position[row], true.position[row])
                assert now.heading[row] == true.heading[row]
                arrived += indices[0] != indices[1]
    assert arrived >= 10


def ego_at(time: float, x: float, y: float, lane: str, heading: float = 0.0) -> TrafficState:
    return vehicles([[x, y, 0.0]], time=time, ids=("ego",), heading=heading, speed=20.0, lane=lane)


def smoothed(smoothing: LaneChangeSmoothing, state: TrafficState) -> TrafficState:
    smoothing.smooth(state)
    return state


def stays(smoothing: LaneChangeSmoothing, state: TrafficState) -> bool:
    position, heading = state.position.copy(), state.heading.copy()
    smoothing.smooth(state)
    return bool((state.position == position).all() and (state.heading == heading).all())


def test_the_egos_pose_follows_a_smoothstep() -> None:
    smoothing = LaneChangeSmoothing()
    first = smoothed(smoothing, ego_at(0.0, 0.0, -3.0, "road_0"))
    first.position[:] = 0.0  # as its user may
    begun = smoothed(smoothing, ego_at(0.1, 2.0, 0.0, "road_1"))
    assert (begun.position[0].tolist(), begun.heading[0]) == ([2.0, -3.0, 0.0], 0.0)
    half = smoothed(smoothing, ego_at(0.1 + 0.5 * DURATION, 32.0, 0.0, "road_1"))
    assert half.position[0, 1] == pytest.approx(-1.5)
    # Fastest in the middle, where a smoothstep rises by 1.5 times its mean.
    assert half.heading[0] == pytest.approx(np.arctan2(1.5 * 3.0 / DURATION, 20.0))
    assert stays(smoothing, ego_at(0.1 + DURATION, 62.0, 0.0, "road_1"))


def course(*lanes: int) -> NDArray[np.float64]:
    """Shown places across a road whose lanes are 3.5 m wide, for the ego's lane in each step [m]."""
    smoothing = LaneChangeSmoothing()
    states = (ego_at(0.1 * k, 2.0 * k, 3.5 * lane, f"road_{lane}") for k, lane in enumerate(lanes))
    return np.array([smoothed(smoothing, state).position[0, 1] for state in states])


def test_who_changes_back_on_the_way_neither_jumps_nor_turns_at_once_and_two_lanes_at_once_take_longer() -> None:
    y = course(*[0] * 10, *[1] * 15, *[0] * 75)
    assert np.abs(np.diff(y)).max() < LARGEST_STEP
    assert np.abs(np.diff(y, 2)).max() < 0.05
    assert 1.0 < y.max() < 3.5
    assert y[-1] == 0.0
    y = course(*[0] * 10, *[2] * 70)
    assert np.abs(np.diff(y)).max() < LARGEST_STEP
    assert y[-1] == 7.0


def test_bends_and_moves_by_hand_are_no_changes_of_lane() -> None:
    smoothing = LaneChangeSmoothing()
    smoothing.smooth(ego_at(0.0, 0.0, 0.0, "road_0"))
    # A quarter of a circle with a radius of 20 m, to the next edge.
    turned = ego_at(1.5, 20.0, 20.0, "side_0", heading=np.pi / 2)
    assert stays(smoothing, turned)
    carried = ego_at(1.6, 500.0, 25.0, "road_1", heading=np.pi / 2)
    assert stays(smoothing, carried)
    lifted = ego_at(1.7, 500.0 - 30.0, 27.0, "road_5", heading=np.pi / 2)
    assert stays(smoothing, lifted)
    smoothing = LaneChangeSmoothing()
    smoothing.smooth(ego_at(0.0, 0.0, 0.0, "road_0"))
    within_one_step = ego_at(1.0, 8.0, 2.0, "side_0", heading=np.pi / 2)
    assert stays(smoothing, within_one_step)


def test_who_leaves_on_the_way_is_forgotten() -> None:
    smoothing = LaneChangeSmoothing()
    smoothing.smooth(ego_at(0.0, 0.0, 0.0, "road_0"))
    smoothing.smooth(ego_at(0.1, 2.0, 3.5, "road_1"))
    other = replace(ego_at(0.2, 4.0, 3.5, "road_1"), ids=("other",))
    assert stays(smoothing, other)
    back = ego_at(0.3, 6.0, 3.5, "road_1")
    assert stays(smoothing, back)
