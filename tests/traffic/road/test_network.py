import gzip
import re
from pathlib import Path

import numpy as np
import pytest
import sumo

from fogsim.errors import InputError
from fogsim.scene import build_scene
from fogsim.traffic.road.map_cache import compacted
from fogsim.traffic.road.network import read_net, road_network
from fogsim.traffic.road.signs import sign_map
from fogsim.values import LaneEnd, LaneKind, LaneMarking, SignMap
from tests.traffic.common import DATA, NET

GRID = DATA / "grid" / "grid.net.xml"


def test_lanes_of_the_motorway() -> None:
    network = road_network(read_net(NET), ["approach", "bank", "exit"])
    lanes = {lane.lane_id: lane for lane in network.lanes}
    right, middle, left = (lanes[f"bank_{i}"] for i in range(3))
    assert (right.right, right.left) == (LaneMarking.SOLID, LaneMarking.DASHED)
    assert (middle.right, middle.left) == (LaneMarking.DASHED, LaneMarking.DASHED)
    assert (left.right, left.left) == (LaneMarking.DASHED, LaneMarking.SOLID)
    assert right.outermost
    assert not middle.outermost
    assert right.speed_limit == pytest.approx(110 / 3.6, abs=0.01)
    assert np.linalg.norm(right.centreline[0] - middle.centreline[0]) == pytest.approx(3.75, abs=0.02)


def test_the_route_runs_along_the_middle_lanes_without_jumps() -> None:
    network = road_network(read_net(NET), ["approach", "bank", "exit"])
    route = network.route
    steps = np.linalg.norm(np.diff(route, axis=0), axis=1)
    assert steps.sum() == pytest.approx(5500.0, rel=0.005)
    assert steps.min() > 0
    assert steps.max() < 25.0
    changes = np.flatnonzero(np.diff(network.route_limits))
    places = np.cumsum(np.concatenate(([0.0], steps)))[changes]
    assert network.route_limits[[0, changes[1], -1]] * 3.6 == pytest.approx([130.0, 110.0, 130.0], abs=0.02)
    assert places == pytest.approx([900.0, 900.0 + 2504.0], abs=0.5)


def test_a_town_has_junctions_stop_lines_and_double_lines_between_directions() -> None:
    network = road_network(read_net(GRID), ["A0B0"])
    lanes = {lane.lane_id: lane for lane in network.lanes}
    assert len([area for area in network.areas if area.area_id in {"A0", "B0", "C0", "A1", "B1", "C1"}]) == 6
    right, left = lanes["A0B0_0"], lanes["A0B0_1"]
    assert (right.right, right.left, left.left) == (LaneMarking.SOLID, LaneMarking.DASHED, LaneMarking.DOUBLE)
    assert right.end == left.end == LaneEnd.STOP
    away = next(lane for lane in network.lanes if lane.lane_id == "A0left0_0")
    assert away.end is LaneEnd.OPEN
    inside = [lane for lane in network.lanes if lane.lane_id.startswith(":")]
    assert {lane.kind for lane in inside} == {LaneKind.JUNCTION}
    assert {lane.left for lane in inside} == {LaneMarking.NONE}


@pytest.mark.parametrize(("edge", "shape", "count"), [("e", "", 0), ("f", ' shape="0,0"', 1)])
def test_a_lane_without_a_shape_is_named(tmp_path: Path, edge: str, shape: str, count: int) -> None:
    file, lane = tmp_path / "bare.net.xml", f"{edge}_0"
    file.write_text(
        '<net version="1.20"><location netOffset="0,0" convBoundary="0,0,1,1" origBoundary="0,0,1,1" '
        f'projParameter="!"/><edge id="{edge}" from="a" to="b">'
        f'<lane id="{lane}" index="0" speed="10" length="10"{shape}/></edge>'
        '<junction id="a" type="dead_end" x="0" y="0" incLanes="" intLanes=""/>'
        f'<junction id="b" type="dead_end" x="1" y="0" incLanes="{lane}" intLanes=""/></net>',
        encoding="utf-8",
    )
    with pytest.raises(InputError, match=rf"lane '{lane}' of edge '{edge}'.*shape.*got {count}"):
        road_network(read_net(file), [edge])


def test_where_vehicles_keep_to_the_left_lines_lie_the_other_way_round(tmp_path: Path) -> None:
    text = GRID.read_text(encoding="utf-8").replace("<net ", '<net lefthand="true" ', 1)
    file = tmp_path / "left.net.xml.gz"
    file.write_bytes(gzip.compress(text.encode()))
    usual, left = (
        {lane.lane_id: lane for lane in road_network(read_net(path), ["A0B0"]).lanes} for path in (GRID, file)
    )
    assert set(usual) == set(left)
    assert [compacted(read_net(path)).left_hand for path in (GRID, file)] == [False, True]
    right = tmp_path / "right.net.xml"
    for word in ("0", "no", "False"):  # SUMO's words for it
        right.write_text(text.replace('lefthand="true"', f'lefthand="{word}"'), encoding="utf-8")
        assert not read_net(right).left_hand
    for name in ("A0B0_0", "A0B0_1"):
        assert (left[name].left, left[name].right) == (usual[name].right, usual[name].left)
        assert left[name].outermost is not usual[name].outermost


def test_signs_stand_on_the_side_that_vehicles_keep_to(tmp_path: Path) -> None:
    usual, file = NET.read_text(encoding="utf-8"), tmp_path / "left.net.xml"
    file.write_text(usual.replace("<net ", '<net lefthand="true" ', 1), encoding="utf-8")
    there, here = (sign_map(read_net(path), ()).signs for path in (NET, file))
    assert there
    for one, other in zip(there, here, strict=True):
        to_the_left = np.array([-np.sin(one.heading), np.cos(one.heading)])
        apart = np.array(other.position[:2]) - one.position[:2]
        assert apart @ to_the_left > 5.0


