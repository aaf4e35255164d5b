"""Where every vehicle is, how it moves and how it obeys advice."""

from fogsim.traffic.protocol import Traffic
from fogsim.traffic.setup import BrakeEvent, TrafficSetup

__all__ = ["BrakeEvent", "Traffic", "TrafficSetup"]
