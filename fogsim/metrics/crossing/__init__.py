"""Vehicles whose ways cross in a junction: where they were, where their ways cross, and how much time was between."""

from fogsim.metrics.crossing.encroachment import Encroachments, find_encroachments
from fogsim.metrics.crossing.tracks import Fronts, Junctions, Tracks, tracks_through

__all__ = ["Encroachments", "Fronts", "Junctions", "Tracks", "find_encroachments", "tracks_through"]
