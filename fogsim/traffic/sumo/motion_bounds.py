"""How fast gaps and lines of sight between vehicles can change at most, so that nobody need look before."""

from fogsim.traffic.sumo.getters import Getter

HARDEST_CHANGE = 20.0
"""One vehicle's acceleration minus another's is never larger than this [m/s²]: emergency braking and driving off."""


class MotionBounds:
    """Bounds by the speeds that vehicles have, from now up to a horizon [s].

    Parameters
    ----------
    speed : Getter
        Speed of a vehicle [m/s].
    """

    def __init__(self, speed: Getter) -> None:
        self._speed = speed

    def closing(self, follower: str, leader: str, horizon: float) -> float:
        """How fast the gap between two vehicles changes at most [m/s]."""
        return abs(float(self._speed(leader)) - float(self._speed(follower))) + 0.5 * HARDEST_CHANGE * horizon

    def travel(self, follower: str, leader: str, horizon: float) -> float:
        """How fast both vehicles together move at most [m/s]."""
        return float(self._speed(follower)) + float(self._speed(leader)) + HARDEST_CHANGE * horizon
