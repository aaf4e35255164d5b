"""The timeline of a scenario while it runs: finished steps go in, what begins in the next camera period comes out."""

from fogsim.simulation.timeline.triggering import Due, Timeline

__all__ = ["Due", "Timeline"]
