import math
import re
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from fogsim.errors import InputError, UnknownNameError
from fogsim.render import Renderer, RenderError, gl_report, make_renderer
from fogsim.scene import build_scene, vehicle_batches
from fogsim.values import Camera, CameraPose, Lamp, RoadNetwork, Scene, SignMap, TrafficState
from tests.helpers.vehicles import vehicles
from tests.render.conftest import rays
from tests.scene.conftest import carriageway

CAMERA = Camera(640, 480, 577.0, (320.0, 240.0), 1.38, pitch=math.radians(2.0))
SMALL = Camera(160, 120, 144.25, (80.0, 60.0), 1.38, pitch=math.radians(2.0))
AHEAD = CameraPose((0.0, 0.0, 1.38), heading=0.0)

Maker = Callable[[Scene], Renderer]
ILLUMINANCE = 18e3


@pytest.fixture(scope="session")
def make(opengl: None) -> Iterator[Maker]:
    made: list[Renderer] = []

    def renderer(scene: Scene) -> Renderer:
        made.append(make_renderer("opengl", scene, ILLUMINANCE))
        return made[-1]

    yield renderer
    for one in made:
        one.close()


@pytest.fixture(scope="session")
def scene() -> Scene:
    """A straight road along x, three lanes of 3.5 m, the middle one on y = 0, 1500 m long."""
    lanes = carriageway("e", (-100.0, -3.5), 0.0, 1500.0, 36.0)
    return build_scene(RoadNetwork(tuple(lanes), lanes[1].centreline), SignMap(), np.random.default_rng(1))


@pytest.fixture(scope="session")
def bare(make: Maker, scene: Scene) -> Renderer:
    return make(Scene(ground=scene.ground, shapes={}, scenery=()))


@pytest.fixture(scope="session")
def renderer(make: Maker, scene: Scene) -> Renderer:
    return make(scene)


def one_vehicle(
    kind: str, gap: float, lamps: int = 0, size: tuple[float, float, float] = (16.5, 2.5, 4.0)
) -> TrafficState:
    """A vehicle on y = 0 whose rear is `gap` metres ahead of the origin."""
    return vehicles([gap + size[0]], ids=["lead"], kinds=kind, size=size, lamps=lamps)


def upward(camera: Camera, pose: CameraPose) -> np.ndarray:
    """Sine of the elevation of the rays of all pixels, by angles rather than the renderer's matrices."""
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    x = (u - camera.principal_point[0]) / camera.focal_length
    y = (v - camera.principal_point[1]) / camera.focal_length
    # Undo the roll, then pitch about the right axis.
    down, pitch = y * math.cos(camera.roll) - x * math.sin(camera.roll), camera.pitch - pose.grade
    return (-math.sin(pitch) - down * math.cos(pitch)) / np.sqrt(1.0 + x**2 + y**2)


@pytest.mark.parametrize(
    ("camera", "pose"),
    [
        (Camera(320, 240, 300.0, (150.0, 130.0), 2.0, 0.1, 0.15), CameraPose((50.0, 1.0, 2.0), 0.3)),
        (Camera(320, 240, 300.0, (150.0, 130.0), 2.0, -0.02, -0.1), CameraPose((50.0, 1.0, 2.0), 2.8, 0.05)),
    ],
)
def test_terrain_and_sky_part_at_the_horizon_for_any_attitude(bare: Renderer, camera: Camera, pose: CameraPose) -> None:
    view = bare.render((), camera, pose)
    up = upward(camera, pose)
    terrain = (view.instance == 1) & (view.distance < 5e3)
    assert terrain.sum() > 1000
    assert view.distance[terrain] == pytest.approx((pose.position[2] + 0.1) / -up[terrain], rel=2e-4)
    assert (view.instance[up > 0.02] == 0).mean() > 0.97  # the guard rails reach above the horizon at places
    assert not np.any(view.instance[up < -1e-3] == 0)
    road = view.instance == 2
    if road.any():
        high = np.abs(view.distance[road] * -up[road] - pose.position[2])
        assert high.max() < 0.09  # shoulders and verges lie a little lower


def test_the_sky_is_at_infinity_and_a_cie_overcast_one(renderer: Renderer) -> None:
    steep = Camera(64, 64, 40.0, (32.0, 32.0), 1.38, pitch=-0.9)
    view = renderer.render((), steep, AHEAD)
    sky = view.instance == 0
    assert sky.mean() > 0.9
    assert np.isposinf(view.distance[sky]).all()
    assert np.isfinite(view.distance[~sky]).all()
    sine = upward(steep, AHEAD)[sky]
    zenith = 9 * ILLUMINANCE / (7 * math.pi)
    assert view.radiance[sky][:, 1] == pytest.approx(zenith * (1 + 2 * sine) / 3, rel=1e-4)


