"""Scenario files: schema, loading, catalogue, and building the stages from a scenario."""

from fogsim.scenario.loading import (
    attached_scenario,
    catalogue,
    load_scenario,
    override,
    scenario_from_config,
)
from fogsim.scenario.runnable import Scenario
from fogsim.scenario.written_form import resolved

__all__ = [
    "Scenario",
    "attached_scenario",
    "catalogue",
    "load_scenario",
    "override",
    "resolved",
    "scenario_from_config",
]
