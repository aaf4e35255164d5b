"""Runs: the closed loop and what rides in vehicles, traffic alone, the plug-in, and their recording.

They are made of plain values in SI units and radians, which a scenario or a program makes.
"""

from fogsim.atmosphere import FogConfig
from fogsim.camera import CameraConfig
from fogsim.core.registry import MethodConfig
from fogsim.simulation.run_config import AdviceConfig, Periods, RunConfig, WorldConfig
from fogsim.traffic import TrafficSetup

__all__ = [
    "AdviceConfig",
    "CameraConfig",
    "FogConfig",
    "MethodConfig",
    "Periods",
    "RunConfig",
    "TrafficSetup",
    "WorldConfig",
]
