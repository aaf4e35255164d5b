"""A scene that is built as far as the camera sees shows what the whole one shows."""

import dataclasses

import numpy as np
import pytest

from fogsim.render import make_renderer
from fogsim.scene import ScenePlan, Squares
from fogsim.simulation.ego.near_scene import NearScene
from fogsim.values import Camera, CameraPose, Lane, LaneKind, LaneMarking, PavedArea, RoadNetwork, Sign, SignMap

CAMERA = Camera(96, 72, 110.0, (47.5, 35.5), mount_height=1.3, pitch=0.03)
BLOCK, COLUMNS, ROWS = 330.0, 11, 4


def street(name: str, start: tuple[float, float], end: tuple[float, float], speed: float) -> Lane:
    share = np.linspace(0.0, 1.0, 12)[:, None]
    line = np.array(start) + share * np.subtract(end, start)
    height = 7.0 * np.sin(line[:, :1] / 260.0) * np.cos(line[:, 1:] / 310.0)
    markings = LaneMarking.SOLID, LaneMarking.SOLID
    return Lane(name, name, np.hstack((line, height)), 3.5, speed, *markings, outermost=True)


@pytest.fixture(scope="module")
def plan() -> ScenePlan:
    """Streets of a hilly town, a fast road among them, and a junction where any two meet."""
    lanes, areas = list[Lane](), list[PavedArea]()
    for column in range(COLUMNS):
        for row in range(ROWS):
            x, y = BLOCK * column, BLOCK * row
            speed = 30.0 if row == 2 else 13.9
            lanes.append(street(f"east {column} {row}", (x + 8, y), (x + BLOCK - 8, y), speed))
            lanes.append(street(f"north {column} {row}", (x, y + 8), (x, y + BLOCK - 8), 13.9))
            across = street(f":{column} {row}", (x - 8, y), (x + 8, y), 13.9)
            lanes.append(dataclasses.replace(across, kind=LaneKind.JUNCTION))
            corners = np.add([(-8, -8), (8, -8), (8, 8), (-8, 8)], (x, y))
            heights = 7.0 * np.sin(corners[:, :1] / 260.0) * np.cos(corners[:, 1:] / 310.0)
            areas.append(PavedArea(f"{column} {row}", np.hstack((corners, heights))))
    signs = SignMap((Sign("s", "speed_limit", 13.9, (700.0, 336.0, 9.0), 0.0, 0.9),))
    network = RoadNetwork(tuple(lanes), lanes[0].centreline, tuple(areas))
    return ScenePlan(network, signs, np.random.default_rng(3))


def test_in_any_squares_the_ground_is_that_of_the_whole(plan: ScenePlan) -> None:
    whole = plan.ground.mesh()
    for squares in ([(0, 0)], [(3, 1), (4, 1), (9, 6)], [(c, r) for c in range(5, 12) for r in range(-1, 4)]):
        some = Squares(np.array(squares))
        built, cut = plan.ground.mesh(some), some.part_of(whole)
        assert len(built.faces) > 10
        for field in dataclasses.fields(built):
            np.testing.assert_array_equal(getattr(built, field.name), getattr(cut, field.name))


def test_where_nothing_is_the_ground_is_empty(plan: ScenePlan) -> None:
    assert len(plan.ground.mesh(Squares(np.array([(500, 500)]))).faces) == 0


def test_pictures_are_those_of_the_whole_wherever_the_ego_drives(plan: ScenePlan) -> None:
    near, whole = NearScene(plan, few_lanes=0), plan.scene()
    reference = make_renderer("cpu", whole, 1e4)
    # East along a street into ground that was out of sight, around a corner, and back.
    drive = (20, 330, 0.0), (500, 330, 0.1), (1660, 330, 0.0), (1660, 400, np.pi / 2), (1600, 330, 3.1)
    changes = []
    for x, y, heading in drive:
        pose = CameraPose((x, y, 9.0), heading, 0.0)
        changes.append(near.reach(CAMERA, pose))
        renderer = make_renderer("cpu", near.scene, 1e4)
        views = [drawing.render([], CAMERA, pose) for drawing in (reference, renderer)]
        for name in ("radiance", "distance", "instance"):
            np.testing.assert_array_equal(*(getattr(view, name) for view in views))
        assert not near.reach(CAMERA, pose)
        assert len(near.scene.ground.faces) < len(whole.ground.faces)
        renderer.close()
    reference.close()
    assert changes[0]
    assert sum(changes) >= 3
    assert near.whole().ground.faces.shape == whole.ground.faces.shape


def test_few_lanes_are_built_at_once(plan: ScenePlan) -> None:
    near = NearScene(plan, few_lanes=plan.lanes)
    assert near.is_whole
    assert not near.reach(CAMERA, CameraPose((0.0, 0.0, 1.3), 0.0, 0.0))
    assert near.whole() is near.scene


def test_a_camera_that_looks_down_has_ground_all_around(plan: ScenePlan) -> None:
    near = NearScene(plan, few_lanes=0)
    down = dataclasses.replace(CAMERA, pitch=1.4)
    assert near.reach(down, CameraPose((1600.0, 500.0, 1.3), 0.0, 0.0))
    ahead = near.scene.ground.positions[4:, 0]
    assert ahead.min() < 400.0
    assert ahead.max() > 2800.0
