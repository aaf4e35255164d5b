import dataclasses

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.scene.lane_index import LaneIndex
from fogsim.values import RoadNetwork, Scene, Surface
from tests.scene.conftest import LIMIT, build, street


@pytest.fixture(scope="module")
def scene(motorway: RoadNetwork) -> Scene:
    return build(motorway, LIMIT)


def test_the_same_seed_builds_the_same_scene(motorway: RoadNetwork, scene: Scene) -> None:
    again = build(motorway, LIMIT)
    for field in dataclasses.fields(scene.ground):
        assert np.array_equal(getattr(scene.ground, field.name), getattr(again.ground, field.name))
    assert [batch.shape for batch in again.scenery] == [batch.shape for batch in scene.scenery]
    for one, other in zip(scene.scenery, again.scenery, strict=True):
        assert np.array_equal(one.transforms, other.transforms)


def test_every_batch_has_its_shape_and_every_mesh_is_sound(scene: Scene) -> None:
    assert {batch.shape for batch in scene.scenery} <= set(scene.shapes)
    for mesh in (scene.ground, *scene.shapes.values()):
        assert mesh.faces.max() < len(mesh.positions)
        assert np.isfinite(mesh.positions).all()
        assert np.linalg.norm(mesh.normals, axis=1) == pytest.approx(1.0, abs=1e-3)
        assert (mesh.reflectance >= 0).all()
        assert (mesh.reflectance <= 1).all()
        assert (mesh.surface[mesh.faces] == mesh.surface[mesh.faces[:, :1]]).all()


def test_trees_stand_clear_of_every_lane(motorway: RoadNetwork, scene: Scene) -> None:
    index = LaneIndex(motorway.lanes)
    names = ("conifer", "broad_leaved", "woodland")
    places = [batch.transforms[:, :3, 3] for batch in scene.scenery if batch.shape.startswith(names)]
    trunks = np.concatenate(places).astype(float)
    assert len(trunks) > 50
    assert index.clearance(trunks).min() > 9.0


def test_delineators_stand_every_50_m_and_rails_along_fast_roads_only(scene: Scene, motorway: RoadNetwork) -> None:
    posts = next(batch for batch in scene.scenery if batch.shape == "delineator").transforms[:, :3, 3]
    right = posts[posts[:, 1] < 0]
    assert np.diff(np.sort(right[:, 0])) == pytest.approx(50.0, abs=0.1)
    assert len(np.unique(np.round(posts[:, 1], 1))) == 4
    slow = [dataclasses.replace(lane, speed_limit=13.9) for lane in motorway.lanes]
    assert "rail_post" not in {b.shape for b in build(RoadNetwork(tuple(slow), motorway.route)).scenery}


def test_lanes_carry_the_attributes_of_their_lines_and_shoulders_the_other_half(scene: Scene) -> None:
    ground = scene.ground
    middle = (ground.surface == Surface.ROAD) & np.isclose(ground.road[:, 2], 1.75) & (ground.positions[:, 1] < 9)
    codes = {int(code) for code in ground.road[middle, 3]}
    assert codes == {3 * 2 + 1, 3 * 2 + 2, 3 * 1 + 2}
    lane = (ground.positions[middle, 1] - ground.road[middle, 1]) / 3.5
    assert lane == pytest.approx(np.round(lane), abs=1e-3)
    assert np.ptp(ground.road[middle, 1]) == pytest.approx(3.5 + 2 * 0.03, abs=1e-3)
    assert ground.road[middle, 0] == pytest.approx(ground.positions[middle, 0], abs=1e-3)
    right = (ground.surface == Surface.ROAD) & np.isclose(ground.road[:, 2], 1.25) & (ground.positions[:, 1] < 0)
    assert set(ground.road[right, 3]) == {3.0}  # solid on its left
    assert ground.positions[right, 1] - ground.road[right, 1] == pytest.approx(-1.75 - 1.25, abs=1e-3)


def test_crossing_roads_have_no_furniture_on_the_crossing() -> None:
    line = np.linspace(-200, 200, 9)[:, None]
    lanes = (street(line * (1.0, 0.0, 0.0), "a", 25.0, 3.5), street(line * (0.0, 1.0, 0.0), "b", 25.0, 3.5))
    index = LaneIndex(lanes)
    scene = build(RoadNetwork(lanes, lanes[0].centreline))
    for batch in scene.scenery:
        assert index.clearance(batch.transforms[:, :3, 3].astype(float)).min() > 0.3


def test_a_raised_road_has_an_embankment_down_to_the_terrain(motorway: RoadNetwork) -> None:
    low, high = motorway.lanes[0], dataclasses.replace(motorway.lanes[0], edge_id="high")
    high = dataclasses.replace(high, centreline=high.centreline + np.array([0.0, 200.0, 5.0]))
    ground = build(RoadNetwork((low, high), low.centreline)).ground
    beside = (ground.positions[:, 1] > 150) & (np.abs(ground.positions[:, 0] - 300) < 300)
    assert ground.positions[beside, 2].min() == pytest.approx(-0.6, abs=0.04)


def test_a_network_without_length_is_refused(motorway: RoadNetwork) -> None:
    point = dataclasses.replace(motorway.lanes[0], centreline=np.zeros((2, 3)))
    with pytest.raises(InputError, match="at least one lane"):
        build(RoadNetwork((point,), motorway.route))
