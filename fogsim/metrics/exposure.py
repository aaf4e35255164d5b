"""On how much driving rates are based."""

from dataclasses import dataclass

from fogsim.metrics.metric import Sample, share

HOUR = 3600.0
"""Seconds in an hour."""

KILOMETRE = 1000.0
"""Metres in a kilometre."""


@dataclass(slots=True)
class Exposure:
    """Time and way of all vehicles near the ego together.

    Attributes
    ----------
    time : float
        Vehicle-seconds [s].
    distance : float
        Vehicle-metres [m].
    """

    time: float = 0.0
    distance: float = 0.0

    def add(self, sample: Sample) -> None:
        """Take in one step.

        Parameters
        ----------
        sample : Sample
            The step.
        """
        speed = sample.step.traffic.speed
        self.time += len(speed) * sample.elapsed
        self.distance += float(speed.sum()) * sample.elapsed

    def per_hour(self, amount: float) -> float | None:
        """Amount per vehicle-hour; None without time.

        Parameters
        ----------
        amount : float
            Of anything.
        """
        return share(HOUR * amount, self.time)

    def per_kilometre(self, amount: float) -> float | None:
        """Amount per vehicle-kilometre; None without way.

        Parameters
        ----------
        amount : float
            Of anything.
        """
        return share(KILOMETRE * amount, self.distance)
