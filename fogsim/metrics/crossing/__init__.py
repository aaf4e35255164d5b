"""Vehicles whose ways cross in a junction: where they were, where their ways cross, and how much time was between."""

from fogsim.metrics.crossing.traffic_encroachment import TrafficEncroachment

__all__ = ["TrafficEncroachment"]
