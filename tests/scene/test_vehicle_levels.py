"""Levels of detail of vehicles beside their bodies in full, as the cpu renderer draws them in clear air."""

import math
from collections.abc import Callable
from functools import cache
from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

from fogsim.render import Renderer, make_renderer
from fogsim.scene.vehicles import bodies, body_shapes
from fogsim.values import Batch, Camera, CameraPose, Mesh, Scene

ILLUMINANCE = 1e4
SKY = ILLUMINANCE * 9 / (7 * math.pi) / 3
"""Luminance of the CIE overcast sky at the horizon [cd/m²]."""

PAINTS = {"red": (0.78, 0.03, 0.03), "cyan": (0.03, 0.78, 0.78)}
"""The darkest and the brightest of each channel; contrast is linear in reflectance, so others lie between."""

HEADINGS = {"rear": 0.0, "front": math.pi, "left": -0.5 * math.pi}
TALL = 480
"""Side of the picture [px]; a vehicle is about a third of it."""

Seen = Callable[[str, str, str, str, float], tuple[int, NDArray[np.float32]]]


@pytest.fixture(scope="module")
def renderer() -> Renderer:
    # A renderer would itself choose levels, so here each level has a name without an ending.
    renamed = {name.replace(":", " "): shape for name, shape in body_shapes().items()}
    none, points, faces = np.zeros(0, np.int32), np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint32)
    ground = Mesh(points, points, points, none, np.zeros((0, 4), np.float32), none, faces)
    return make_renderer("cpu", Scene(ground, renamed, ()), ILLUMINANCE)


@pytest.fixture(scope="module")
def seen(renderer: Renderer) -> Seen:
    """Area [px] and mean contrast to the sky (3,) of a body at a level of detail, from a side, at a distance [m]."""

    @cache
    def look(name: str, level: str, paint: str, side: str, distance: float) -> tuple[int, NDArray[np.float32]]:
        length, width, height = bodies()[name].size
        heading, across = HEADINGS[side], 0.5 * length if side == "left" else width
        focal = TALL / 3 * distance / across
        camera = Camera(TALL, TALL, focal, (TALL / 2, TALL * (0.75 if height > 2 else 0.6)), 1.3)
        place = {
            "rear": (distance + length, 0.0),
            "front": (distance, 0.0),
            "left": (distance + width / 2, -length / 2),
        }
        transform = np.eye(4, dtype=np.float32)[None]
        cosine, sine = math.cos(heading), math.sin(heading)
        rotation = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
        transform[0, :3, :3], transform[0, :2, 3] = rotation * (length, width, height), place[side]
        colour, lamps = np.array([PAINTS[paint]], np.float32), np.zeros(1, np.int32)
        copy = Batch((name + level).replace(":", " "), transform, colour, lamps, np.full(1, 20, np.int32))
        view = renderer.render([copy], camera, CameraPose((0.0, 0.0, 1.3), 0.0))
        own = view.instance == 20
        return int(own.sum()), view.radiance[own].mean(axis=0) / SKY - 1.0

    return look


def test_a_level_has_the_outline_and_the_mean_contrast_of_its_body(seen: Seen) -> None:
    for name, level, side, distance in product(bodies(), (":far", ":tiny"), ("rear", "front"), (30.0, 60.0, 120.0)):
        # Nearer than they are made for, what is far back in a long body has another size; a front shows more of that.
        # A motorcycle has hardly a flat side.
        tolerance = 0.05 if name == "motorcycle" else 0.025 if distance > 50.0 else 0.03 if side == "rear" else 0.06
        for paint in PAINTS:
            (area, contrast), (whole_area, whole) = (seen(name, one, paint, side, distance) for one in (level, ""))
            assert area == pytest.approx(whole_area, rel=tolerance), (name, level, side, distance, paint)
            assert contrast == pytest.approx(whole, abs=tolerance), (name, level, side, distance, paint)


def test_a_speck_has_about_the_outline_and_the_mean_contrast_of_its_body(seen: Seen) -> None:
    for name, side, paint in product(bodies(), ("rear", "front"), PAINTS):
        (area, contrast), (whole_area, whole) = (seen(name, one, paint, side, 120.0) for one in (":speck", ""))
        assert area == pytest.approx(whole_area, rel=0.08)
        assert contrast == pytest.approx(whole, abs=0.045), (name, side, paint)


def test_a_level_has_the_contrast_of_its_body_from_the_left(seen: Seen) -> None:
    for name in bodies():
        for level in [":far", ":tiny"]:
            for paint in PAINTS:
                (area, contrast), (whole_area, whole) = (seen(name, one, paint, "left", 60.0) for one in (level, ""))
                assert area == pytest.approx(whole_area, rel=0.03)
                assert contrast == pytest.approx(whole, abs=0.03), paint
