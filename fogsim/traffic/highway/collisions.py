"""Collisions in highway-env, each pair once; the library marks who has crashed, but not with whom or how fast."""

import itertools
import math
from collections.abc import Iterator
from typing import Any

from highway_env.utils import are_polygons_intersecting

from fogsim.linear_algebra import matrix_product
from fogsim.traffic.highway.fleet import Fleet
from fogsim.values import Collision


class CollisionWatch:
    """Looks after every simulation step, by the library's own rule, who has hit whom.

    Parameters
    ----------
    fleet : Fleet
        The vehicles.
    """

    def __init__(self, fleet: Fleet) -> None:
        self._fleet = fleet
        self._known: set[frozenset[str]] = set()
        self._untold: list[Collision] = []

    def look(self, period: float) -> None:
        """Take in the last simulation step.

        Parameters
        ----------
        period : float
            Length of a step [s]: the library counts as hit who would be in the next one, and so does this.
        """
        name = self._fleet.name
        for one, other in _hits(self._fleet.environment.road, period):
            pair = frozenset((name(one), name(other)))
            if pair not in self._known:
                self._known.add(pair)
                collider, victim = (one, other) if _approach(one, other) >= _approach(other, one) else (other, one)
                impact = math.dist(one.velocity, other.velocity)
                self._untold.append(Collision(self._fleet.time, name(collider), name(victim), impact))

    def tell(self) -> tuple[Collision, ...]:
        """Collisions that have not been told yet."""
        told = tuple(self._untold)
        self._untold.clear()
        return told


def _hits(road: Any, period: float) -> Iterator[tuple[Any, Any]]:
    solid = [v for v in road.vehicles if v.collidable and v.solid]
    obstacles = [o for o in road.objects if o.collidable and o.solid]
    for one, other in itertools.chain(itertools.combinations(solid, 2), itertools.product(solid, obstacles)):
        reach = 0.5 * (one.diagonal + other.diagonal) + abs(one.speed) * period
        if math.dist(one.position, other.position) > reach or not (one.check_collisions or other.check_collisions):
            continue
        now, soon, _ = are_polygons_intersecting(
            one.polygon(), other.polygon(), one.velocity * period, other.velocity * period
        )
        if now or soon:
            yield one, other


def _approach(one: Any, other: Any) -> float:
    """How fast one moves towards the other, times their distance."""
    return float(matrix_product(one.velocity, other.position - one.position))
