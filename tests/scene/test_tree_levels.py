"""Levels of detail of trees beside the trees in full."""

import math

import numpy as np
import pytest

from fogsim.render import make_renderer
from fogsim.scene.trees import tree_shapes
from fogsim.values import Batch, Camera, CameraPose, Mesh, Scene
from fogsim.values.scene import LEVELS_OF_DETAIL

CAMERA = Camera(200, 200, 1000.0, (100.0, 100.0), 1.0)
SHAPES = tree_shapes(np.random.default_rng(3))


@pytest.fixture(scope="module")
def seen() -> dict[str, tuple[float, float]]:
    """Area [px] and radiance of every level, the mean of kinds and sides."""
    # A renderer would itself choose levels, so here each level has a name without an ending.
    renamed = {name.replace(":", " "): shape for name, shape in SHAPES.items()}
    nothing = np.zeros(0, np.int32)
    ground = Mesh(
        *np.zeros((3, 0, 3), np.float32), nothing, np.zeros((0, 4), np.float32), nothing, np.zeros((0, 3), np.uint32)
    )
    renderer = make_renderer("cpu", Scene(ground, renamed, ()), 1e4)
    found = {}
    for kind in ("conifer", "broad_leaved", "woodland"):
        for level in ("", *LEVELS_OF_DETAIL):
            views = []
            for number, turn in ((number, turn) for number in range(5) for turn in np.arange(8.0)):
                # Woods are looked at from their front.
                angle = 1.5 * math.pi + 0.1 * (turn - 3.5) if kind == "woodland" else 0.25 * math.pi * turn
                scale = (40.0, 12.0, 8.0) if kind == "woodland" else (8.0, 8.0, 8.0)
                transform = np.eye(4, dtype=np.float32)[None]
                sine, cosine = math.sin(angle), math.cos(angle)
                transform[0, :3, :3] = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]]) * scale
                transform[0, :3, 3] = (300.0 if kind == "woodland" else 100.0, 0.0, -4.0)
                name = f"{kind}_{number}{level}".replace(":", " ")
                copy = Batch(
                    name, transform, np.zeros((1, 3), np.float32), np.zeros(1, np.int32), np.full(1, 20, np.int32)
                )
                view = renderer.render([copy], CAMERA, CameraPose((0.0, 0.0, 0.0), 0.0))
                tree = view.instance == 20
                views.append((float(tree.sum()), float(view.radiance[tree].mean())))
            area, radiance = np.mean(views, axis=0)
            found[kind + level] = (area, radiance)
    return found


def test_levels_of_detail_cover_the_same_area_with_the_same_light(seen: dict[str, tuple[float, float]]) -> None:
    for level in LEVELS_OF_DETAIL:
        for kind in ["conifer", "broad_leaved", "woodland"]:
            (area, radiance), (whole_area, whole_radiance) = seen[kind + level], seen[kind]
            assert area == pytest.approx(whole_area, rel=0.22 if level == ":speck" else 0.1)
            assert radiance == pytest.approx(whole_radiance, rel=0.06)


@pytest.mark.parametrize("kind", ["conifer", "broad_leaved", "woodland"])
def test_each_level_is_simpler_than_the_one_before(kind: str) -> None:
    counts = [len(SHAPES[f"{kind}_0{level}"].faces) for level in ("", *LEVELS_OF_DETAIL)]
    assert counts == sorted(counts, reverse=True)
    assert len(set(counts)) == len(counts)
    assert counts[-1] <= 8
