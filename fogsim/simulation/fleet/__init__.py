"""Other vehicles than the ego that have a camera, estimators, a belief and lamps of their own."""

from fogsim.simulation.fleet.camera_messages import camera_messages
from fogsim.simulation.fleet.equipped_fleet import EquippedFleet

__all__ = ["EquippedFleet", "camera_messages"]
