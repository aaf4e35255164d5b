"""What lies beside roads keeps off all others, in networks of any kind."""

import numpy as np
import pytest

from fogsim.scene import build_scene, street_lamp_heads
from fogsim.scene.junctions import free_borders, walkable
from fogsim.scene.lane_index import LaneIndex
from fogsim.scene.road import KERB
from fogsim.values import (
    Lane,
    LaneKind,
    LaneMarking,
    PavedArea,
    RoadNetwork,
    Scene,
    Sign,
    SignMap,
    Structure,
    StructureKind,
    Surface,
)
from tests.scene.conftest import build, road_under, street


def test_nothing_beside_a_road_covers_the_lanes_of_another() -> None:
    # A street whose directions lie 1.2 m apart, and narrow to nothing.
    there = street([[0.0, 0, 0], [60, 0, 0], [120, 0, 0]])
    beside = there.centreline[::-1] + np.array([[0.0, 3.2, 0], [0, 4.4, 0], [0, 4.4, 0]])
    back = street(beside, "b")
    ground = build(RoadNetwork((there, back), there.centreline)).ground
    raised = (ground.surface == Surface.MATT) & (ground.positions[:, 2] > 0.01)
    assert raised.sum() > 100
    assert LaneIndex([there, back]).clearance(ground.positions[raised].astype(float)).min() > -0.15
    # Both directions share the ground between them.
    for y in (1.9, 2.5):
        assert max(road_under(ground, 10.0, y, (Surface.MATT,))) == pytest.approx(KERB)


def test_what_lies_beside_a_road_and_a_footway_reach_up_to_the_road_that_they_end_at() -> None:
    into = street([[-100.0, 0, 0], [0, 0, 0]])
    other = street([[1.6, 80.0, 0], [1.6, -80, 0]], "b")
    ground = build(RoadNetwork((into, other), into.centreline)).ground
    assert max(road_under(ground, -0.5, -2.5, (Surface.MATT,))) == pytest.approx(KERB)
    road = street([[-40.0, 0, 0], [40, 0, 0]])
    none = LaneMarking.NONE
    way = Lane("w", "w", road.centreline[:, [1, 0, 2]], 2.0, 2.8, none, none, outermost=False, kind=LaneKind.FOOTWAY)
    ground = build(RoadNetwork((road, way), road.centreline)).ground
    assert max(road_under(ground, 0.0, 10.0, (Surface.MATT,))) == pytest.approx(KERB)
    assert max(road_under(ground, 0.0, 0.0, (Surface.MATT,)), default=-1.0) < 0.0


def test_a_walking_area_that_vehicles_drive_over_is_no_kerb_in_their_way() -> None:
    line, none = np.array([[-60.0, 0, 0], [60, 0, 0]]), LaneMarking.NONE
    lane = Lane("a", "a", line, 3.2, 13.9, none, none, outermost=True)
    over = np.array([[-3.0, -5, 0], [3, -5, 0], [3, 5, 0], [-3, 5, 0]])
    beside = over + np.array([0.0, 8.0, 0.0])
    areas = tuple(PavedArea(str(k), outline, LaneKind.FOOTWAY) for k, outline in enumerate((over, beside)))
    assert [area.area_id for area in walkable(areas, [lane])] == ["1"]


def test_a_road_leads_on_from_the_middle_of_a_long_border() -> None:
    lane = street([[-60.0, 0, 0], [0, 0, 0]])
    area = PavedArea("j", np.array([[0.0, -8, 0], [6, -8, 0], [6, 8, 0], [0, 8, 0]]))
    for edge in free_borders([area], [lane], LaneIndex([lane])):
        inner = edge.line[np.abs(edge.line[:, 0]) < 0.01]
        assert (np.abs(inner[:, 1]) > 1.5).all()


def test_woods_keep_off_the_road_from_end_to_end() -> None:
    rng = np.random.default_rng(3)
    lines = [np.array([[-900.0, y, 0], [900, y, 0]]) for y in (0.0, 160.0)]
    lanes = [street(line, str(k), 25.0, 3.5) for k, line in enumerate(lines)]
    scene = build_scene(RoadNetwork(tuple(lanes), lines[0]), SignMap(), rng)
    woods = [batch.transforms.astype(float) for batch in scene.scenery if batch.shape.startswith("woodland")]
    assert sum(map(len, woods)) > 10
    index = LaneIndex(lanes)
    for transform in np.concatenate(woods):
        along = np.linspace(-0.5, 0.5, 21)[:, None] * transform[:3, 0]
        assert index.clearance(transform[:3, 3] + along).min() > 5.0


