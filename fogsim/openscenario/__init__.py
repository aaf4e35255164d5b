"""ASAM OpenSCENARIO XML 1.x: files as FogSim scenarios, played in its own language."""

from fogsim.openscenario.distributions import read_parameter_cases
from fogsim.openscenario.reading import ScenarioData, is_openscenario, read_openscenario

__all__ = ["ScenarioData", "is_openscenario", "read_openscenario", "read_parameter_cases"]
