"""FogSim: driving in fog, closed loop, from SUMO traffic over camera frames to speed advice and safety metrics."""

from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fogsim import estimators as estimators
    from fogsim.attached import attach as attach
    from fogsim.attached import connect as connect
    from fogsim.dataset import semantic_mask as semantic_mask
    from fogsim.dataset import transmission as transmission
    from fogsim.dataset import write_dataset as write_dataset
    from fogsim.loop import ClosedLoop as ClosedLoop
    from fogsim.loop import run as run
    from fogsim.scenario import Scenario as Scenario
    from fogsim.scenario import catalogue as catalogue
    from fogsim.scenario import load_scenario as load_scenario

from fogsim.errors import FogSimError, InputError, MissingDependencyError, SimulationError
from fogsim.values import Belief, Camera, Command, Estimate, Frame, LeadMeasurement, Observation, SignSighting, Step

__version__ = version("fogsim")

_LAZY = {
    "ClosedLoop": "fogsim.loop",
    "attach": "fogsim.attached",
    "connect": "fogsim.attached",
    "Scenario": "fogsim.scenario",
    "catalogue": "fogsim.scenario",
    "load_scenario": "fogsim.scenario",
    "run": "fogsim.loop",
    "semantic_mask": "fogsim.dataset",
    "transmission": "fogsim.dataset",
    "write_dataset": "fogsim.dataset",
}
"""Names that draw in heavier libraries, and the modules that they come from."""

__all__ = [
    "Belief",
    "Camera",
    "ClosedLoop",
    "Command",
    "Estimate",
    "FogSimError",
    "Frame",
    "InputError",
    "LeadMeasurement",
    "MissingDependencyError",
    "Observation",
    "Scenario",
    "SignSighting",
    "SimulationError",
    "Step",
    "attach",
    "catalogue",
    "connect",
    "estimators",
    "load_scenario",
    "run",
    "semantic_mask",
    "transmission",
    "write_dataset",
]


def __getattr__(name: str) -> Any:
    """Import what a public name needs when it is first asked for."""
    if name == "estimators":
        return import_module("fogsim.estimators")
    if name in _LAZY:
        return getattr(import_module(_LAZY[name]), name)
    raise AttributeError(f"module 'fogsim' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