def test_only_roads_for_vehicles_have_speed_limit_signs(tmp_path: Path) -> None:
    for users, has_signs in (("rail", False), ("pedestrian", False), ("bus", True)):
        file = tmp_path / f"{users}.net.xml"
        file.write_text(NET.read_text(encoding="utf-8").replace("<lane ", f'<lane allow="{users}" '), encoding="utf-8")
        assert bool(read_net(file).limit_signs) is has_signs, users


def test_the_limit_on_a_sign_is_that_of_the_fastest_lane(tmp_path: Path) -> None:
    file, text = tmp_path / "lorries.net.xml", NET.read_text(encoding="utf-8")
    file.write_text(re.sub(r'(<lane id="[^"]*_0"[^>]* speed=")[^"]*', r"\g<1>5.00", text), encoding="utf-8")
    usual, here = (read_net(path).limit_signs for path in (NET, file))
    assert [sign.value for sign in here] == [sign.value for sign in usual] != []


def test_a_lane_of_no_length_has_no_sign(tmp_path: Path) -> None:
    lane = '<edge id="{0}" from="{1}" to="{2}"><lane id="{0}_0" index="0" speed="{3}" length="9" shape="{4}"/></edge>'
    edges = lane.format("a", "n", "m", 10, "0,0 0,0 9,0"), lane.format("b", "m", "n", 20, "9,0 9,0")
    nodes = "".join(
        f'<junction id="{name}" type="dead_end" x="{x}" y="0" incLanes="" intLanes="" shape=""/>'
        for name, x in (("n", 0), ("m", 9))
    )
    file = tmp_path / "small.net.xml"
    file.write_text(f'<net version="1.20">{"".join(edges)}{nodes}</net>', encoding="utf-8")
    (sign,) = sign_map(read_net(file), ()).signs
    assert sign.sign_id == "limit.a"
    assert np.isfinite(sign.position).all()
    assert sign.heading == 0.0


def test_a_sign_stands_on_no_other_road(tmp_path: Path) -> None:
    lane = '<edge id="{0}" from="{1}" to="{2}"><lane id="{0}_0" index="0" speed="{3}" length="99" shape="{4}"/></edge>'
    # A slip road on the right of the road whose limit changes where they part.
    edges = (
        lane.format("a", "l", "n", 30, "-99,0 0,0"),
        lane.format("b", "n", "m", 20, "0,0 99,0"),
        lane.format("c", "n", "k", 30, "0,-5.5 99,-5.5"),
    )
    nodes = "".join(
        f'<junction id="{name}" type="dead_end" x="{x}" y="0" incLanes="" intLanes="" shape=""/>'
        for name, x in (("l", -99), ("n", 0), ("m", 99), ("k", 99))
    )
    joins = '<connection from="a" to="{}" fromLane="0" toLane="0" dir="s" state="M"/>'
    text = f'<net version="1.20">{"".join(edges)}{nodes}{joins.format("b")}{joins.format("c")}</net>'
    file = tmp_path / "slip.net.xml"
    file.write_text(text, encoding="utf-8")
    sign = next(sign for sign in sign_map(read_net(file), ()).signs if sign.sign_id == "limit.b")
    assert sign.position[1] < -1.6
    assert abs(sign.position[1] + 5.5) > 1.6


def test_in_a_network_of_tracks_alone_they_are_drawn_as_lanes_without_lines() -> None:
    net = read_net(Path(sumo.SUMO_HOME, "tools", "game", "rail_demo", "net.net.xml"))
    network = road_network(net, ["E1", "E7"])
    assert {lane.kind for lane in network.lanes} == {LaneKind.CARRIAGEWAY}
    assert {line for lane in network.lanes for line in (lane.left, lane.right)} == {LaneMarking.NONE}
    assert len(build_scene(network, SignMap(), np.random.default_rng(1)).ground.faces) > 0


def test_tracks_are_drawn_next_to_footways_where_there_is_no_road(tmp_path: Path) -> None:
    text = (
        NET.read_text(encoding="utf-8").replace("<lane ", '<lane allow="rail" ').replace('"rail" ', '"pedestrian" ', 1)
    )
    file = tmp_path / "station.net.xml"
    file.write_text(text, encoding="utf-8")
    lanes = road_network(read_net(file), ["bank"]).lanes
    assert {lane.kind for lane in lanes} == {LaneKind.CARRIAGEWAY, LaneKind.FOOTWAY}


def test_networks_of_early_versions_are_read(tmp_path: Path) -> None:
    text, file = NET.read_text(encoding="utf-8"), tmp_path / "early.net.xml"
    early = re.sub(r' intLanes="[^"]*"', "", text).replace('<edge id="bank"', '<edge id="bank" function="normal"')
    file.write_text(early, encoding="utf-8")
    assert read_net(file).edges == read_net(NET).edges


def test_what_a_network_lacks_is_named(tmp_path: Path) -> None:
    text, file = NET.read_text(encoding="utf-8"), tmp_path / "torn.net.xml"
    no_version = re.sub(r'<net version="[^"]*"', "<net", text)
    for torn, lacks in (
        ("<net><edge", "not a SUMO network"),
        ('<net version="1.20"></net>', "has no edges"),
        (no_version, "<net>: not a SUMO network: it lacks the attribute 'version'"),
        (
            text.replace('<edge id="bank"', '<edge id="banks"'),
            "not a SUMO network: nothing before it has the id 'bank'",
        ),
    ):
        file.write_text(torn, encoding="utf-8")
        with pytest.raises(InputError, match=lacks):
            read_net(file)
