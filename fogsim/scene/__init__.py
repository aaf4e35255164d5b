"""Road, markings, signs, vehicles and roadside as plain geometry and materials."""

from fogsim.scene.build import build_scene
from fogsim.scene.vehicles import vehicle_batches

__all__ = ["build_scene", "vehicle_batches"]
