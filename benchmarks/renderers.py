"""Memory that renderers keep: growth of the process per renderer made and closed, and per 1000 frames.

Each backend runs in a process of its own. First renderers are made, draw a frame at each of two sizes and are closed;
then frames are taken through traffic as the closed loop does, each fiftieth at another size by another renderer. The
first quarter of either is not counted (libraries load, shaders compile, the allocator's pools fill). Growth is that of
the resident set, and of what the C library's allocator has handed out and not got back (glibc only), to separate
a leak from scattered free memory.

    python benchmarks/renderers.py [--json] [--renderers 200] [--frames 10000] [--renderer cpu ...]

Found with 200 renderers and 10,000 frames (llvmpipe of Mesa 22.3, 2-core Linux machine busy with other work), growth of
resident set / allocator: "cpu" 0.56 / 0.07 KiB per renderer, 0.0 / 0.0 KiB per 1000 frames; "opengl" 30 / 0.07 and
729 / 0.0. Mesa's resident set settles slowly, by about 5 MiB in all: with 20,000 frames 0.3 KiB per 1000 are left.
"""

import argparse
import json
import multiprocessing
from collections.abc import Callable
from typing import Any

import numpy as np
from frames import Case, read_network, scenario, signs_beside
from resets import heap_kib, resident_kib

from fogsim.render import make_renderer
from fogsim.scenario import build
from fogsim.scene import build_scene, vehicle_batches

SIZES = ("160x120", "320x240")
RENDERERS = ("opengl", "cpu")


def growth(work: Callable[[int], object], times: int) -> tuple[float, float | None]:
    """Growth of the resident set and of the allocator's memory [KiB] for each time that something is done."""
    warm_up = max(1, times // 4)
    for number in range(warm_up):
        work(number)
    resident, heap = resident_kib(), heap_kib()
    for number in range(warm_up, times):
        work(number)
    heap_now, counted = heap_kib(), max(1, times - warm_up)
    grown = (resident_kib() - resident) / counted
    return grown, None if heap is None or heap_now is None else (heap_now - heap) / counted


def soak(renderer: str, renderers: int, frames: int) -> dict[str, Any]:
    """One record."""
    network = read_network()
    scene = build_scene(network, signs_beside(network.route), np.random.default_rng(1))
    cameras = [build.camera(scenario(renderer, "day", size, 1)) for size in SIZES]
    cases = [Case((renderer, "day", size, 1), network) for size in SIZES]
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
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print a list of flat records")
    parser.add_argument("--renderers", type=int, default=200, help="how many are made and closed")
    parser.add_argument("--frames", type=int, default=10_000, help="how many are drawn by one renderer")
    parser.add_argument("--renderer", action="append", choices=RENDERERS, help="default: all")
    arguments = parser.parse_args()
    records = []
    for renderer in arguments.renderer or RENDERERS:
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            records.append(pool.apply(soak, (renderer, arguments.renderers, arguments.frames)))
    if arguments.json:
        print(json.dumps(records, indent=2))
        return
    for record in records:
        print("\n".join(f"{key:34} {value}" for key, value in record.items() if value is not None), end="\n\n")


if __name__ == "__main__":
    main()
