"""Airlight as photons have it, and what daytime methods make of it."""

from fogsim.reproduce.airlight.evaluation import CHASE_METHODS, ROAD_METHODS, Plan, reproduce

__all__ = ["CHASE_METHODS", "ROAD_METHODS", "Plan", "reproduce"]
