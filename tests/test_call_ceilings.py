"""Function calls a frame: a measure of the loop's own cost that the machine's load does not disturb."""

import cProfile
import pstats
from itertools import islice
from typing import Any

import pytest

import fogsim

CEILINGS = {
    "demo": ("motorway_fog_bank", [], 1),
    "demo, 640x480": ("motorway_fog_bank", ["camera.width=640", "camera.height=480"], 1),
    "negru2013": ("motorway_fog_bank", ["estimators=[negru2013]"], 1),
    "city": ("city_fog", [], 1),
    "night": ("night_motorway_fog", [], 1),
    "patches of fog": ("patchy_fog", [], 1),
}
"""Scenario, settings, and most calls a frame of Python's and C's functions, about a tenth above what it takes."""

WARMING, COUNTED = 20, 60
SMALL = ["camera.width=160", "camera.height=120"]


@pytest.mark.parametrize("name", CEILINGS)
def test_frames_take_few_calls(name: str) -> None:
    scenario, settings, most = CEILINGS[name]
    steps = fogsim.run(fogsim.load_scenario(scenario, [*SMALL, *settings]), seed=1)
    next(islice(steps, WARMING, None))
    profiler = cProfile.Profile()
    profiler.enable()
    for _ in islice(steps, COUNTED):
        pass
    profiler.disable()
    steps.close()
    stats: Any = pstats.Stats(profiler)
    assert stats.total_calls / COUNTED <= most
