"""The renderer that needs no graphics system, and the shading that both renderers share."""

import math
from typing import Any

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.render import Renderer, RenderError, make_renderer
from fogsim.render.cpu.rasteriser import CPURasteriser
from fogsim.render.drawing import NEAR, MeshTable
from fogsim.render.renderer import shapes_of
from fogsim.render.shading.surfaces import retroreflection
from fogsim.scene import vehicle_batches
from fogsim.values import Batch, Camera, CameraPose, Lamp, Mesh, Scene, Surface
from fogsim.values.pinhole import camera_axes
from tests.render.conftest import drawing_of, joined, mesh, rays, rectangle

CAMERA = Camera(320, 240, 288.0, (160.0, 120.0), 1.38, pitch=math.radians(2.0))
AHEAD, ORIGIN = CameraPose((0.0, 0.0, 1.38), heading=0.0), CameraPose((0.0, 0.0, 0.0), 0.0)
ILLUMINANCE = 18e3
WEIGHTS = (0.2126, 0.7152, 0.0722)
ONE = np.eye(4)[None, :3]


def road(lines: int = 0, half: float = 1.75, reach: float = 1500.0) -> Mesh:
    """Level road along x around y = 0, from behind the camera on."""
    x, y = (-50.0, reach), (-12.0, 12.0)
    corners = rectangle((x[0], y[0], 0), (x[1], y[0], 0), (x[1], y[1], 0), (x[0], y[1], 0))
    flat = corners.reshape(-1, 3)
    attributes = np.column_stack((flat[:, 0], flat[:, 1], np.full((len(flat), 2), (half, lines))))
    level = mesh(corners, Surface.ROAD, attributes, instance=2)
    level.normals[:] = (0.0, 0.0, 1.0)
    return level


def terrain(height: float) -> Mesh:
    level = mesh(rectangle((-1e4, -1e4, height), (1e4, -1e4, height), (1e4, 1e4, height), (-1e4, 1e4, height)))
    level.surface[:], level.instance[:] = int(Surface.TERRAIN), 1
    return level


def drawn(ground: Mesh, illuminance: float = ILLUMINANCE, **shapes: Mesh) -> Renderer:
    return make_renderer("cpu", Scene(ground, shapes, ()), illuminance)


def copy_of(shape: str, lamps: int = 0, instance: int = 16) -> Batch:
    transform = np.eye(4, dtype=np.float32)[None]
    paint, one = np.full((1, 3), 0.4, np.float32), np.ones(1, np.int32)
    return Batch(shape, transform, paint, lamps * one, instance * one)


@pytest.mark.parametrize(
    ("camera", "pose"),
    [
        (Camera(640, 480, 577.0, (320.0, 240.0), 1.38, pitch=math.radians(2.0)), AHEAD),
        (Camera(640, 480, 577.0, (300.5, 250.0), 2.0, 0.03, 0.1), CameraPose((40.0, 1.0, 2.0), 0.02, 0.01)),
    ],
)
def test_distances_on_the_road_are_those_of_the_plane(camera: Camera, pose: CameraPose) -> None:
    view = drawn(road()).render((), camera, pose)
    ray = rays(camera, pose)
    exact = pose.position[2] / np.maximum(-ray[..., 2], 1e-9) * np.linalg.norm(ray, axis=-1)
    for low, high, tolerance in ((3.0, 10.0, 1e-5), (10.0, 300.0, 1e-5), (300.0, 1300.0, 1e-4)):
        chosen = (view.instance == 2) & (exact > low) & (exact < high)
        assert chosen.sum() > 30
        np.testing.assert_allclose(view.distance[chosen], exact[chosen], rtol=tolerance)


def test_distances_on_walls_are_those_of_their_planes() -> None:
    rng = np.random.default_rng(2)
    for far in (10.0, 100.0, 300.0, 1000.0):
        normal = np.array([-1.0, *rng.normal(size=2) * 0.4])
        point = np.array([far, 0.0, 1.38])
        y, z = np.array([-0.3, 0.3, 0.3, -0.3]) * far, np.array([-0.2, -0.2, 0.2, 0.2]) * far
        x = far - (normal[1] * y + normal[2] * z) / normal[0]
        corners = np.column_stack((x, y, z + 1.38))
        view = drawn(mesh(rectangle(*corners))).render((), CAMERA, AHEAD)
        ray = rays(CAMERA, AHEAD)
        exact = normal @ (point - AHEAD.position) / (ray @ normal) * np.linalg.norm(ray, axis=-1)
        seen = view.instance == 3
        assert seen.mean() > 0.05
        np.testing.assert_allclose(view.distance[seen], exact[seen], rtol=1e-5)


