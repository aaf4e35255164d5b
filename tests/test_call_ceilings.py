"""Function calls a frame: a measure of the loop's own cost that the machine's load does not disturb."""

import cProfile
import pstats
from itertools import islice
from typing import Any

import pytest

import fogsim

CEILINGS = {
    "demo": ("motorway_fog_bank", [], 3450),
    "demo, 640x480": ("motorway_fog_bank", ["camera.width=640", "camera.height=480"], 3550),
    "negru2013": ("motorway_fog_bank", ["estimators=[negru2013]"], 2200),
    "city": ("city_fog", [], 6200),
    "night": ("night_motorway_fog", [], 4750),
    "patches of fog": ("patchy_fog", [], 5600),
}
"""Scenario, settings, and most calls a frame of Python's and C's functions, about a tenth above what it takes."""

SKIPPED, COUNTED = 20, 30
SMALL = ["camera.width=160", "camera.height=120"]


@pytest.mark.parametrize("name", CEILINGS)
def test_frames_take_few_calls(name: str) -> None:
    scenario, settings, most = CEILINGS[name]
    loaded = fogsim.load_scenario(scenario, [*SMALL, *settings])
    # What a process does once, such as loading kernels, is done in the first run.
    for profiler in (cProfile.Profile(), cProfile.Profile()):
        steps = fogsim.run(loaded, seed=1)
        next(islice(steps, SKIPPED, None))
        profiler.enable()
        assert sum(1 for _ in islice(steps, COUNTED)) == COUNTED
        profiler.disable()
        steps.close()
        stats: Any = pstats.Stats(profiler)
    assert stats.total_calls / COUNTED <= most
