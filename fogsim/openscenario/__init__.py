"""ASAM OpenSCENARIO XML 1.x: files as FogSim scenarios, played in its own language."""

from fogsim.openscenario.reading import ScenarioData, is_openscenario, read_openscenario

__all__ = ["ScenarioData", "is_openscenario", "read_openscenario"]
