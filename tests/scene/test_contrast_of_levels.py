"""Contrast of the rear of vehicles, as methods follow it, where the renderer changes their level of detail."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from fogsim.render import Renderer, make_renderer
from fogsim.render.drawing import MeshTable
from fogsim.render.renderer import shapes_of
from fogsim.scene.vehicles import bodies, body_shapes
from fogsim.values import Batch, Camera, CameraPose, Mesh, Scene
from fogsim.values.scene import LEVELS_OF_DETAIL, Surface
from fogsim.vision.vehicle.contrast_ratio import RearPicture, contrast_ratio
from tests.render.conftest import mesh

ILLUMINANCE = 1e4
SKY = ILLUMINANCE * 9 / (7 * math.pi) / 3
FOCAL, EYE, FINE = 554.0, 1.3, 6
PAINTS = (0.03, 0.2, 0.6)
LEVELS = LEVELS_OF_DETAIL[1:]


def road_and(shapes: dict[str, Mesh]) -> Renderer:
    """Vehicles on level ground; a level's name has no ending, lest the renderer should choose."""
    ground = mesh(np.array([[[-4e3, -4e3, 0.0], [4e3, -4e3, 0.0], [0.0, 4e3, 0.0]]]))
    surface = np.full_like(ground.surface, int(Surface.TERRAIN))
    ground = replace(ground, reflectance=np.full_like(ground.reflectance, 0.1), surface=surface)
    renamed = {name.replace(":", " "): shape for name, shape in shapes.items()}
    return make_renderer("cpu", Scene(ground, renamed, ()), ILLUMINANCE)


def rear(
    renderer: Renderer, shape: str, size: tuple[float, float, float], paint: float, distance: float
) -> RearPicture:
    """The rear at a distance [m] in pixels that mean over all they see."""
    length, width, height = size
    scale = FOCAL / distance
    across, high = math.ceil(1.3 * width * scale) + 4, math.ceil(max(2.6, height + 0.3) * scale) + 6
    foot = high - 4.0
    centre = FINE * 0.5 * across, FINE * (foot - EYE * scale)
    camera = Camera(FINE * across, FINE * high, FINE * FOCAL, centre, EYE)
    transform = np.diag((length, width, height, 1.0)).astype(np.float32)[None]
    transform[0, 0, 3] = distance + length
    one = np.zeros(1, np.int32)
    copy = Batch(shape.replace(":", " "), transform, np.full((1, 3), paint, np.float32), one, one)
    view = renderer.render([copy], camera, CameraPose((0.0, 0.0, EYE), 0.0))
    contrast: NDArray[np.float64] = 1.0 - view.radiance.astype(np.float64).mean(axis=2) / SKY
    contrast = contrast.reshape(high, FINE, across, FINE).mean(axis=(1, 3))
    return RearPicture(contrast, 0.006, 0.5 * across - 0.5, foot - 0.5, scale, width)


def test_a_level_takes_over_with_the_contrast_of_the_rear_that_the_full_shape_has() -> None:
    shapes = body_shapes()
    renderer, table = road_and(shapes), MeshTable.of(shapes)
    plain = np.zeros(len(shapes), np.bool_)
    chosen = shapes_of(table.numbers, *table.extremes(), np.diff(table.first_face), plain, LEVELS_OF_DETAIL)
    for name, body in bodies().items():
        half = 0.5 * sorted(body.size)[1]
        for level, finer in zip(LEVELS, ("", *LEVELS), strict=False):
            distance = 1.02 * FOCAL * half / chosen.detail[table.numbers[name + finer]]
            # Over the gap below its box, a trailer alone has little that is dark.
            room = 0.02 if level != ":speck" else 0.04 if name == "trailer" else 0.025
            for paint in PAINTS:
                whole, simple = (rear(renderer, name + one, body.size, paint, distance) for one in ("", level))
                ratio = contrast_ratio(whole, simple)
                assert ratio is not None
                assert ratio.ratio == pytest.approx(1.0, abs=room), (name, level, paint, distance)
