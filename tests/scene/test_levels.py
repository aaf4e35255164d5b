"""Levels of detail of vehicles and trees beside their shapes in full, as the cpu renderer draws them in clear air."""

import math
from collections.abc import Iterator
from functools import cache
from itertools import pairwise, product

import numpy as np
import pytest
from numpy.typing import NDArray

from fogsim.render import Renderer, make_renderer
from fogsim.scene.trees import tree_shapes
from fogsim.scene.vehicles import bodies, body_shapes
from fogsim.values import Batch, Camera, CameraPose, Mesh, Scene
from fogsim.values.scene import LEVELS_OF_DETAIL
from tests.render.conftest import mesh

ILLUMINANCE = 1e4
SKY = ILLUMINANCE * 9 / (7 * math.pi) / 3
"""Luminance of the CIE overcast sky at the horizon [cd/m²]."""

PAINTS = {"red": (0.78, 0.03, 0.03), "cyan": (0.03, 0.78, 0.78)}
"""The darkest and the brightest of each channel; contrast is linear in reflectance, so others lie between."""

HEADINGS = {"rear": 0.0, "front": math.pi, "left": -0.5 * math.pi}
TALL = 480
"""Side of the picture [px]; a vehicle is about a third of it."""

TREES = tree_shapes(np.random.default_rng(3))


def renderer_of(shapes: dict[str, Mesh]) -> Renderer:
    """It would itself choose levels, so here each level has a name without an ending."""
    renamed = {name.replace(":", " "): shape for name, shape in shapes.items()}
    return make_renderer("cpu", Scene(mesh(np.zeros((0, 3, 3))), renamed, ()), ILLUMINANCE)


def look(
    renderer: Renderer,
    shape: str,
    camera: Camera,
    place: tuple[float, float, float],
    heading: float,
    size: tuple[float, float, float],
    paint: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> tuple[int, NDArray[np.float32]]:
    """Area [px] and mean contrast to the sky (3,) of a shape at a place [m], scaled and turned [rad]."""
    transform = np.eye(4, dtype=np.float32)[None]
    cosine, sine = math.cos(heading), math.sin(heading)
    transform[0, :3, :3] = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]]) * size
    transform[0, :3, 3] = place
    one = np.zeros(1, np.int32)
    copy = Batch(shape.replace(":", " "), transform, np.array([paint], np.float32), one, one + 20)
    view = renderer.render([copy], camera, CameraPose((0.0, 0.0, camera.mount_height), 0.0))
    own = view.instance == 20
    return int(own.sum()), view.radiance[own].mean(axis=0) / SKY - 1.0


def cases(name: str) -> Iterator[tuple[str, str, float, float, float]]:
    """Levels, sides and distances [m] at which a body is seen, and how far area and contrast may be off."""
    for level, side, distance in product((":far", ":tiny"), ("rear", "front"), (30.0, 120.0)):
        # Nearer than they are made for, what is far back in a long body has another size; a front shows more of that.
        # A motorcycle has hardly a flat side.
        room = 0.05 if name == "motorcycle" else 0.025 if distance > 50.0 else 0.03 if side == "rear" else 0.06
        yield level, side, distance, room, room
    yield from ((level, "left", 60.0, 0.03, 0.03) for level in (":far", ":tiny"))
    yield from ((":speck", side, 120.0, 0.08, 0.045) for side in ("rear", "front"))


def test_a_level_has_about_the_outline_and_the_mean_contrast_of_its_body() -> None:
    renderer = renderer_of(body_shapes())

    @cache
    def seen(name: str, level: str, paint: str, side: str, distance: float) -> tuple[int, NDArray[np.float32]]:
        length, width, height = bodies()[name].size
        focal = TALL / 3 * distance / (0.5 * length if side == "left" else width)
        camera = Camera(TALL, TALL, focal, (TALL / 2, TALL * (0.75 if height > 2 else 0.6)), 1.3)
        x, y = {"rear": (length, 0.0), "front": (0.0, 0.0), "left": (width / 2, -length / 2)}[side]
        place = (distance + x, y, 0.0)
        return look(renderer, name + level, camera, place, HEADINGS[side], (length, width, height), PAINTS[paint])

    for name, paint in product(bodies(), PAINTS):
        for level, side, distance, outline, mean in cases(name):
            (area, contrast), (whole_area, whole) = (seen(name, one, paint, side, distance) for one in (level, ""))
            assert area == pytest.approx(whole_area, rel=outline), (name, level, side, distance, paint)
            assert contrast == pytest.approx(whole, abs=mean), (name, level, side, distance, paint)


@pytest.mark.parametrize("kind", ["conifer", "broad_leaved", "woodland"])
def test_levels_of_trees_cover_the_same_area_with_the_same_light_by_fewer_triangles(kind: str) -> None:
    renderer, camera = renderer_of(TREES), Camera(200, 200, 1000.0, (100.0, 100.0), 1.0)
    wood = kind == "woodland"  # which is looked at from its front

    def seen(level: str) -> tuple[float, float]:
        """Area [px] and light over the sky's, the mean of kinds and sides."""
        views = []
        for number, turn in product(range(5), np.arange(8.0)):
            angle = 1.5 * math.pi + 0.1 * (turn - 3.5) if wood else 0.25 * math.pi * turn
            size, place = ((40.0, 12.0, 8.0) if wood else (8.0, 8.0, 8.0)), (300.0 if wood else 100.0, 0.0, -3.0)
            area, contrast = look(renderer, f"{kind}_{number}{level}", camera, place, angle, size)
            views.append((area, 1.0 + contrast.mean()))
        area, light = np.mean(views, axis=0)
        return area, light

    whole_area, whole_light = seen("")
    for level in LEVELS_OF_DETAIL:
        area, light = seen(level)
        assert area == pytest.approx(whole_area, rel=0.22 if level == ":speck" else 0.1)
        assert light == pytest.approx(whole_light, rel=0.06)
    counts = [len(TREES[f"{kind}_0{level}"].faces) for level in ("", *LEVELS_OF_DETAIL)]
    assert all(one > other for one, other in pairwise(counts))
    assert counts[-1] <= 8


def test_trees_that_come_again_with_a_seed_are_the_same_objects_and_are_not_written_to() -> None:
    rng, other = np.random.default_rng(3), np.random.default_rng(3)
    trees, again = tree_shapes(rng), tree_shapes(other)
    assert all(again[name] is tree for name, tree in trees.items())
    assert rng.random() == other.random()
    with pytest.raises(ValueError, match="read-only"):
        TREES["conifer_0"].positions[0] = 0.0
