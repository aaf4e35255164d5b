"""Memory that renderers keep: growth of the process per renderer made and closed, and per 1000 frames.

Each backend runs in a process of its own. First renderers are made, draw a frame at each of two sizes and are closed;
then frames are taken through traffic as the closed loop does, each fiftieth at another size by another renderer. The
first quarter of either is not counted (libraries load, shaders compile, the allocator's pools fill). Growth is that of
the resident set, and of what the C library's allocator has handed out and not got back (glibc only), to separate
a leak from scattered free memory.

    python benchmarks/renderers.py [--json] [--renderers 200] [--frames 10000] [--renderer cpu ...]
"""

import numpy as np
from frames import RENDERERS, SHOT, Case, scenario
from harness import Row, apart, parse_options, publish
from resets import growth
from staging import network, signs

from fogsim.render import make_renderer
from fogsim.scenario import build
from fogsim.scene import build_scene, vehicle_batches

SIZES = ("160x120", "320x240")


def soak(renderer: str, renderers: int, frames: int) -> Row:
    """One record."""
    roads = network("motorway")
    scene = build_scene(roads, signs(roads.route, SHOT), np.random.default_rng(1))
    cameras = [build.camera_config(scenario(renderer, "day", size, 1)).on() for size in SIZES]
    cases = [Case((renderer, "day", size, 1)) for size in SIZES]
    vehicles, pose = vehicle_batches(cases[0].traffic[0], 0), cases[0].poses[0]

    def make_and_close(_: int) -> None:
        one = make_renderer(renderer, scene, 10_000.0)
        for camera in cameras:
            one.render(vehicles, camera, pose)
        one.close()

    def draw(number: int) -> None:
        cases[number % 50 == 0].frame(number)

    each = growth(make_and_close, renderers)
    frame = growth(draw, frames)
    for one in cases:
        one.close()
    return {
        "renderer": renderer,
        "renderers": renderers,
        "frames": frames,
        "growth_kib_per_renderer": round(each[0], 2),
        "heap_growth_kib_per_renderer": None if each[1] is None else round(each[1], 2),
        "growth_kib_per_1000_frames": round(1000 * frame[0], 2),
        "heap_growth_kib_per_1000_frames": None if frame[1] is None else round(1000 * frame[1], 2),
    }


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        renderers=(200, "how many are made and closed"),
        frames=(10_000, "how many are drawn by one renderer"),
        renderer=(list(RENDERERS), "which", RENDERERS),
    )
    publish(given, [apart(soak, renderer, given.renderers, given.frames) for renderer in given.renderer])


if __name__ == "__main__":
    main()
