"""pyrender's own drawing beside FogSim's two: they share the scene and nothing that finds what a pixel sees."""

import dataclasses
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from fogsim.errors import InputError, RenamedWarning
from fogsim.render import Renderer, RenderError, make_renderer, to_pyrender
from fogsim.render.photometry import lamp_radiance
from fogsim.scenario import load_scenario
from fogsim.scene import vehicle_batches
from fogsim.values import Beam, CameraPose, HeadLamp, Lights, LightSources, Scene, StreetLighting, Surface, View
from fogsim.values.scene import LEVELS_OF_DETAIL
from tests.helpers.command import run_python
from tests.render.conftest import Place, camera, walls

ILLUMINANCE = 1e4
LARGE, SMALL, TILTED = camera(640, 480), camera(160, 120), camera(160, 120, roll=0.15)
POSE = CameraPose((0.0, 0.0, 0.0), 0.0)
LEVEL = dataclasses.replace(LARGE, pitch=0.0)


def in_full_detail(scene: Scene) -> Scene:
    """The scene without simpler shapes for what is far, since pyrender draws everything in full."""
    return dataclasses.replace(
        scene, shapes={name: mesh for name, mesh in scene.shapes.items() if not name.endswith(LEVELS_OF_DETAIL)}
    )


@pytest.fixture(scope="module")
def three(place: Place) -> Iterator[dict[str, Renderer]]:
    made = {
        name: make_renderer(name, in_full_detail(place.scene), ILLUMINANCE) for name in ("pyrender", "opengl", "cpu")
    }
    yield made
    for one in made.values():
        one.close()


@pytest.fixture(scope="module")
def views(place: Place, three: dict[str, Renderer]) -> dict[str, View]:
    vehicles = vehicle_batches(place.traffic, None)
    return {name: one.render(vehicles, LARGE, place.pose) for name, one in three.items()}


def agree(one: View, other: View) -> None:
    sky = np.isinf(one.distance)
    assert np.mean(sky == np.isinf(other.distance)) > 0.995
    assert np.mean(one.instance == other.instance) > 0.99
    with np.errstate(invalid="ignore"):
        off = np.abs(one.distance / other.distance - 1.0)
    assert np.mean((off < 0.005) | (sky & np.isinf(other.distance))) > 0.98


@pytest.mark.parametrize("other", ["opengl", "cpu"])
def test_silhouettes_depth_and_ids_are_those_of_the_others(views: dict[str, View], other: str) -> None:
    agree(views["pyrender"], views[other])
    assert {0, 1, 2, 3, 4, 16, 17} <= set(np.unique(views["pyrender"].instance).tolist())


def test_so_they_are_at_other_sizes_and_angles(place: Place, three: dict[str, Renderer]) -> None:
    vehicles = vehicle_batches(place.traffic, None)
    agree(*(three[name].render(vehicles, TILTED, place.pose) for name in ("pyrender", "cpu")))


def test_radiance_paint_and_lamps_are_as_of_the_others_but_for_grain_and_eight_bits(
    views: dict[str, View],
) -> None:
    one, other = views["pyrender"], views["cpu"]
    same = one.instance == other.instance
    ratio = one.radiance[same] / other.radiance[same]
    assert abs(np.median(ratio) - 1.0) < 0.03
    assert np.mean(np.abs(ratio - 1.0) < 0.25) > 0.95
    sky = np.isinf(one.distance) & np.isinf(other.distance)
    np.testing.assert_allclose(one.radiance[sky], other.radiance[sky], rtol=1e-4)
    # Paint is five times as bright as asphalt; edges of a line may differ by a pixel.
    road = (views["pyrender"].instance == 2) & (views["cpu"].instance == 2)
    paint = [road & (views[name].radiance[..., 1] > 0.3 * ILLUMINANCE / math.pi) for name in ("pyrender", "cpu")]
    assert paint[1].sum() > 1000
    assert (paint[0] & paint[1]).sum() / (paint[0] | paint[1]).sum() > 0.9
    stop = lamp_radiance(Surface.LAMP_STOP)
    lit = np.all(np.isclose(views["pyrender"].radiance, stop, rtol=1e-4), axis=-1)
    assert lit.any()
    assert (views["pyrender"].instance[lit] >= 16).all()
    for number in range(16, 20):
        one, other = (views[name].instance == number for name in ("pyrender", "cpu"))
        assert other.sum() > 200
        assert (one & other).sum() / (one | other).sum() > 0.95


@pytest.mark.parametrize("distance", [1.0, 10.0, 100.0, 1000.0])
def test_a_wall_is_as_far_and_as_bright_as_it_is(distance: float) -> None:
    one = make_renderer("reference", walls(distance), ILLUMINANCE)
    view = one.render((), LEVEL, POSE)
    one.close()
    across, down = (np.arange(640) - 320.0) / LEVEL.focal_length, (np.arange(480) - 240.0) / LEVEL.focal_length
    exact = distance * np.sqrt(1.0 + across[None, :] ** 2 + down[:, None] ** 2)
    np.testing.assert_allclose(view.distance, exact, rtol=5e-4)
    assert (view.instance == 3).all()
    # The normals point up, so ρ E/π exactly, but for the steps of 8 bits.
    np.testing.assert_allclose(view.radiance, 0.5 * ILLUMINANCE / math.pi, rtol=0.01)
    assert view.radiance.dtype == view.distance.dtype == np.float32
    assert view.instance.dtype == np.int32


