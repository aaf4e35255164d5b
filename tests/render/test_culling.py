"""What is not drawn because it cannot be seen: inner sides of solids, copies hidden or between pixels."""

from dataclasses import replace

import numpy as np
import trimesh

from fogsim.render.cpu.rasteriser import CPURasteriser
from fogsim.render.drawing import NEAR, Drawing, MeshTable, in_solids
from fogsim.values import Camera, CameraPose
from fogsim.values.pinhole import camera_axes
from tests.render.conftest import drawing_of, joined, mesh

CAMERA = Camera(120, 90, 80.0, (60.0, 45.0), 1.0, roll=0.1)
POSE = CameraPose((0.0, 0.0, 0.0), 0.0)


BALL = mesh(trimesh.creation.icosphere(subdivisions=1).triangles)
OPEN = replace(BALL, faces=BALL.faces[:-1])
INSIDE_OUT = replace(BALL, faces=BALL.faces[:, ::-1])


def test_solids_are_closed_and_wound_outward() -> None:
    for solid, expected in [
        (BALL, [True] * 80),
        (OPEN, [False] * 79),
        (INSIDE_OUT, [False] * 80),
        (joined(BALL, replace(OPEN, positions=OPEN.positions + np.float32(5))), [True] * 80 + [False] * 79),
        (joined(BALL, BALL), [False] * 160),  # two triangles on the same side of each edge
        (replace(BALL, faces=BALL.faces[:0]), []),
    ]:
        assert in_solids(solid).tolist() == expected


def scattered(rng: np.random.Generator, count: int, shapes: int) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of shapes, and transforms of copies before the camera, the nearest first; far ones are tiny."""
    depth = np.sort(rng.uniform(2.0, 60.0, count))
    places = np.column_stack((depth, depth * rng.uniform(-0.9, 0.9, count), depth * rng.uniform(-0.7, 0.7, count)))
    transforms = np.zeros((count, 3, 4))
    for number, place in enumerate(places):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        turn[:, 0] *= np.linalg.det(turn)  # a turn, and no mirror
        transforms[number, :, :3] = turn * rng.uniform(0.05, 2.0, 3)
        transforms[number, :, 3] = place
    return rng.integers(0, shapes, count), transforms


def alone(table: MeshTable, drawing: Drawing) -> tuple[np.ndarray, np.ndarray]:
    """Slots and 1/z of what is nearest, found by drawing each copy on its own."""
    triangle_ids = np.full((CAMERA.height, CAMERA.width), -1)
    nearest = np.zeros(triangle_ids.shape)
    u, v = np.meshgrid(np.arange(CAMERA.width), np.arange(CAMERA.height))
    rasteriser = CPURasteriser(table)
    for copy in range(len(drawing.mesh)):
        one = drawing_of(table, drawing.mesh[[copy]], drawing.record["transform"][[copy]])
        seen = rasteriser.triangle_ids(one, CAMERA, POSE).copy()
        inverse = np.where(seen >= 0, inverse_depths(table, one, seen, u, v), 0.0)
        closer = inverse > nearest
        triangle_ids = np.where(closer, seen + drawing.first[copy], triangle_ids)
        nearest = np.where(closer, inverse, nearest)
    return triangle_ids, nearest


def inverse_depths(table: MeshTable, one: Drawing, seen: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """1/z of the triangles that pixels see of a single copy [1/m]."""
    begin = table.first_face[one.mesh[0]]
    transform = one.record["transform"][0].astype(float)
    corners = table.positions[table.faces[begin + np.maximum(seen, 0)]].astype(float)
    corners = (corners @ transform[:, :3].T + transform[:, 3]) @ camera_axes(CAMERA, POSE).T
    rays = np.stack(
        ((u - CAMERA.principal_point[0]) / 80.0, (v - CAMERA.principal_point[1]) / 80.0, np.ones(u.shape)), axis=-1
    )
    normal = np.cross(corners[..., 1, :] - corners[..., 0, :], corners[..., 2, :] - corners[..., 0, :])
    distance = np.einsum("...i,...i", normal, corners[..., 0, :])
    return np.asarray(np.einsum("...i,...i", normal, rays) / np.where(distance == 0.0, 1.0, distance))


def test_copies_are_left_out_only_where_nothing_of_them_is_seen() -> None:
    for order, seed in [(1, 0), (-1, 1)]:
        shapes = {"ball": BALL, "open": OPEN, "inside out": INSIDE_OUT}
        table = MeshTable.of(shapes)
        numbers, transforms = scattered(np.random.default_rng(seed), 150, len(shapes))
        drawing = drawing_of(table, numbers[::order], transforms[::order])
        triangle_ids = CPURasteriser(table).triangle_ids(drawing, CAMERA, POSE)
        expected, inverse = alone(table, drawing)
        assert (expected >= 0).mean() > 0.3
        assert inverse.max() < 1 / NEAR
        assert (triangle_ids != expected).mean() < 2e-4  # equal depths that rounding decides
        copies = np.unique(np.searchsorted(drawing.first, triangle_ids[triangle_ids >= 0], side="right"))
        assert 15 < len(copies) < 140  # some copies are hidden, or the test would say nothing


def test_inner_sides_of_solids_make_no_difference_from_outside() -> None:
    table = MeshTable.of({"ball": BALL})
    culled = MeshTable.of({"ball": BALL}, never_inside=lambda name: name == "ball")
    assert culled.in_solid.all()
    assert not table.in_solid.any()
    numbers, transforms = scattered(np.random.default_rng(5), 60, 1)
    drawing = drawing_of(table, numbers, transforms)
    seen, all_seen = (CPURasteriser(one).triangle_ids(drawing, CAMERA, POSE).copy() for one in (culled, table))
    assert (seen >= 0).mean() > 0.3
    np.testing.assert_array_equal(seen, all_seen)


def test_the_outer_side_is_what_is_kept() -> None:
    opened = MeshTable.of({"open": replace(BALL, faces=BALL.faces[BALL.positions[BALL.faces, 0].mean(axis=1) > -0.5])})
    drawing = drawing_of(opened, np.zeros(1, np.int64), np.column_stack((np.eye(3), (4.0, 0.0, 0.0)))[None])
    both = CPURasteriser(opened).triangle_ids(drawing, CAMERA, POSE).copy()
    outer = CPURasteriser(replace(opened, in_solid=np.ones(len(opened.faces), np.bool_)))
    kept = outer.triangle_ids(drawing, CAMERA, POSE)
    # Its open side is toward the camera: of the inside nothing is left, of the rim's outside something.
    assert kept[45, 60] < 0 <= both[45, 60]
    assert 0 < (kept >= 0).sum() < 0.8 * (both >= 0).sum()
