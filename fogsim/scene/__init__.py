"""Road, markings, signs, vehicles and roadside as plain geometry and materials."""

from fogsim.scene.build import ScenePlan, build_scene
from fogsim.scene.ground import Squares
from fogsim.scene.lamps.road_beams import road_beams
from fogsim.scene.light_sources import light_sources, street_lamp_heads, street_lighting
from fogsim.scene.signs import SIGN_KINDS
from fogsim.scene.solids import merge
from fogsim.scene.surroundings import Corridor, Nearness, surroundings
from fogsim.scene.vehicles import traffic_batches, vehicle_batches

__all__ = [
    "SIGN_KINDS",
    "Corridor",
    "Nearness",
    "ScenePlan",
    "Squares",
    "build_scene",
    "light_sources",
    "merge",
    "road_beams",
    "street_lamp_heads",
    "street_lighting",
    "surroundings",
    "traffic_batches",
    "vehicle_batches",
]