def test_what_opengl_draws_does_not_change_when_pyrender_draws_between(
    place: Place, three: dict[str, Renderer]
) -> None:
    vehicles = vehicle_batches(place.traffic, None)
    before = three["opengl"].render(vehicles, SMALL, place.pose)
    passing = make_renderer("pyrender", walls(20.0), ILLUMINANCE)
    passing.render((), SMALL, POSE)
    passing.close()
    passing.close()
    after = three["opengl"].render(vehicles, SMALL, place.pose)
    for name in ("radiance", "distance", "instance"):
        np.testing.assert_array_equal(getattr(before, name), getattr(after, name))
    with pytest.raises(RenderError, match="closed"):
        passing.render((), SMALL, POSE)


def test_lamplight_is_refused_and_told_where_it_is_drawn() -> None:
    one = make_renderer("pyrender", walls(20.0), 0.5)
    with pytest.raises(InputError, match="use opengl or cpu"):
        one.render((), SMALL, POSE, lamplight=True)
    one.close()
    # Without lamps the scene is that of the day.
    made = to_pyrender(walls(10.0), POSE)
    assert not made.light_nodes
    np.testing.assert_allclose(made.ambient_light, 1.0)
    dark = to_pyrender(walls(10.0), POSE, illuminance=0.0)
    np.testing.assert_allclose(dark.ambient_light, 0.0)


def test_a_scene_of_pyrenders_has_meshes_materials_camera_and_lamps_as_nodes(place: Place) -> None:
    axis = np.linspace(-0.5, 0.5, 11)
    beam = Beam(axis, axis, 20e3 * np.exp(-8.0 * (axis**2 + axis[:, None] ** 2)))
    lights = Lights(
        own=(HeadLamp((1.5, 0.6, -0.7), beam),),
        others=LightSources(
            np.array([(50.0, 3.0, 0.8)]), np.array([8.0]), np.array([(1.0, 0.1, 0.1)]), np.array([0.01])
        ),
        streets=StreetLighting(np.array([(30.0, -5.0, 8.0)]), 8.0, axis[5:], np.full(6, 2e3), (1.0, 0.9, 0.7), 0.5),
    )
    batches = vehicle_batches(place.traffic, None)
    made = to_pyrender(place.scene, place.pose, lights, vehicles=batches, camera=LARGE)
    assert len(made.spot_light_nodes) == 2
    (point,) = made.point_light_nodes
    np.testing.assert_allclose(made.get_pose(point)[:3, 3], (50.0, 3.0, 0.8))
    assert point.light.intensity == pytest.approx(8.0 / (1e4 / math.pi))
    (own,) = (node for node in made.spot_light_nodes if node.name == "own lamp 0")
    ahead = np.array((math.cos(place.pose.heading), math.sin(place.pose.heading), 0.0))
    np.testing.assert_allclose(-made.get_pose(own)[:3, 2], ahead, atol=1e-6)
    assert own.light.innerConeAngle < own.light.outerConeAngle
    seen_from = made.get_pose(made.main_camera_node)
    np.testing.assert_allclose(seen_from[:3, 3], place.pose.position)
    np.testing.assert_allclose(seen_from[:3, :3].T @ seen_from[:3, :3], np.eye(3), atol=1e-12)
    names = {node.name for node in made.mesh_nodes}
    assert {"ground road", "ground terrain", "scenery rail_post 3"} <= names
    copies = sum(len(node.mesh.primitives[0].poses) for node in made.mesh_nodes if node.name == "scenery rail_post 3")
    assert copies == next(len(b.transforms) for b in place.scene.scenery if b.shape == "rail_post")
    assert any("lamp_stop" in name for name in names)
    for node in made.mesh_nodes:
        assert all(primitive.material is not None for primitive in node.mesh.primitives)
    assert np.isfinite(made.bounds).all()
    assert made.scale < 20e3


def test_what_old_scenarios_call_pyrender_is_drawn_by_opengl_and_told() -> None:
    with pytest.warns(RenamedWarning, match="renderer: pyrender is called opengl now"):
        old = load_scenario("motorway_fog_bank", ["renderer=pyrender"])
    assert old.renderer == "opengl"
    assert load_scenario("motorway_fog_bank", ["renderer=reference"]).renderer == "reference"


@pytest.mark.nightly
def test_pyrenders_own_renderer_draws_it_in_a_process_of_its_own() -> None:
    code = (
        "import os\nos.environ.setdefault('PYOPENGL_PLATFORM', 'egl')\n"
        "import warnings\nwarnings.simplefilter('ignore')\n"
        "import numpy as np, pyrender\nfrom fogsim.render import to_pyrender\n"
        "from fogsim.values import CameraPose\nfrom tests.render.test_pyrender import LEVEL, walls\n"
        "scene = to_pyrender(walls(12.0), CameraPose((0.0, 0.0, 0.0), 0.0), camera=LEVEL)\n"
        "colour, depth = pyrender.OffscreenRenderer(640, 480).render(scene)\n"
        "print(round(float(np.median(depth)), 2), int(np.median(colour)))\n"
    )
    root = Path(__file__).parents[2]
    done = run_python("-c", code, cwd=root)
    assert done.stdout.split() == ["12.0", "186"], done.stderr  # 255 · 0.5^(1/2.2)
