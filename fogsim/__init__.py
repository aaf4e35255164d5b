"""FogSim: driving in fog, closed loop, from SUMO traffic over camera frames to speed advice and safety metrics."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fogsim import estimators as estimators
    from fogsim.dataset import semantic_mask as semantic_mask
    from fogsim.dataset import transmission as transmission
    from fogsim.dataset import write_dataset as write_dataset
    from fogsim.errors import FogSimError as FogSimError
    from fogsim.errors import InputError as InputError
    from fogsim.errors import MissingDependencyError as MissingDependencyError
    from fogsim.errors import SimulationError as SimulationError
    from fogsim.errors import UnplayedWarning as UnplayedWarning
    from fogsim.scenario import Scenario as Scenario
    from fogsim.scenario import catalogue as catalogue
    from fogsim.scenario import load_scenario as load_scenario
    from fogsim.scenario.attaching import attach as attach
    from fogsim.scenario.attaching import connect as connect
    from fogsim.simulation.loop import ClosedLoop as ClosedLoop
    from fogsim.simulation.loop import run as run
    from fogsim.simulation.traffic_run import run_traffic as run_traffic
    from fogsim.values import Belief as Belief
    from fogsim.values import Camera as Camera
    from fogsim.values import Command as Command
    from fogsim.values import Display as Display
    from fogsim.values import DriverWarning as DriverWarning
    from fogsim.values import Estimate as Estimate
    from fogsim.values import Frame as Frame
    from fogsim.values import LampChoice as LampChoice
    from fogsim.values import LampWish as LampWish
    from fogsim.values import LeadMeasurement as LeadMeasurement
    from fogsim.values import LightMeasurement as LightMeasurement
    from fogsim.values import Observation as Observation
    from fogsim.values import SecondView as SecondView
    from fogsim.values import SignSighting as SignSighting
    from fogsim.values import SpeedAdvice as SpeedAdvice
    from fogsim.values import Step as Step
    from fogsim.values import Stretch as Stretch
    from fogsim.values import StretchAdvice as StretchAdvice
    from fogsim.values import TrafficStep as TrafficStep

    __version__: str

_ERRORS = ("FogSimError", "InputError", "MissingDependencyError", "SimulationError", "UnplayedWarning")
_VALUES = (
    "Belief",
    "Camera",
    "Command",
    "Display",
    "DriverWarning",
    "Estimate",
    "Frame",
    "LampChoice",
    "LampWish",
    "LeadMeasurement",
    "LightMeasurement",
    "Observation",
    "SecondView",
    "SignSighting",
    "SpeedAdvice",
    "Step",
    "Stretch",
    "StretchAdvice",
    "TrafficStep",
)
_LAZY = {
    **dict.fromkeys(_ERRORS, "fogsim.errors"),
    **dict.fromkeys(_VALUES, "fogsim.values"),
    "ClosedLoop": "fogsim.simulation.loop",
    "attach": "fogsim.scenario.attaching",
    "connect": "fogsim.scenario.attaching",
    "Scenario": "fogsim.scenario",
    "catalogue": "fogsim.scenario",
    "load_scenario": "fogsim.scenario",
    "run": "fogsim.simulation.loop",
    "run_traffic": "fogsim.simulation.traffic_run",
    "semantic_mask": "fogsim.dataset",
    "transmission": "fogsim.dataset",
    "write_dataset": "fogsim.dataset",
}
"""Names that draw in other libraries, and the modules that they come from: a signal that comes while they are imported
must find the command line prepared for it."""

__all__ = [
    "Belief",
    "Camera",
    "ClosedLoop",
    "Command",
    "Display",
    "DriverWarning",
    "Estimate",
    "FogSimError",
    "Frame",
    "InputError",
    "LampChoice",
    "LampWish",
    "LeadMeasurement",
    "LightMeasurement",
    "MissingDependencyError",
    "Observation",
    "Scenario",
    "SecondView",
    "SignSighting",
    "SimulationError",
    "SpeedAdvice",
    "Step",
    "Stretch",
    "StretchAdvice",
    "TrafficStep",
    "attach",
    "catalogue",
    "connect",
    "estimators",
    "load_scenario",
    "run",
    "run_traffic",
    "semantic_mask",
    "transmission",
    "write_dataset",
]


def __getattr__(name: str) -> Any:
    """Import what a public name needs when it is first asked for."""
    if name == "estimators":
        return import_module("fogsim.estimators")
    if name == "__version__":
        return import_module("importlib.metadata").version("fogsim")
    if name in _LAZY:
        return getattr(import_module(_LAZY[name]), name)
    raise AttributeError(f"module 'fogsim' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
