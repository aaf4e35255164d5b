"""Time and memory of resets: milliseconds each, and growth of the process per reset.

Parts, each in a process of its own: ``sumo`` is libsumo's bare ``load``; ``traffic`` adds our traffic stage and the
steps until the ego is on the road; ``environment`` is the whole of fogsim/FogAdvisory-v0, with a frame rendered, and
``highway`` of fogsim/FogHighway-v0, without SUMO. ``advisory-v2``, ``fast-v2``, ``drive-v2`` and ``highway-v1`` draw
another road and traffic each time.
The first quarter of the resets is not counted (libraries load, caches fill, the allocator's pools settle). Growth is
that of the resident set, and of what the C library's allocator has handed out and not got back (glibc only), which
separates a leak from scattered free memory.

The soak test is ``python benchmarks/resets.py --resets 1000``.
"""

import ctypes
import os
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from pathlib import Path

import gymnasium
from harness import Row, apart, median, parse_options, publish, timed

import fogsim
import fogsim_envs  # noqa: F401 - registers the environments
from fogsim.scenario import build
from fogsim.traffic.sumo.libsumo_link import LibsumoLink
from fogsim.traffic.sumo_traffic import SumoTraffic, command_line

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
def environment(size: str, env_id: str) -> Iterator[Reset]:
    """Everything; an environment that draws no frames needs no size."""
    width, height = map(int, size.split("x"))
    settings = {} if env_id == FAST_ID else {"image_size": (width, height)}
    env = gymnasium.make(env_id, **settings)

    def reset(seed: int) -> None:
        env.reset(seed=seed)

    yield reset
    env.close()


FAST_ID = "fogsim/FogAdvisoryFast-v2"
ENVIRONMENTS = {
    "environment": "fogsim/FogAdvisory-v0",
    "highway": "fogsim/FogHighway-v0",
    "advisory-v2": "fogsim/FogAdvisory-v2",
    "fast-v2": FAST_ID,
    "drive-v2": "fogsim/FogDrive-v2",
    "highway-v1": "fogsim/FogHighway-v1",
}
PARTS: dict[str, Part] = {
    "sumo": sumo,
    "traffic": traffic,
    **{part: partial(environment, env_id=env_id) for part, env_id in ENVIRONMENTS.items()},
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


def growth(work: Callable[[int], object], times: int) -> tuple[float, float | None]:
    """Growth of the resident set and of the allocator's memory [KiB] for each time, the first quarter not counted."""
    warm_up = max(1, times // 4)
    for number in range(warm_up):
        work(number)
    resident, heap = resident_kib(), heap_kib()
    for number in range(warm_up, times):
        work(number)
    heap_now, counted = heap_kib(), max(1, times - warm_up)
    grown = round((resident_kib() - resident) / counted, 5)
    return grown, None if heap is None or heap_now is None else round((heap_now - heap) / counted, 5)


def measure(part: str, resets: int, size: str) -> Row:
    """One record."""
    spent: list[float] = []
    with PARTS[part](size) as reset:
        grown, grown_heap = growth(lambda seed: spent.append(timed(partial(reset, seed))[1]), resets)
    counted = spent[max(1, resets // 4) :]
    return {
        "part": part,
        "env": ENVIRONMENTS.get(part),
        "resets": resets,
        "ms_median": median(counted, 1),
        "ms_max": round(max(counted), 1),
        "growth_kib_per_reset": round(grown, 2),
        "heap_growth_kib_per_reset": None if grown_heap is None else round(grown_heap, 2),
    }


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        resets=(200, "how many resets"),
        size=("64x48", "camera WIDTHxHEIGHT"),
        part=(list(PARTS), "what is reset", PARTS),
    )
    # A process each: there is one libsumo in a process, and memory of one part must not count for the next.
    publish(given, [apart(measure, part, given.resets, given.size) for part in given.part])


if __name__ == "__main__":
    main()
