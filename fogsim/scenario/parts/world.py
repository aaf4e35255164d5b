"""From a scenario to its fog, light, and what is drawn."""

from fogsim.atmosphere import airlight_from_illuminance
from fogsim.scenario.fog import fog_config
from fogsim.scenario.schema import ScenarioFile
from fogsim.scenario.timeline import light_range, scripted_fog
from fogsim.simulation.run_config import WorldConfig
from fogsim.values import Pavement


def world_config(scenario: ScenarioFile) -> WorldConfig:
    """Fog, light, and what is drawn."""
    illuminance, pavement = scenario.light.illuminance_lx, scenario.pavement
    airlight = airlight_from_illuminance(illuminance, scenario.fog.airlight_share)
    return WorldConfig(
        fog=scripted_fog(scenario.timeline, fog_config(scenario.fog, airlight, scenario.camera.mount_height_m or 0.0)),
        illuminance=illuminance,
        darkest=light_range(scenario.timeline, illuminance)[0],
        renderer=scenario.renderer,
        has_street_lamps=scenario.street_lamps,
        scenery_seed=scenario.scenery_seed,
        pavement=Pavement(pavement.surface, pavement.wheel_tracks, pavement.repairs),
    )
