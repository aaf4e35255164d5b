"""Road, markings, signs, vehicles and roadside as plain geometry and materials."""

from fogsim.scene.build import build_scene
from fogsim.scene.light_sources import light_sources, street_lighting
from fogsim.scene.signs import SIGN_KINDS
from fogsim.scene.street_lamps import street_lamp_heads
from fogsim.scene.surroundings import Corridor, Nearness, surroundings
from fogsim.scene.vehicles import vehicle_batches

__all__ = [
    "SIGN_KINDS",
    "Corridor",
    "Nearness",
    "build_scene",
    "light_sources",
    "street_lamp_heads",
    "street_lighting",
    "surroundings",
    "vehicle_batches",
]
