"""Traffic lights and persons of a real SUMO at a crossing, and where the heads stand."""

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fogsim.traffic.road.map_cache import compacted
from fogsim.traffic.road.network import ARM_HEIGHT, LARGE_DIAMETER, POST_HEIGHT, read_net, signal_heads
from fogsim.values import SignalColour, TrafficSnapshot
from tests.traffic.common import DATA, driven, running, setup_of

NET = DATA / "crossing" / "lights.net.xml"
DEMAND = """<routes>
<vType id="c" sigma="0" speedDev="0"/>
<vType id="w" vClass="pedestrian" speed="1.2" sigma="0"/>
<vehicle id="ego" type="c" depart="0" departPos="100" departSpeed="10"><route edges="WC CE"/></vehicle>
<person id="anna" depart="0" departPos="200" type="w"><walk edges="WC CE"/></person>
<person id="bob" depart="0" departPos="250" type="w"><walk edges="CE EC" arrivalPos="10"/></person>
<person id="driven" depart="triggered"><ride from="WC" to="CE" lines="ego"/></person>
</routes>"""


def snapshots(folder: Path, steps: int, demand: str = DEMAND) -> list[TrafficSnapshot]:
    setup = replace(setup_of(folder, demand, step=0.5), net=NET)
    with running(setup, seed=0) as traffic:
        return driven(traffic, steps)


def test_persons_in_a_car_that_waits_to_enter_are_left_out(tmp_path: Path) -> None:
    demand = """<routes>
    <vehicle id="block" depart="0" departPos="6"><route edges="CE"/>
    <stop lane="CE_1" endPos="6.2" duration="9"/></vehicle>
    <vehicle id="waiting" depart="1"><route edges="CE"/></vehicle>
    <person id="p" depart="1"><ride from="CE" to="CE" lines="car"/></person>
    <vehicle id="car" depart="triggered" line="car"><route edges="CE"/></vehicle>
    <vehicle id="ego" depart="4"><route edges="WC CE"/></vehicle>
    </routes>"""
    seen = snapshots(tmp_path, 2, demand)
    assert [snapshot.state.persons.ids for snapshot in seen] == [(), ()]
    assert "car" not in seen[-1].state.ids


def test_lights_and_walkers_near_the_ego_are_told(tmp_path: Path) -> None:
    seen = snapshots(tmp_path, 12)
    signals = seen[0].state.signals
    assert set(signals.ids) == {"C"}
    colours = dict(zip(signals.lane, signals.colour, strict=True))
    ahead = seen[0].signal_ahead
    assert ahead is not None
    assert ahead.signal_id == "C"
    way = seen[1].route_position - seen[0].route_position
    assert ahead.distance - seen[1].signal_ahead.distance == pytest.approx(way)
    assert colours["WC_1"] is colours["EC_1"] is ahead.colour
    assert colours["SC_1"] is colours["NC_1"] is not ahead.colour
    # Persons cross the road that has red.
    assert [lane for lane, on_foot in zip(signals.lane, signals.on_foot, strict=True) if on_foot][:1] == [":C_c0_0"]
    assert colours[":C_c0_0"] is colours[":C_c0"] is not colours[":C_c1_0"]
    assert colours[":C_c0_0"] in {SignalColour.RED, SignalColour.GREEN}
    assert {SignalColour.RED, SignalColour.GREEN} <= set(colours.values())
    first, last = seen[0].state.persons, seen[-1].state.persons
    assert last.ids == ("anna", "bob")
    assert last.raised.all()
    walked = last.position[0] - first.position[first.ids.index("anna")]
    told = sum(float(snapshot.state.persons.speed[0]) for snapshot in seen[1:])
    assert math.hypot(*walked[:2]) == pytest.approx(0.5 * told, rel=0.05)
    assert last.heading[0] == pytest.approx(math.atan2(walked[1], walked[0]), abs=0.2)
    # Nobody on foot is among the vehicles, or ahead of the ego as a leader.
    assert "anna" not in seen[-1].state.ids
    assert all(snapshot.leader is None for snapshot in seen)


def test_each_lane_with_a_light_has_a_head_beside_its_stop_line() -> None:
    roads = read_net(NET)
    heads = [head for head in roads.signal_heads if not head.on_foot]
    assert {head.lane_id for head in heads} == {"WC_1", "EC_1", "SC_1", "NC_1"}
    lanes = {lane.lane_id: lane for lane in roads.lanes}
    for head in heads:
        lane = lanes[head.lane_id]
        end, ahead = lane.centreline[-1], np.array([math.cos(head.heading), math.sin(head.heading)])
        off = np.array(head.post[:2]) - end[:2]
        right = off @ (ahead[1], -ahead[0])
        assert lane.width / 2 < right < lane.width / 2 + 1.0
        assert abs(off @ ahead) < 1e-6
        assert head.position[2] == pytest.approx(end[2] + POST_HEIGHT)
        assert head.links


def test_crossings_with_lights_have_heads_for_persons_beyond_either_end() -> None:
    roads = read_net(NET)
    assert compacted(roads).signal_heads == roads.signal_heads
    heads = {head.lane_id: head for head in roads.signal_heads if head.on_foot}
    assert set(heads) == {name for number in range(4) for name in (f":C_c{number}", f":C_c{number}_0")}
    lanes = {lane.lane_id: lane for lane in roads.lanes}
    for number in range(4):
        there, back = heads[f":C_c{number}_0"], heads[f":C_c{number}"]
        line = lanes[there.lane_id].centreline
        assert there.links == back.links
        assert math.cos(there.heading - back.heading) == pytest.approx(-1.0)
        for head, end in ((there, line[-1]), (back, line[0])):
            off, ahead = np.array(head.post[:2]) - end[:2], np.array([math.cos(head.heading), math.sin(head.heading)])
            assert off @ ahead == pytest.approx(0.5)
            assert off @ (ahead[1], -ahead[0]) > 0.5 * lanes[there.lane_id].width


def lane_east(name: str, y: float, links: tuple[int, ...]) -> Any:
    """A lane that leads east, as sumolib has it, with its ways across a junction."""
    ways = [SimpleNamespace(getTLSID=lambda: "J", getTLLinkIndex=lambda link=link: link) for link in links]
    return SimpleNamespace(
        getID=lambda: name,
        getShape3D=lambda: [(0.0, y, 1.0), (100.0, y, 1.0)],
        getWidth=lambda: 3.2,
        getSpeed=lambda: 13.9,
        getOutgoing=lambda: ways,
    )


def test_on_wider_roads_further_lanes_have_theirs_above_them() -> None:
    lanes = [lane_east(f"a_{n}", 3.2 * n, links) for n, links in enumerate([(0, 1), (2,), (4, 3)])]
    first, second, third = signal_heads(lanes, side=-1.0)
    assert first.post == second.post == third.post == pytest.approx((100.0, -2.2, 1.0))
    assert first.position == pytest.approx((100.0, -2.2, 1.0 + POST_HEIGHT))
    assert second.position == pytest.approx((100.0, 3.2, 1.0 + ARM_HEIGHT))
    assert third.position == pytest.approx((100.0, 6.4, 1.0 + ARM_HEIGHT))
    assert third.links == (3, 4)
    assert second.diameter == LARGE_DIAMETER
    mirrored = [lane_east(f"a_{n}", -3.2 * n, (n,)) for n in range(2)]
    assert next(signal_heads(mirrored, side=1.0)).post == pytest.approx((100.0, 2.2, 1.0))
    assert not list(signal_heads([lane_east("a_0", 0.0, ())], side=-1.0))
