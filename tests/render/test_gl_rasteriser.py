import hashlib
import math
from ctypes.util import find_library
from pathlib import Path

import numpy as np
import pytest

from fogsim.render import RenderError
from fogsim.render.cpu.rasteriser import CPURasteriser
from fogsim.render.drawing import NEAR, NOTHING, MeshTable
from fogsim.render.opengl.context import context
from fogsim.render.opengl.meshes import COMMAND, COPY, corners, packed
from fogsim.render.opengl.rasteriser import GLRasteriser
from fogsim.values import Camera, CameraPose
from fogsim.values.pinhole import camera_axes
from tests.helpers.command import run_python
from tests.render.conftest import drawing_of, mesh

pytestmark = pytest.mark.usefixtures("opengl")

CAMERA = Camera(160, 120, 144.25, (80.0, 60.0), 1.38, pitch=math.radians(2.0))
POSE = CameraPose((3.0, -2.0, 1.38), heading=0.7)


def scattered(rng: np.random.Generator, number: int, axes: np.ndarray) -> np.ndarray:
    """Turned and stretched transforms (n, 3, 4) to offsets that lie before a camera, some half beside the picture."""
    turned = np.linalg.qr(rng.normal(size=(number, 3, 3)))[0] * rng.uniform(0.3, 3.0, (number, 1, 3))
    depth = rng.uniform(10.0, 60.0, number)
    offset = np.stack((rng.uniform(-0.7, 0.7, number) * depth, rng.uniform(-0.5, 0.5, number) * depth, depth), axis=1)
    return np.concatenate((turned, (offset @ axes)[..., None]), axis=2)


def soup(rng: np.random.Generator, counts: tuple[int, ...]) -> MeshTable:
    """Meshes of so many small triangles each, scattered over a few metres."""
    return MeshTable.of(
        {f"mesh {n}": mesh(rng.normal(size=(n, 1, 3)) + 0.3 * rng.normal(size=(n, 3, 3))) for n in counts}
    )


def test_both_rasterisers_see_the_same_triangle_of_the_same_copy() -> None:
    rng = np.random.default_rng(4)
    table = soup(rng, (1, 7, 60, 300))
    drawing = drawing_of(table, rng.integers(0, 4, 200), scattered(rng, 200, camera_axes(CAMERA, POSE)))
    makers = (GLRasteriser, CPURasteriser)
    by_opengl, by_numba = (maker(table).triangle_ids(drawing, CAMERA, POSE).copy() for maker in makers)
    assert len(np.unique(by_opengl)) > 1000
    # Triangles pierce one another all over the picture, and along those lines either may win.
    assert np.mean(by_opengl == by_numba) > 0.99


@pytest.mark.parametrize("seed", range(3))
def test_both_rasterisers_cover_the_same_pixels_where_triangles_reach_behind_the_camera(seed: int) -> None:
    rng = np.random.default_rng(seed)
    table = MeshTable.of({"large": mesh(rng.normal(size=(4, 3, 3)))})
    transforms = scattered(rng, 5, camera_axes(CAMERA, POSE))
    transforms[..., 3] *= 0.05
    drawing = drawing_of(table, [0] * 5, transforms)
    seen = [maker(table).triangle_ids(drawing, CAMERA, POSE) != NOTHING for maker in (GLRasteriser, CPURasteriser)]
    assert 0.1 < seen[0].mean() < 0.98
    assert np.mean(seen[0] == seen[1]) > 0.999


def quad(near: float, half: float, up: float = 0.0) -> np.ndarray:
    """Two triangles (2, 3, 3) across the optical axis, in camera axes."""
    a, b, c, d = ([x, y + up, near] for x, y in ((-half, -half), (half, -half), (half, half), (-half, half)))
    return np.array([[a, b, c], [a, c, d]])


@pytest.mark.parametrize("maker", [GLRasteriser, CPURasteriser])
def test_the_nearer_is_seen_from_both_sides_and_nothing_before_the_near_plane(
    maker: type[GLRasteriser] | type[CPURasteriser],
) -> None:
    turned = quad(20.0, 1.0)[:, ::-1]
    table = MeshTable.of({"far": mesh(quad(30.0, 3.0)), "near": mesh(turned), "eye": mesh(quad(0.39, 1.0))})
    axes = camera_axes(CAMERA, POSE)
    level = np.concatenate((axes.T, np.zeros((3, 1))), axis=1)
    triangle_ids = maker(table).triangle_ids(drawing_of(table, [2, 1, 0], np.array([level] * 3)), CAMERA, POSE)
    middle, beside = triangle_ids[58:62, 78:82], triangle_ids[60, 80 + 10]
    assert NEAR > 0.39
    assert set(np.unique(middle)) <= {2, 3}
    assert beside in {4, 5}
    assert triangle_ids[0, 0] == NOTHING


