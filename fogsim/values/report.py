"""What others tell of the fog where they are."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class FogReport:
    """One measurement of the fog by another vehicle or by a sensor beside the road.

    Attributes
    ----------
    source : str
        Who has measured.
    number : int
        Which of the source's reports it is: a report that comes twice counts once.
    place : float
        Where, as a distance along the receiver's route [m].
    time : float
        When [s].
    extinction : float
        Extinction coefficient [1/m].
    relative_deviation : float
        Standard deviation of that relative to it, as the source tells it [-].
    """

    source: str
    number: int
    place: float
    time: float
    extinction: float
    relative_deviation: float
