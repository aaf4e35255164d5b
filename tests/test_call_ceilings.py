"""Function calls a frame: a measure of the loop's own cost that the machine's load does not disturb."""

import cProfile
import pstats
from itertools import islice
from typing import Any

import pytest
from early_motorway import EARLY

import fogsim

CEILINGS = {
    "demo": ("motorway_fog_bank", [EARLY], 2110),
    "negru2013": ("motorway_fog_bank", [EARLY, "estimators=[negru2013]"], 1200),
    "city": ("city_fog", [], 3750),
    "night": ("night_motorway_fog", [], 3230),
    "patches of fog": ("patchy_fog", [], 4300),
}
"""Scenario, settings, and most calls a frame of Python's and C's functions, a few per cent above what it takes."""

SKIPPED, WINDOWS, COUNTED = 10, 2, 10
"""Frames before the first of some windows, and frames in each: as many as between two decisions."""

SMALL = ["camera.width=160", "camera.height=120"]


@pytest.mark.parametrize("name", CEILINGS)
def test_frames_take_few_calls(name: str) -> None:
    scenario, settings, most = CEILINGS[name]
    steps = fogsim.run(fogsim.load_scenario(scenario, [*SMALL, *settings]), seed=1)
    next(islice(steps, SKIPPED - 1, None))
    calls = []
    for profiler in (cProfile.Profile() for _ in range(WINDOWS)):
        profiler.enable()
        assert sum(1 for _ in islice(steps, COUNTED)) == COUNTED
        profiler.disable()
        stats: Any = pstats.Stats(profiler)
        calls.append(stats.total_calls / COUNTED)
    steps.close()
    # What a process does once, such as loading kernels, is done in one window or another.
    assert min(calls) <= most
