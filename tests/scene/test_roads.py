"""Junctions, lines across lanes, streets, hills and street lamps."""

import dataclasses

import numpy as np
import pytest

from fogsim.scene import street_lamp_heads
from fogsim.scene.edges import Edge, edge_meshes
from fogsim.scene.junctions import Areas, area_mesh
from fogsim.scene.lane_index import LaneIndex
from fogsim.scene.polyline import Chainage
from fogsim.scene.road import KERB, lane_mesh, transverse_markings
from fogsim.scene.terrain import Terrain
from fogsim.values import Lane, LaneEnd, LaneKind, LaneMarking, Mesh, PavedArea, RoadNetwork, Surface
from tests.scene.conftest import build, road_under, street

L_SHAPE = np.array([[0.0, 0, 0], [10, 0, 0], [10, 4, 0], [4, 4, 0], [4, 10, 0], [0, 10, 0]])


@pytest.fixture(scope="module")
def town() -> RoadNetwork:
    """Two streets that cross at the origin; lanes in and out of four arms, and ways straight on and to the right."""
    lanes = []
    for arm, heading in enumerate(np.arange(4) * np.pi / 2):
        turn = np.array([[np.cos(heading), np.sin(heading), 0.0], [-np.sin(heading), np.cos(heading), 0.0], [0, 0, 1]])
        ways = {
            "in": [[-200.0, -1.75, 0.0], [-10.0, -1.75, 0.0]],
            "out": [[-10.0, 1.75, 0.0], [-200.0, 1.75, 0.0]],
            "on": [[-10.0, -1.75, 0.0], [10.0, -1.75, 0.0]],
            "right": [[-10.0, -1.75, 0.0], [-5.0, -3.2, 0.0], [-1.75, -10.0, 0.0]],
        }
        for name, way in ways.items():
            marks = (LaneMarking.DOUBLE, LaneMarking.SOLID, True, LaneKind.CARRIAGEWAY)
            if name in {"on", "right"}:
                marks = (LaneMarking.NONE, LaneMarking.NONE, False, LaneKind.JUNCTION)
            end = LaneEnd.STOP if name == "in" else LaneEnd.OPEN
            lanes.append(Lane(f"{name}{arm}", f"{name}{arm}", np.array(way) @ turn, 3.5, 13.9, *marks, end))
    corners = [(10, 3.5), (6, 4), (4, 6), (3.5, 10), (-3.5, 10), (-4, 6), (-6, 4), (-10, 3.5)]
    corners += [(-x, -y) for x, y in corners]
    outline = np.array([(x, y, 0.0) for x, y in corners])
    return RoadNetwork(tuple(lanes), lanes[0].centreline, (PavedArea("c", outline),))


def hill(slope: float = 0.06) -> Lane:
    x = np.linspace(0.0, 400.0, 21)
    line = np.column_stack((x, np.zeros(21), slope * x))
    return street(line, "h", 25.0, 3.5)


def areas_of(part: Mesh) -> np.ndarray:
    a, b, c = (part.positions[part.faces[:, i]].astype(float) for i in range(3))
    return 0.5 * np.cross(b - a, c - a)[:, 2]


@pytest.mark.parametrize("outline", [L_SHAPE, L_SHAPE[::-1]], ids=["counterclockwise", "clockwise"])
def test_a_concave_junction_is_paved_once_and_without_holes(outline: np.ndarray) -> None:
    mesh = area_mesh(PavedArea("j", outline))
    assert mesh is not None
    assert (areas_of(mesh) > 0).all()
    assert areas_of(mesh).sum() == pytest.approx(64.0)
    assert set(mesh.instance) == {2}


def test_a_sliver_of_a_junction_is_left_out_and_areas_tell_what_they_cover() -> None:
    assert area_mesh(PavedArea("j", np.array([[0.0, 0, 0], [5, 0, 0], [5, 0.001, 0]]))) is None
    lines = np.array([[0.0, 2, 0], [9, 2, 0]]), np.array([[2.0, 2, 0], [8, 8, 0]])
    assert Areas([PavedArea("j", L_SHAPE)]).cover_all(lines) == [True, False]
    assert Areas([]).cover_all(lines) == [False, False]
    assert Areas([PavedArea("j", L_SHAPE)]).cover_all([]) == []