@pytest.mark.parametrize("maker", [GLRasteriser, CPURasteriser])
@pytest.mark.parametrize("beside", [-0.01, 0.01])
def test_a_pixel_is_seen_if_its_centre_is(maker: type[GLRasteriser] | type[CPURasteriser], beside: float) -> None:
    # A quad whose left edge lies a hundredth of a pixel beside the centre of column 100 and its top beside row 70.
    shifted = quad(10.0, 1.0)
    shifted[..., 0] += 1.0 + (100 + beside - 80) * 10.0 / CAMERA.focal_length
    shifted[..., 1] += 1.0 + (70 + beside - 60) * 10.0 / CAMERA.focal_length
    table = MeshTable.of({"quad": mesh(shifted)})
    level = np.concatenate((camera_axes(CAMERA, POSE).T, np.zeros((3, 1))), axis=1)
    rows, columns = np.nonzero(maker(table).triangle_ids(drawing_of(table, [0], level[None]), CAMERA, POSE) != NOTHING)
    assert (rows.min(), columns.min()) == ((70, 100) if beside < 0 else (71, 101))


def test_packing_keeps_copies_of_a_mesh_together_and_corners_know_their_triangles() -> None:
    table = soup(np.random.default_rng(1), (2, 3, 4))
    transforms = np.random.default_rng(2).normal(size=(5, 3, 4)).astype(np.float32)
    drawing = drawing_of(table, [2, 0, 2, 2, 0], transforms)
    clip = np.random.default_rng(3).normal(size=(3, 3))
    copies, commands = packed(drawing, clip, table.first_face)
    assert (copies.dtype, commands.dtype) == (COPY, COMMAND)
    assert commands.tolist() == [(6, 2, 0, 0), (12, 3, 15, 2)]
    order = [1, 4, 0, 2, 3]
    assert copies["first"].tolist() == drawing.first[order].tolist()
    assert copies["clip"] == pytest.approx(np.einsum("ij,njk->nik", clip, transforms[order]), rel=1e-5, abs=1e-5)
    table = soup(np.random.default_rng(1), (2, 3))
    made = corners(table)
    assert made["triangle"].tolist() == [0] * 3 + [1] * 3 + [0] * 3 + [1] * 3 + [2] * 3
    assert np.array_equal(made["position"], table.positions[table.faces.ravel()])


def test_a_drawing_may_be_empty_a_size_can_change_and_a_closed_one_is_refused() -> None:
    rng = np.random.default_rng(2)
    table = soup(rng, (50,))
    rasteriser = GLRasteriser(table)
    drawing = drawing_of(table, [0] * 20, scattered(rng, 20, camera_axes(CAMERA, POSE)))
    first = rasteriser.triangle_ids(drawing, CAMERA, POSE).copy()
    assert (first != NOTHING).any()
    empty = drawing_of(table, [], np.empty((0, 3, 4)))
    assert (rasteriser.triangle_ids(empty, CAMERA, POSE) == NOTHING).all()
    wide = Camera(200, 50, 144.25, (100.0, 25.0), 1.38)
    assert rasteriser.triangle_ids(drawing, wide, POSE).shape == (50, 200)
    assert np.array_equal(rasteriser.triangle_ids(drawing, CAMERA, POSE), first)
    rasteriser.close()
    rasteriser.close()
    with pytest.raises(RenderError, match="closed"):
        rasteriser.triangle_ids(drawing, CAMERA, POSE)


def here() -> tuple[str, str]:
    """OpenGL's version and a digest of a picture."""
    rng = np.random.default_rng(9)
    table = soup(rng, (3, 40, 90))
    drawing = drawing_of(table, [0, 1, 2, 1, 1, 2] * 4, scattered(rng, 24, camera_axes(CAMERA, POSE)))
    triangle_ids = GLRasteriser(table).triangle_ids(drawing, CAMERA, POSE)
    digest = hashlib.sha256(triangle_ids.tobytes()).hexdigest()
    return f"{context().version} {context().description}", f"{len(np.unique(triangle_ids))} {digest}"


FORK = """
import os
from fogsim.render import gl_report
if os.fork() == 0:
    try:
        gl_report()
    except Exception as error:
        print(type(error).__name__, error, flush=True)
    os._exit(0)
os.wait()
print("parent", gl_report())"""


def elsewhere(then: str = "", **environment: str) -> list[str]:
    """The same of another process, and what it prints in code thereafter."""
    code = f"import sys\nsys.path.insert(0, {str(Path(__file__).parent)!r})\nimport test_gl_rasteriser as t"
    code += f"\nprint(*t.here(), sep='\\n', flush=True)\n{then}"
    return run_python("-c", code, environment=environment).stdout.splitlines()


@pytest.fixture(scope="module")
def older() -> list[str]:
    """What a process with an older OpenGL draws, and its child that is forked after it."""
    return elsewhere(FORK, MESA_GL_VERSION_OVERRIDE="4.1")


def test_a_context_from_before_a_fork_is_refused_in_the_child(older: list[str]) -> None:
    child, parent = older[2:]
    assert child.startswith("RenderError")
    assert "does not survive a fork: start workers before the parent draws, or with the start method 'spawn'" in child
    assert parent.startswith("parent OpenGL")


def test_an_older_opengl_draws_the_same(older: list[str]) -> None:
    newer = here()
    if not older[0].startswith("(4, 1)"):
        pytest.skip("this OpenGL is not Mesa's, which can be told to be old")
    assert not newer[0].startswith("(4, 1)")
    assert newer[1] == older[1]


@pytest.mark.nightly
@pytest.mark.skipif(find_library("OSMesa") is None, reason="OSMesa is not installed here")
def test_osmesa_draws_the_same_as_egl() -> None:
    osmesa = elsewhere(PYOPENGL_PLATFORM="osmesa")
    assert "OSMesa" in osmesa[0]
    assert osmesa[1] == here()[1]