def test_asphalt_and_paint_have_the_radiance_of_their_reflectance(renderer: Renderer) -> None:
    # Every 60 m, since patches and wear make every place of a road a little other than its mean.
    views = [renderer.render((), CAMERA, CameraPose((x, 0.0, 1.38), 0.0)) for x in np.arange(0.0, 720.0, 60.0)]
    asphalt = np.array([view.radiance[400:470, 300:340, 1] for view in views]) * math.pi / ILLUMINANCE
    assert asphalt.mean() == pytest.approx(0.088, rel=0.05)
    assert all(0.005 < one.std() / one.mean() < 0.12 for one in asphalt)
    paint = [view.radiance[..., 1][view.instance == 2].max() * math.pi / ILLUMINANCE for view in views]
    assert np.mean(paint) == pytest.approx(0.6, rel=0.1)


@pytest.mark.parametrize("gap", [12.0, 90.0, 300.0])
def test_a_vehicle_is_as_far_and_as_large_as_it_is(renderer: Renderer, gap: float) -> None:
    view = renderer.render(vehicle_batches(one_vehicle("truck", gap), None), CAMERA, AHEAD)
    seen = view.instance == 16
    direction = rays(CAMERA, AHEAD) / np.linalg.norm(rays(CAMERA, AHEAD), axis=-1, keepdims=True)
    distance = np.where(seen, view.distance, 0.0)
    ahead = distance * direction[..., 0]
    rear = seen & (np.abs(distance * direction[..., 2] + 1.38 - 2.5) < 1.0)
    assert rear.sum() > 10
    # The doors lie up to 0.15 m before the rear bar that ends the vehicle.
    assert np.median(ahead[rear]) == pytest.approx(gap + 0.08, abs=0.1)
    columns = np.flatnonzero(seen.any(axis=0))
    assert (len(columns)) == pytest.approx(2.5 * 577 / gap, abs=2.0)


@pytest.mark.parametrize(
    ("lamp", "luminance"),
    [(Lamp.POSITION, 1300), (Lamp.STOP, 17e3), (Lamp.REAR_FOG, 20e3), (Lamp.INDICATOR_LEFT, 15e3)],
)
def test_a_lit_lamp_adds_its_luminance(renderer: Renderer, lamp: Lamp, luminance: float) -> None:
    def draw(lamps: Lamp) -> np.ndarray:
        state = one_vehicle("van", 6.0, int(lamps), (5.9, 2.0, 2.6))
        return renderer.render(vehicle_batches(state, None), SMALL, AHEAD).radiance.astype(float)

    added = (draw(lamp) - draw(Lamp.NONE)) @ (0.2126, 0.7152, 0.0722)
    assert added.max() == pytest.approx(luminance, rel=1e-3)
    assert 4 <= np.count_nonzero(added > 1) < 0.05 * added.size


def test_closing_one_renderer_leaves_the_other_working(make: Maker, scene: Scene, renderer: Renderer) -> None:
    before = renderer.render((), SMALL, AHEAD)
    other = make(scene)
    other.render((), SMALL, AHEAD)
    other.close()
    other.close()
    with pytest.raises(RenderError, match="closed"):
        other.render((), SMALL, AHEAD)
    assert np.array_equal(renderer.render((), SMALL, AHEAD).radiance, before.radiance)


def test_renderers_give_back_what_they_hold(scene: Scene, renderer: Renderer) -> None:
    from OpenGL import GL

    kinds = (GL.glIsBuffer, GL.glIsVertexArray, GL.glIsFramebuffer, GL.glIsRenderbuffer, GL.glIsProgram, GL.glIsShader)

    def held() -> list[int]:
        return [sum(bool(kind(name)) for name in range(1, 1000)) for kind in kinds]

    before = held()
    assert min(before[:5]) > 0
    for _ in range(5):
        one = make_renderer("auto", scene, ILLUMINANCE)
        one.render((), SMALL, AHEAD)
        one.render((), CAMERA, AHEAD)
        one.close()
    assert held() == before


def test_unknown_renderers_and_light_are_refused_and_the_version_reported(scene: Scene, renderer: Renderer) -> None:
    with pytest.raises(UnknownNameError, match="pyrender"):
        make_renderer("pyrendr", scene, ILLUMINANCE)
    with pytest.raises(InputError, match="illuminance"):
        make_renderer("opengl", scene, -1.0)
    assert re.match(r"OpenGL \((EGL|OSMesa)\) [34]\.\d", gl_report())