def test_a_town_is_paved_wherever_vehicles_drive(town: RoadNetwork) -> None:
    ground = build(town).ground
    for lane in town.lanes:
        for x, y, z in lane.centreline[[0, len(lane.centreline) // 2, -1]].tolist():
            heights = road_under(ground, x, y)
            assert heights, lane.lane_id
            assert max(heights) == pytest.approx(z, abs=0.004)


def test_lanes_within_a_junction_are_not_drawn_twice(town: RoadNetwork) -> None:
    def paved(width: float | None) -> int:
        across = [one for one in town.lanes if one.kind is LaneKind.JUNCTION and width is not None]
        roads = [one for one in town.lanes if one.kind is LaneKind.CARRIAGEWAY]
        roads += [dataclasses.replace(one, width=width) for one in across]
        ground = build(dataclasses.replace(town, lanes=tuple(roads))).ground
        return int((ground.surface[ground.faces[:, 0]] == Surface.ROAD).sum())

    assert paved(1.0) == paved(None)
    # Those that stick out are drawn, so that nobody drives on grass.
    assert paved(6.0) > paved(None)


def test_stop_lines_span_their_lanes_at_the_junction(town: RoadNetwork) -> None:
    lane = next(lane for lane in town.lanes if lane.lane_id == "in0")
    assert lane.end is LaneEnd.STOP
    (bar,) = transverse_markings([lane])
    end = lane.centreline[-1]
    assert np.abs(bar.positions[:, 0] - end[0]).max() < 1.5
    assert np.ptp(bar.positions[:, 1]) == pytest.approx(0.98 * lane.width, rel=0.01)
    # All of the bar but its outermost sixths is within the painted line that its attributes stand for.
    assert np.ptp(bar.positions[:, 0]) / 1.5 == pytest.approx(0.5, abs=0.01)
    assert np.ptp(bar.road[:, 1]) / 1.5 == pytest.approx(0.2, abs=1e-6)
    assert set(bar.road[:, 3]) == {3.0}


def test_a_line_to_give_way_at_is_broken_and_a_crossing_is_striped() -> None:
    line = np.array([[0.0, 0, 0], [50, 0, 0]])
    none = LaneMarking.NONE
    way = Lane("a", "a", line, 3.6, 14.0, none, none, outermost=True, end=LaneEnd.YIELD)
    (teeth,) = transverse_markings([way])
    assert len(teeth.faces) == 2 * 5
    covered = sum(np.ptp(teeth.positions[4 * i : 4 * i + 4, 1]) for i in range(5))
    assert covered / 3.6 == pytest.approx(0.65, abs=0.03)
    zebra = dataclasses.replace(way, centreline=line / 5, end=LaneEnd.OPEN, kind=LaneKind.CROSSING)
    (stripes,) = transverse_markings([zebra])
    assert len(stripes.faces) == 2 * 10
    assert transverse_markings([dataclasses.replace(way, end=LaneEnd.OPEN)]) == []


def test_lanes_and_shoulders_reach_over_the_gaps_that_outlines_of_junctions_leave() -> None:
    line = np.array([[10.0, 0.0, 1.0], [10.0, 30.0, 1.0], [40.0, 30.0, 1.0]])
    lane = Lane("a_0", "a", line, 3.5, 20.0, LaneMarking.DASHED, LaneMarking.SOLID, outermost=True)
    drawn = lane_mesh(lane, Chainage([lane]))
    assert drawn.positions[:, 1].min() == pytest.approx(-0.1, abs=1e-6)
    assert drawn.positions[:, 0].max() == pytest.approx(40.1, abs=1e-5)
    # Its dashes are not stretched.
    assert np.ptp(drawn.road[:, 0]) == pytest.approx(60.2, abs=1e-4)
    line, lane = np.array([[0.0, 0.0, 0.0], [30.0, 0.0, 0.0]]), (3.5, 30.0, LaneMarking.DASHED, LaneMarking.SOLID)
    lanes = [Lane("a_0", "a", line, *lane, outermost=True)]
    edge = Edge(line, -1, 1.75, 30.0, 2.5, np.full(2, 3.2), LaneMarking.SOLID)
    for part in edge_meshes(edge, Terrain(lanes), LaneIndex(lanes))[:2]:
        assert part.positions[:, 0].min() == pytest.approx(-0.1, abs=1e-6)
        assert part.positions[:, 0].max() == pytest.approx(30.1, abs=1e-5)


def test_a_double_line_lies_inside_its_lane() -> None:
    line = np.array([[0.0, 0, 0], [50, 0, 0]])
    lane = Lane("a", "a", line, 3.5, 20.0, LaneMarking.DOUBLE, LaneMarking.SOLID, outermost=True)
    ground = build(RoadNetwork((lane,), line)).ground
    chosen = (ground.surface == Surface.ROAD) & (ground.road[:, 3] == 4.0)
    # Position of the painted lines: half the width on either side of the middle from which offsets are counted.
    middle = ground.positions[chosen, 1] - ground.road[chosen, 1]
    assert middle + ground.road[chosen, 2] == pytest.approx(1.75 - 0.16, abs=1e-5)
    assert middle - ground.road[chosen, 2] == pytest.approx(-1.75, abs=1e-5)


def test_streets_have_kerbs_and_roads_have_shoulders(town: RoadNetwork) -> None:
    ground = build(town).ground
    beside = (ground.surface == Surface.MATT) & (np.abs(ground.positions[:, 2] - KERB) < 1e-4)
    assert beside.sum() > 100
    fast = [dataclasses.replace(lane, speed_limit=25.0) for lane in town.lanes]
    other = build(dataclasses.replace(town, lanes=tuple(fast))).ground
    assert not ((other.surface == Surface.MATT) & (np.abs(other.positions[:, 2] - KERB) < 1e-4)).any()


def test_road_roadside_and_land_follow_a_hill() -> None:
    lane = hill()
    scene = build(RoadNetwork((lane,), lane.centreline))
    for x in (50.0, 200.0, 333.0):
        heights = road_under(scene.ground, x, 0.3)
        assert heights
        assert heights == pytest.approx([0.06 * x] * len(heights), abs=1e-4)
        land = max(road_under(scene.ground, x, 25.0, (Surface.MATT,)))
        assert 0.06 * x - 4.0 < land < 0.06 * x
    for batch in scene.scenery:
        if batch.shape in {"rail_post", "delineator"}:
            place = batch.transforms[:, :3, 3]
            assert place[:, 2] == pytest.approx(0.06 * place[:, 0], abs=0.01)


def test_the_land_lies_below_every_road_and_falls_to_the_plain(motorway: RoadNetwork) -> None:
    high, climbing = street(hill(0.0).centreline + np.array([0.0, 60.0, 8.0]), "b", 25.0, 3.5), hill()
    terrain = Terrain([climbing, high])
    for lane in (climbing, high):
        assert (terrain.height(lane.centreline) < lane.centreline[:, 2] - 0.3).all()
    assert terrain.height(np.array([[200.0, 900.0], [-900.0, 0.0]])) == pytest.approx(terrain.plain)
    mesh = terrain.mesh()
    assert mesh is not None
    chosen = mesh.positions[::7].astype(float)
    assert terrain.height(chosen) - 0.02 == pytest.approx(chosen[:, 2], abs=1e-4)
    # A plain has no land of its own.
    terrain = Terrain(motorway.lanes)
    assert terrain.mesh() is None
    assert terrain.height(np.zeros((3, 2))) == pytest.approx(terrain.plain) == pytest.approx(-0.1)


def test_a_road_that_passes_over_another_leaves_it_free() -> None:
    below = hill(0.0)
    x = np.linspace(-200.0, 200.0, 9)
    over = np.column_stack((np.full(9, 200.0), x, np.full(9, 7.0)))
    scene = build(RoadNetwork((below, street(over, "o", 25.0, 3.5)), below.centreline))
    surfaces = (Surface.ROAD, Surface.MATT)
    for along in (180.0, 195.0, 205.0, 220.0):
        heights = road_under(scene.ground, along, 0.0, surfaces)
        # Nothing between the lower road and a vehicle's roof.
        assert not [z for z in heights if 0.01 < z < 4.5]


def test_street_lamps_stand_on_one_side_about_every_35_m_if_asked() -> None:
    line = np.array([[0.0, 0, 0], [400, 0, 0]])
    back = line[::-1] + np.array([0.0, 3.5, 0.0])
    network = RoadNetwork((street(line, width=3.5), street(back, "b", width=3.5)), line)
    assert len(street_lamp_heads(build(network))) == 0
    scene = build(network, street_lamps=True)
    heads = street_lamp_heads(scene)
    assert np.diff(np.sort(heads[:, 0])) == pytest.approx(35.0, abs=0.1)
    assert (heads[:, 1] < -1.75).all()
    assert heads[:, 2] == pytest.approx(8.0, abs=0.1)
    (batch,) = (b for b in scene.scenery if b.shape == "street_lamp")
    index = LaneIndex(network.lanes)
    assert index.clearance(batch.transforms[:, :3, 3].astype(float)).min() > 2.0
    for ending in ("", ":far", ":tiny"):
        shape = scene.shapes["street_lamp" + ending]
        glow = shape.positions[shape.surface == Surface.LAMP_STREET]
        world = glow @ batch.transforms[0, :3, :3].T + batch.transforms[0, :3, 3]
        middle = 0.5 * (world.min(axis=0) + world.max(axis=0))
        assert np.linalg.norm(heads - middle, axis=1).min() < 0.01


def test_houses_face_streets_and_stand_along_them_only_and_clear_of_lanes_and_trees(town: RoadNetwork) -> None:
    scene = build(town)
    places = np.concatenate([b.transforms[:, :3, 3] for b in scene.scenery if b.shape.startswith("house")])
    trees = [b for b in scene.scenery if b.shape.startswith(("conifer", "broad_leaved"))]
    assert len(places) > 10
    assert LaneIndex(town.lanes).clearance(places.astype(float)).min() > 9.0
    for batch in trees:
        gap = np.abs(batch.transforms[:, None, :2, 3] - places[None, :, :2]).max(axis=2)
        assert gap.min() > 10.9
    # They face their street.
    batch = next(b for b in scene.scenery if b.shape.startswith("house"))
    for transform in batch.transforms.astype(float):
        place, front = transform[:2, 3], -transform[:2, 1] / np.linalg.norm(transform[:2, 1])
        before = np.array([[*(place + 4.0 * front), 0.0], [*(place - 4.0 * front), 0.0]])
        nearer, farther = LaneIndex(town.lanes).clearance(before)
        assert nearer < farther - 5.0
    rural = dataclasses.replace(town, lanes=tuple(dataclasses.replace(one, speed_limit=25.0) for one in town.lanes))
    assert not [batch for batch in build(rural).scenery if batch.shape.startswith("house")]
