"""Scenario files: schema, loading, catalogue, and building the stages from a scenario."""

from fogsim.scenario.loading import load_scenario, override, resolved
from fogsim.scenario.locating import catalogue
from fogsim.scenario.schema import Scenario

__all__ = ["Scenario", "catalogue", "load_scenario", "override", "resolved"]
