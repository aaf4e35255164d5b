"""Collisions in highway-env; the library marks who has crashed, but not with whom or how fast."""

import itertools
import math
from collections.abc import Iterator
from typing import Any

from highway_env.utils import are_polygons_intersecting

from fogsim.core.linear_algebra import matrix_product
from fogsim.traffic.highway.fleet import Fleet
from fogsim.values import Collision


def find_collisions(fleet: Fleet, period: float) -> Iterator[Collision]:
    """Collisions of the last simulation step by the library's own rule; they are found in later steps again.

    Takes `period` [s].
    """
    for one, other in _hits(fleet.environment.road, period):
        collider, victim = fleet.name(one), fleet.name(other)
        if _approach(one, other) < _approach(other, one):
            collider, victim = victim, collider
        yield Collision(fleet.time, collider, victim, math.dist(one.velocity, other.velocity))


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
    """Component of one's velocity towards the other, times their distance."""
    return float(matrix_product(one.velocity, other.position - one.position))
