"""Many resets in one process; the long soak test is benchmarks/resets.py."""

import gc
import os
import tracemalloc
from pathlib import Path

from fogsim.traffic import Traffic, TrafficSetup, libsumo_traffic
from fogsim.values import Command, SpeedAdvice
from tests.traffic.common import MOTORWAY, driven, setup_of

WARM_UP, RESETS = 10, 25
KIB = 1024


def setup(folder: Path) -> TrafficSetup:
    """The motorway with an ego that departs at once, so that a reset takes little."""
    text = (MOTORWAY / "motorway.rou.xml").read_text(encoding="utf-8")
    return setup_of(folder, text.replace('"177"', '"2"').replace('"180"', '"5"'), ("ego", "lead"))


def reset(traffic: Traffic, seed: int) -> None:
    traffic.start(seed)
    driven(traffic, 5, Command(SpeedAdvice(20.0)))


def resident() -> int:
    """Resident set size [bytes]."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE")


def test_resets_do_not_pile_up_memory(tmp_path: Path) -> None:
    traffic = libsumo_traffic(setup(tmp_path))
    tracemalloc.start()
    try:
        for seed in range(WARM_UP):
            reset(traffic, seed)
        gc.collect()
        resident_before, python_before = resident(), tracemalloc.get_traced_memory()[0]
        for seed in range(RESETS):
            reset(traffic, seed)
        gc.collect()
        python_grown = tracemalloc.get_traced_memory()[0] - python_before
        grown = resident() - resident_before
    finally:
        tracemalloc.stop()
        traffic.close()
    # SUMO's load keeps about 2 KiB each time by itself; one snapshot that is not let go would be some 50 KiB.
    assert python_grown < RESETS * 2 * KIB
    assert grown < RESETS * 100 * KIB