def nearest(triangles: np.ndarray, camera: Camera) -> np.ndarray:
    """Triangle (cast by rays one by one, Möller & Trumbore) that each pixel sees from the origin."""
    ray = rays(camera, ORIGIN).reshape(-1, 3)
    best, found = np.full(len(ray), np.inf), np.full(len(ray), -1)
    for number, (a, b, c) in enumerate(triangles):
        edge, other = b - a, c - a
        p = np.cross(ray, other)
        determinant = p @ edge
        with np.errstate(divide="ignore", invalid="ignore"):
            s = p @ -a / determinant
            t = ray @ np.cross(-a, edge) / determinant
            depth = np.cross(-a, edge) @ other / determinant
        closer = (s >= 0) & (t >= 0) & (s + t <= 1) & (depth >= NEAR) & (depth < best)
        best, found = np.where(closer, depth, best), np.where(closer, number, found)
    return found.reshape(camera.height, camera.width)


def test_pixels_see_the_triangles_that_their_rays_hit() -> None:
    for seed in range(4):
        rng = np.random.default_rng(seed)
        camera = Camera(90, 70, 60.0, (44.0, 33.0), 1.0, roll=0.3)
        middle = rng.normal(size=(120, 1, 3)) * (12.0, 9.0, 6.0)  # many reach behind the camera
        around = rng.normal(size=(120, 3, 3)) * rng.choice([0.3, 2.0, 9.0], (120, 1, 1))
        triangles = (middle + around).astype(np.float32)
        table = MeshTable.of({"": mesh(triangles)})
        triangle_ids = CPURasteriser(table).triangle_ids(drawing_of(table, [0], ONE), camera, ORIGIN)
        exact = nearest(triangles.astype(float), camera)
        assert (exact >= 0).mean() > 0.5
        assert (triangle_ids != exact).mean() < 1e-3  # edges and depths that rounding decides


@pytest.mark.parametrize("seed", range(2))
def test_triangles_that_share_edges_leave_no_gap(seed: int) -> None:
    rng = np.random.default_rng(seed)
    camera = Camera(200, 150, 100.0, (100.0, 75.0), 1.0)
    count = 40
    y, z = np.meshgrid(np.linspace(-3.0, 3.0, count), np.linspace(-3.0, 3.0, count))
    jitter = rng.uniform(-0.06, 0.06, (2, count, count)) * (seed > 0)  # straight lines through pixel centres too
    points = np.stack((2.0 + 0.3 * rng.random((count, count)), y + jitter[0], z + jitter[1]), axis=-1)
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    triangles = np.concatenate((np.stack((a, b, c), axis=2), np.stack((a, c, d), axis=2))).reshape(-1, 3, 3)
    table = MeshTable.of({"": mesh(triangles)})
    assert (CPURasteriser(table).triangle_ids(drawing_of(table, [0], ONE), camera, ORIGIN) >= 0).all()


def test_what_is_seen_has_its_instance_id(place: Any) -> None:
    vehicles = vehicle_batches(place.traffic, None)
    view = make_renderer("cpu", place.scene, ILLUMINANCE).render(vehicles, CAMERA, place.pose)
    seen = set(np.unique(view.instance).tolist())
    assert {0, 1, 2, 3, 4, 16, 17} <= seen <= {0, 1, 2, 3, 4, *range(16, 16 + len(place.traffic.ids))}
    heading, length = place.traffic.heading[0], place.traffic.length[0]
    rear = place.traffic.position[0] - length * np.array([math.cos(heading), math.sin(heading), 0.0])
    right, _, ahead = camera_axes(CAMERA, place.pose) @ (rear - place.pose.position)
    columns = np.nonzero(view.instance == 16)[1]
    assert columns.mean() == pytest.approx(160.0 + 288.0 * right / ahead, abs=6.0)
    assert np.isinf(view.distance[view.instance == 0]).all()
    assert np.isfinite(view.distance[view.instance != 0]).all()


