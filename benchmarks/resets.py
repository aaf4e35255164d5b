"""Time and memory of resets: milliseconds each, and growth of the process per reset.

Parts, each in a process of its own: ``sumo`` is libsumo's bare ``load``; ``traffic`` adds our traffic stage and the
steps until the ego is on the road; ``environment`` is the whole of fogsim/FogAdvisory-v0, with a frame rendered, and
``highway`` of fogsim/FogHighway-v0, without SUMO. ``episodes`` is the bare ``load`` of what fogsim/FogAdvisory-v1
draws, another road and traffic each time, and ``advisory-v1``, ``fast-v1``, ``drive-v1`` and ``highway-v1`` are those
environments.
The first quarter of the resets is not counted (libraries load, caches fill, the allocator's pools settle). Growth is
that of the resident set, and of what the C library's allocator has handed out and not got back (glibc only), which
separates a leak from scattered free memory.

    python benchmarks/resets.py [--json] [--resets 200] [--size 64x48] [--part environment …]

The soak test is ``python benchmarks/resets.py --resets 1000``.

Found with libsumo 1.28 on a 2-core Linux machine, growth per reset of resident set / allocator:

    sumo         1000 resets   1.6 KiB / 1.8 KiB
    traffic       750 resets   2.1 KiB / 1.7 KiB   (counted from the 250th on)
    environment  1000 resets   3.1 KiB / 2.1 KiB

    highway      1500 resets   8.2 KiB / 3.1 KiB   (no Python object is left; bare highway-v0 has 3.6)

    episodes     1000 resets   1.4 KiB / 1.4 KiB
    advisory-v1  1000 resets  12.7 KiB / 1.4 KiB
    fast-v1      1000 resets   3.4 KiB / 1.4 KiB
    highway-v1    240 resets  none     / none      (counted from the 60th on)

So most of what grows is SUMO's own ``load``, below 2 KiB each whether the seed changes or not, some 2 MiB in 1000
resets; our stages, the scene, the renderer and the estimators add at most 0.5 KiB to it. The resident set settles
slowly, so short runs show more. Also where each reset has another road what is not given back is what ``load`` keeps;
the resident set grows more, which is no memory in use: probably free memory scattered among scenes of all sizes.
"""

import argparse
import ctypes
import functools
import json
import multiprocessing
import os
import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

import fogsim
import fogsim_envs  # noqa: F401 - registers the environments
from fogsim.scenario import build
from fogsim.traffic.sumo.libsumo_link import LibsumoLink
from fogsim.traffic.sumo_traffic import SumoTraffic, command_line
from fogsim_envs.task.sampling import EpisodeChoice, EpisodeSource

SCENARIO = "motorway_fog_bank"

Reset = Callable[[int], object]
"""Resets once with a seed."""

Part = Callable[[str], AbstractContextManager[Reset]]
"""Makes what is reset, with cameras of a size."""


@contextmanager
def sumo(_: str) -> Iterator[Reset]:
    """SUMO alone."""
    link, setup = LibsumoLink(), build.traffic_setup(fogsim.load_scenario(SCENARIO))
    yield lambda seed: link.begin(command_line(setup, seed))
    link.end()


@contextmanager
def traffic(_: str) -> Iterator[Reset]:
    """The traffic stage."""
    simulation = SumoTraffic(build.traffic_setup(fogsim.load_scenario(SCENARIO)), LibsumoLink())

    def reset(seed: int) -> None:
        simulation.start(seed)
        simulation.observe()

    yield reset
    simulation.close()


@contextmanager
def episodes(_: str) -> Iterator[Reset]:
    """SUMO alone, on the roads and with the demand that fogsim/FogAdvisory-v1 draws."""
    link, source = LibsumoLink(), EpisodeSource(None, None, None, (), "train")

    def reset(seed: int) -> None:
        _, drawn = source.draw(np.random.default_rng(seed), EpisodeChoice())
        link.begin(command_line(build.traffic_setup(drawn.scenario), seed))

    yield reset
    link.end()


@contextmanager
def environment(size: str, env_id: str) -> Iterator[Reset]:
    """Everything; an environment that draws no frames needs no size."""
    width, height = map(int, size.split("x"))
    settings = {} if env_id == FAST_ID else {"image_size": (width, height)}
    env = gymnasium.make(env_id, **settings)

    def reset(seed: int) -> None:
        env.reset(seed=seed)

    yield reset
    env.close()


FAST_ID = "fogsim/FogAdvisoryFast-v1"
ENVIRONMENTS = {
    "environment": "fogsim/FogAdvisory-v0",
    "highway": "fogsim/FogHighway-v0",
    "advisory-v1": "fogsim/FogAdvisory-v1",
    "fast-v1": FAST_ID,
    "drive-v1": "fogsim/FogDrive-v1",
    "highway-v1": "fogsim/FogHighway-v1",
}
PARTS: dict[str, Part] = {
    "sumo": sumo,
    "traffic": traffic,
    "episodes": episodes,
    **{part: functools.partial(environment, env_id=env_id) for part, env_id in ENVIRONMENTS.items()},
}


class _HeapFigures(ctypes.Structure):
    """What glibc's ``mallinfo2`` gives."""

    _fields_ = [(name, ctypes.c_size_t) for name in ("arena", "ordblks", "smblks", "hblks", "hblkhd")] + [
        (name, ctypes.c_size_t) for name in ("usmblks", "fsmblks", "uordblks", "fordblks", "keepcost")
    ]


def resident_kib() -> float:
    """Resident set size of this process [KiB] (Linux)."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1024


def heap_kib() -> float | None:
    """What the C library's allocator has handed out [KiB]; None where it does not report that."""
    mallinfo = getattr(ctypes.CDLL(None), "mallinfo2", None)
    if mallinfo is None:
        return None
    mallinfo.restype = _HeapFigures
    figures = mallinfo()
    return float(figures.uordblks + figures.hblkhd) / 1024


def measure(part: str, resets: int, size: str) -> dict[str, Any]:
    """One record."""
    warm_up = max(1, resets // 4)
    spent, resident, heap = [], 0.0, None
    with PARTS[part](size) as reset:
        for index in range(resets):
            if index == warm_up:
                resident, heap = resident_kib(), heap_kib()
            started = time.perf_counter()
            reset(index)
            spent.append(1e3 * (time.perf_counter() - started))
        counted, heap_now = resets - warm_up, heap_kib()
        grown = (resident_kib() - resident) / counted
        grown_heap = None if heap is None or heap_now is None else round((heap_now - heap) / counted, 2)
    return {
        "part": part,
        "env": ENVIRONMENTS.get(part),
        "resets": resets,
        "ms_median": round(statistics.median(spent[warm_up:]), 1),
        "ms_max": round(max(spent[warm_up:]), 1),
        "growth_kib_per_reset": round(grown, 2),
        "heap_growth_kib_per_reset": grown_heap,
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print a list of flat records")
    parser.add_argument("--resets", type=int, default=200, help="how many resets")
    parser.add_argument("--size", default="64x48", help="camera WIDTHxHEIGHT")
    parser.add_argument("--part", action="append", choices=PARTS, help="what is reset (default: all)")
    arguments = parser.parse_args()
    records = []
    for part in arguments.part or PARTS:
        # A process each: there is one libsumo in a process, and memory of one part must not count for the next.
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            records.append(pool.apply(measure, (part, arguments.resets, arguments.size)))
    if arguments.json:
        print(json.dumps(records, indent=2))
        return
    for record in records:
        print("\n".join(f"{key:26} {value}" for key, value in record.items() if value is not None), end="\n\n")


if __name__ == "__main__":
    main()
