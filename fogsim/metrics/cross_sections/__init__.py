"""Vehicles that pass cross sections of a road."""

from fogsim.metrics.cross_sections.traffic_throughput import TrafficThroughput

__all__ = ["TrafficThroughput"]
