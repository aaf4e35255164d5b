"""From a scenario to the parts of the loop; here the units of scenario files become SI and radians, once."""

from fogsim.scenario.parts.clocks import Periods, periods
from fogsim.scenario.parts.fog import fog_field, fog_of_run
from fogsim.scenario.parts.methods import (
    adviser,
    check_ego,
    check_frames,
    estimators,
    fusion,
    lighting_policy,
    own_methods,
    road_adviser,
    safety_standard,
)
from fogsim.scenario.parts.pavement import pavement
from fogsim.scenario.parts.sensors import (
    AIRLIGHT_EXPOSURE,
    CAR,
    METERED_PERCENT,
    assumed_camera,
    auto_exposure,
    body_pitch,
    camera,
    camera_mount,
    camera_sensor,
    gps,
    lead_sensor,
    roadside_scenario,
    scatterometer,
    sensor,
)
from fogsim.scenario.parts.traffic import traffic_setup

__all__ = [
    "AIRLIGHT_EXPOSURE",
    "CAR",
    "METERED_PERCENT",
    "Periods",
    "adviser",
    "assumed_camera",
    "auto_exposure",
    "body_pitch",
    "camera",
    "camera_mount",
    "camera_sensor",
    "check_ego",
    "check_frames",
    "estimators",
    "fog_field",
    "fog_of_run",
    "fusion",
    "gps",
    "lead_sensor",
    "lighting_policy",
    "own_methods",
    "pavement",
    "periods",
    "road_adviser",
    "roadside_scenario",
    "safety_standard",
    "scatterometer",
    "sensor",
    "traffic_setup",
]