def test_pictures_are_the_same_to_the_bit_and_share_nothing(place: Any) -> None:
    vehicles = vehicle_batches(place.traffic, None)
    renderer, other = (make_renderer("cpu", place.scene, ILLUMINANCE) for _ in range(2))
    first = renderer.render(vehicles, CAMERA, place.pose, lamplight=True)
    renderer.render((), Camera(77, 51, 60.0, (30.0, 20.0), 1.0), AHEAD)
    for again in (renderer, other):
        view = again.render(vehicles, CAMERA, place.pose, lamplight=True)
        for name in ("radiance", "distance", "instance", "lamp_response"):
            one, two = getattr(first, name), getattr(view, name)
            assert np.array_equal(one, two)
            assert not np.shares_memory(one, two)
            assert one.flags.c_contiguous
            assert one.dtype == (np.int32 if name == "instance" else np.float32)


def test_lamplight_does_not_change_what_is_seen_by_day(place: Any) -> None:
    renderer = make_renderer("cpu", place.scene, ILLUMINANCE)
    plain, lit = (renderer.render((), CAMERA, place.pose, lamplight=wanted) for wanted in (False, True))
    assert plain.lamp_response is None
    np.testing.assert_allclose(lit.radiance, plain.radiance, rtol=1e-5)
    assert np.array_equal(lit.distance, plain.distance)


def wall(surface: Surface, far: float = 20.0) -> Mesh:
    return mesh(rectangle((far, -9, -9), (far, 9, -9), (far, 9, 9), (far, -9, 9)), surface)


@pytest.mark.parametrize(
    ("surface", "lamp", "luminance"),
    [
        (Surface.LAMP_STOP, Lamp.STOP, 17e3),
        (Surface.LAMP_HEAD, Lamp.LOW_BEAM, 30e3),
        (Surface.LAMP_STREET, Lamp.NONE, 30e3),  # always lit
    ],
)
def test_lamps_are_the_only_light_of_the_night(surface: Surface, lamp: Lamp, luminance: float) -> None:
    renderer = drawn(road(), 0.0, lamp=wall(surface))
    off = renderer.render([copy_of("lamp")] if lamp else (), CAMERA, AHEAD)
    assert off.radiance.max() == 0.0
    on = renderer.render([copy_of("lamp", int(lamp))], CAMERA, AHEAD)
    assert on.radiance[on.instance == 16] @ WEIGHTS == pytest.approx(luminance, rel=1e-4)
    assert on.radiance[on.instance != 16].max() == 0.0


@pytest.mark.parametrize(("ground", "instance", "aside"), [(road(reach=9000.0), 2, 0.0), (terrain(0.0), 1, 91.7)])
def test_texture_keeps_the_mean_at_any_distance(ground: Mesh, instance: int, aside: float) -> None:
    renderer = drawn(ground)
    views = [renderer.render((), CAMERA, CameraPose((207.3 * i, aside * i, 1.38), 0.0)) for i in range(40)]
    distance = np.stack([view.distance for view in views])
    reflectance = np.stack([view.radiance[..., 1] for view in views]) * math.pi / ILLUMINANCE
    deviations = []
    for low, high in ((3.0, 6.0), (6.0, 20.0), (20.0, 60.0), (60.0, 200.0), (200.0, 1000.0)):
        band = reflectance[(distance > low) & (distance < high) & (np.stack([v.instance for v in views]) == instance)]
        # Wheel tracks are a little darker.
        assert band.mean() == pytest.approx(0.1, rel=0.03)
        deviations.append(band.std() / band.mean())
    assert deviations[0] > 0.05
    assert deviations == sorted(deviations, reverse=True)
    assert deviations[-1] < 0.03


@pytest.mark.parametrize(("lines", "share"), [(3, 1.0), (6, 1.0 / 3.0)])
def test_lines_keep_their_area_however_small_they_are(lines: int, share: float) -> None:
    camera = Camera(640, 480, 577.0, (320.0, 240.0), 1.38, pitch=math.radians(2.0))
    bare, painted = drawn(road()), drawn(road(lines))
    widths = []
    for i in range(18):
        pose = CameraPose((float(i), 0.0, 1.38), 0.0)
        seen, without = (renderer.render((), camera, pose) for renderer in (painted, bare))
        paint, asphalt = (view.radiance[..., 1].astype(float) for view in (seen, without))
        depth = seen.distance[:, 320]
        rows = np.flatnonzero((depth > 8.0) & (depth < 150.0))
        contrast = 0.6 - 0.1
        width = (paint - asphalt).sum(axis=1)[rows] * math.pi / ILLUMINANCE / contrast * depth[rows] / 577.0
        widths.append(width)
    assert np.mean(widths, axis=0) == pytest.approx(0.2 * share, rel=0.12)
    assert np.mean(widths) == pytest.approx(0.2 * share, rel=0.03)


