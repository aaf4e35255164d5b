"""Renderers in other processes, without OpenGL, and many of them one after another."""

from pathlib import Path

import pytest

from tests.helpers.command import run_python

WORKERS = Path(__file__).with_name("workers.py")
CHECKOUT = WORKERS.parents[2]
PACKAGES = "sudo apt-get install libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri"


def run(*arguments: str, **environment: str) -> str:
    """What a fresh Python says."""
    done = run_python(*arguments, environment=environment, check=False)
    return done.stdout + done.stderr


@pytest.mark.usefixtures("opengl")
# Fork with cpu draws below, where the parent drew first.
@pytest.mark.parametrize(
    ("method", "renderer"),
    [
        ("fork", "opengl"),
        pytest.param("spawn", "cpu", marks=pytest.mark.nightly),
        pytest.param("forkserver", "opengl", marks=pytest.mark.nightly),
    ],
)
def test_workers_of_vector_environments_draw(method: str, renderer: str) -> None:
    assert "frames 2 2 alike" in run(str(WORKERS), method, renderer)


@pytest.mark.nightly
@pytest.mark.usefixtures("opengl")
def test_workers_that_are_spawned_after_the_parent_drew_draw() -> None:
    assert "frames 2 2 alike" in run(str(WORKERS), "spawn", "opengl", "--draw-first")


def test_workers_that_are_forked_after_the_parent_drew_without_opengl_draw() -> None:
    assert "frames 2 2 alike" in run(str(WORKERS), "fork", "cpu", "--draw-first")


REPORT = (
    "from fogsim.render import gl_report\ntry:\n    gl_report()\nexcept Exception as e:\n    print(type(e).__name__, e)"
)


def test_a_missing_library_names_the_packages_in_one_line() -> None:
    said = run("-c", f"import sys\nsys.modules['pyrender.platforms'] = None\n{REPORT}")
    assert said.startswith("MissingDependencyError")
    assert PACKAGES in said
    assert said.count("\n") == 1


def test_a_platform_that_cannot_draw_off_screen_is_named() -> None:
    said = run("-c", REPORT, PYOPENGL_PLATFORM="glx")
    assert said.startswith("MissingDependencyError PYOPENGL_PLATFORM is 'glx'")
    assert "'egl' or 'osmesa'" in said
    assert said.count("\n") == 1


@pytest.mark.parametrize("missing", [pytest.param("OpenGL", marks=pytest.mark.nightly), "pyrender"])
def test_without_opengl_the_cpu_draws(missing: str) -> None:
    code = (
        f"import sys\nsys.modules['{missing}'] = None\nsys.argv = ['w', 'none', 'auto']\n"
        f"exec(compile(open({str(WORKERS)!r}).read(), 'workers', 'exec'))"
    )
    assert "one frame" in run("-c", code)


SOAK = f"""
import sys
sys.path[:0] = [{str(CHECKOUT)!r}, {str(CHECKOUT / "benchmarks")!r}]
from fogsim.render import make_renderer
from fogsim.scene import vehicle_batches
from resets import growth
from tests.render.conftest import camera, motorway

place = motorway()
vehicles = vehicle_batches(place.traffic, 0)

def make_and_close(_):
    renderer = make_renderer(sys.argv[1], place.scene, 10_000.0)
    for width, height in ((160, 120), (320, 240)):
        renderer.render(vehicles, camera(width, height), place.pose)
    renderer.close()

print(growth(make_and_close, 10)[1])
"""


@pytest.mark.nightly
@pytest.mark.usefixtures("opengl")
@pytest.mark.parametrize("renderer", ["opengl", "cpu"])
def test_renderers_made_and_closed_leave_no_memory_behind(renderer: str) -> None:
    grown = run("-c", SOAK, renderer).strip()
    if grown == "None":
        pytest.skip("this C library does not tell what it has handed out")
    # One renderer of this scene holds some megabytes.
    assert float(grown) < 100.0