def test_houses_of_a_street_keep_their_distance_however_many_there_are() -> None:
    line = np.array([[0.0, 0, 0], [400, 0, 0]])
    lanes = tuple(street(line + np.array([0.0, 34.0 * k, 0]), f"{k}") for k in range(6))
    scene = build(RoadNetwork(lanes, line))
    places = np.concatenate([b.transforms[:, :2, 3] for b in scene.scenery if b.shape.startswith("house")])
    apart = np.linalg.norm(places[:, None] - places[None], axis=2)
    assert len(places) > 40
    assert apart[~np.eye(len(places), dtype=bool)].min() > 16.0


def test_nothing_is_put_by_chance_where_a_building_stands() -> None:
    line = np.array([[0.0, 0, 0], [400, 0, 0]])
    wall = line * 0.5 + np.array([0.0, 12.0, 0.0])
    building = Structure("b", StructureKind.BUILDING, wall, 0.6, 0.0, 20.0)
    bare, built = (build(RoadNetwork((street(line),), line, structures=own)) for own in ((), (building,)))

    def beside_the_wall(scene: Scene) -> int:
        batches = [b for b in scene.scenery if b.shape.startswith(("house", "conifer", "broad_leaved"))]
        places = np.concatenate([b.transforms[:, :2, 3] for b in batches])
        return int(np.sum((places[:, 0] < 200.0) & (np.abs(places[:, 1] - 12.0) < 10.0)))

    assert beside_the_wall(bare) > 3
    assert beside_the_wall(built) == 0


def test_a_border_is_not_free_where_lanes_stick_out_of_their_junction() -> None:
    none = LaneMarking.NONE
    leading = street(np.array([[-40.0, 0, 0], [0, 0, 0]]))
    area = PavedArea("j", np.array([[0.0, -2, 0], [20, -2, 0], [20, 2, 0], [0, 2, 0]]))
    bend = np.array([[0.0, 0, 0], [10, -2.5, 0], [20, 0, 0]])
    across = Lane(":j", ":j", bend, 3.2, 6.0, none, none, outermost=False, kind=LaneKind.JUNCTION)
    reached = []
    for lanes in ([leading], [leading, across]):
        edges = free_borders([area], [leading], LaneIndex(lanes))
        lower = np.concatenate([edge.line[edge.line[:, 1] < -1.9, 0] for edge in edges])
        reached.append(bool(np.any((lower > 8.5) & (lower < 11.5))) or len(lower) < 4)
    assert reached == [True, False]


def test_street_lamps_stand_on_the_left_where_vehicles_keep_to_it() -> None:
    there = street([[0.0, 0, 0], [200, 0, 0]])
    back = street(there.centreline[::-1] - np.array([0.0, 3.2, 0.0]), "b")
    network = RoadNetwork((there, back), there.centreline)
    scene = build(network, street_lamps=True)
    heads = street_lamp_heads(scene)
    feet = np.concatenate([b.transforms[:, :3, 3] for b in scene.scenery if b.shape == "street_lamp"]).astype(float)
    index = LaneIndex([there, back])
    assert len(heads) >= 5
    # Arms reach from the pole to the road.
    assert (index.clearance(heads) < index.clearance(feet) - 1.0).all()


def test_footways_are_drawn_where_there_is_no_road() -> None:
    line, none = np.array([[-40.0, 0, 0], [40, 0, 0]]), LaneMarking.NONE
    way = Lane("w", "w", line, 2.0, 2.8, none, none, outermost=False, kind=LaneKind.FOOTWAY)
    corner = PavedArea("a", np.array([[40.0, -2, 0], [44, -2, 0], [44, 2, 0], [40, 2, 0]]), LaneKind.FOOTWAY)
    sign = Sign("s", "speed_limit", 10.0, (0.0, -3.0, 2.6), 0.0, 0.9)
    scene = build(RoadNetwork((way,), line, (corner,)), sign)
    for x in (0.0, 42.0):
        assert max(road_under(scene.ground, x, 0.0, (Surface.MATT,))) == pytest.approx(KERB)
