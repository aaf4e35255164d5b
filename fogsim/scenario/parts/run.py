"""From a scenario to the plain values that a run is made of; units of files become SI and radians in these parts."""

from fogsim.scenario.parts.clocks import periods
from fogsim.scenario.parts.methods import advice_config, controller_config, method
from fogsim.scenario.parts.script import script
from fogsim.scenario.parts.sensors import camera_config, reports_config, sensors_config
from fogsim.scenario.parts.traffic import traffic_setup
from fogsim.scenario.parts.world import world_config
from fogsim.scenario.schema import ScenarioFile
from fogsim.simulation.run_config import RunConfig


def run_config(scenario: ScenarioFile) -> RunConfig:
    """What a run is made of."""
    traffic = scenario.traffic
    return RunConfig(
        traffic=traffic_setup(scenario),
        world=world_config(scenario),
        camera=camera_config(scenario),
        sensors=sensors_config(scenario.sensors),
        reports=reports_config(scenario),
        estimators=tuple(method(scenario, one) for one in scenario.estimators),
        fusion=method(scenario, scenario.fusion),
        advice=advice_config(scenario),
        controller=controller_config(scenario),
        script=script(scenario),
        periods=periods(scenario),
        equipped_share=traffic.equipped,
        equipped_vehicles=traffic.equipped_vehicles,
        ends_on_collision=scenario.end_on_collision,
        stop_before_end=traffic.stop_before_end_m,
        along=traffic.along,
        cohort=traffic.cohort_s,
        name=scenario.name,
        description=scenario.description,
    )
