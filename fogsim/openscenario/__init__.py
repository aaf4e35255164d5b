"""ASAM OpenSCENARIO XML 1.x: files as scenarios of FogSim, whose own language then plays them."""

from fogsim.openscenario.reading import ScenarioData, is_openscenario, read_openscenario

__all__ = ["ScenarioData", "is_openscenario", "read_openscenario"]
