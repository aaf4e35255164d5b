"""From a scenario to what runs are made of; here the units of scenario files become SI and radians, once."""

from fogsim.scenario.parts.clocks import periods
from fogsim.scenario.parts.inputs import input_files
from fogsim.scenario.parts.methods import (
    advice_config,
    check_frames,
    method,
    own_methods,
    sections_config,
)
from fogsim.scenario.parts.run import run_config
from fogsim.scenario.parts.sensors import AIRLIGHT_EXPOSURE, METERED_PERCENT, camera_config, reports_config
from fogsim.scenario.parts.traffic import traffic_setup
from fogsim.scenario.parts.world import world_config

__all__ = [
    "AIRLIGHT_EXPOSURE",
    "METERED_PERCENT",
    "advice_config",
    "camera_config",
    "check_frames",
    "input_files",
    "method",
    "own_methods",
    "periods",
    "reports_config",
    "run_config",
    "sections_config",
    "traffic_setup",
    "world_config",
]