def test_surfaces_and_sky_answer_lamplight_as_measured() -> None:
    view = drawn(road(), wall=wall(Surface.MATT)).render([copy_of("wall")], CAMERA, AHEAD, lamplight=True)
    assert view.lamp_response is not None
    assert view.lamp_response[100, 160] == pytest.approx(0.1 / math.pi, rel=0.02)
    view = drawn(joined(road(3), terrain(-0.1))).render((), CAMERA, AHEAD, lamplight=True)
    response = view.lamp_response
    assert response is not None
    near = (view.instance == 2) & (view.distance < 15.0)
    assert np.median(response[near]) == pytest.approx(0.0125, rel=0.05)
    assert response[near].max() == pytest.approx(0.15, rel=0.15)
    assert response[view.instance == 0].max() == 0.0
    terrain_pixels = (view.instance == 1) & (view.distance > 30.0) & (view.distance < 60.0)
    sine = 1.48 / view.distance[terrain_pixels]
    assert np.mean(response[terrain_pixels][:, 1] / sine) == pytest.approx(0.1 / math.pi, rel=0.05)


def test_sheeting_sends_lamplight_back_and_less_of_it_from_near() -> None:
    answers = []
    for far in (15.0, 60.0, 130.0):
        sheet = wall(Surface.SHEETING, far)
        sheet.reflectance[:] = 0.66
        view = drawn(road(), sheet=sheet).render([copy_of("sheet")], CAMERA, AHEAD, lamplight=True)
        assert view.lamp_response is not None
        answers.append(float(view.lamp_response[view.instance == 16].max()))
    assert answers == sorted(answers)
    assert answers[0] < 30.0
    assert 150.0 < answers[2] <= 250.0
    for degrees, value in ((0.2, 250.0), (1.0 / 3.0, 180.0), (2.0, 5.0), (0.01, 250.0), (20.0, 5.0)):
        assert retroreflection(0.75 / math.radians(degrees)) == pytest.approx(value, rel=1e-6)


def test_a_scene_without_triangles_is_sky() -> None:
    view = drawn(mesh(np.zeros((0, 3, 3)))).render((), CAMERA, AHEAD, lamplight=True)
    assert (view.instance == 0).all()
    assert np.isinf(view.distance).all()
    assert view.radiance.min() > 0.0


def test_a_camera_inside_a_vehicle_sees_it_from_inside(place: Any) -> None:
    vehicles = vehicle_batches(place.traffic, None)
    (x, y, _), heading = place.traffic.position[0], float(place.traffic.heading[0])
    pose = CameraPose((float(x - 2.0 * math.cos(heading)), float(y - 2.0 * math.sin(heading)), 1.0), heading)
    view = make_renderer("cpu", place.scene, ILLUMINANCE).render(vehicles, CAMERA, pose, lamplight=True)
    assert (view.instance == 16).any()
    assert view.distance.min() >= NEAR
    assert np.isfinite(view.radiance).all()
    assert np.isfinite(view.lamp_response).all()


def test_shapes_that_the_scene_does_not_have_and_closed_renderers_are_refused() -> None:
    renderer = drawn(road())
    with pytest.raises(InputError, match="'sledge'"):
        renderer.render([copy_of("sledge")], CAMERA, AHEAD)
    renderer.close()
    renderer.close()
    with pytest.raises(RenderError, match="closed"):
        renderer.render((), CAMERA, AHEAD)


def test_coarser_levels_of_detail_replace_shapes_one_by_one() -> None:
    names = {"car": 0, "car:far": 1, "car:tiny": 2, "post": 3, "hut": 4, "hut:tiny": 5}
    box = np.ones((6, 3))
    plain = np.array([False, False, False, False, True, True])
    shapes = shapes_of(names, -box, box, np.array([400, 100, 4, 9, 50, 8]), plain, (":far", ":tiny"))
    assert shapes.coarser.tolist() == [1, 2, -1, -1, 5, -1]
    # The geometric mean of the triangles of both decides: of 200 and of 20.
    assert shapes.detail[0] == pytest.approx(math.sqrt(10.0) * shapes.detail[1])
    # What is plain gives way sooner, and is sooner left out.
    assert shapes.detail[4] > shapes.detail[1]  # both for a level of 20 triangles
    assert shapes.smallest[4] > shapes.smallest[0]
