"""A finished step as conditions see it: with earlier events, and positions along the route."""

import functools
import math
from collections.abc import Iterator
from dataclasses import dataclass, field

from fogsim.conditions.route_places import Extent, Route, RoutePlace, extent_of
from fogsim.values import Step, TrafficState, TrafficStep
from fogsim.values.traffic import with_persons


@dataclass(frozen=True, slots=True)
class Body:
    """A rectangle: middle of its front [m], heading [rad], length and width [m]."""

    x: float
    y: float
    heading: float
    length: float
    width: float

    def behind(self, distance: float, left: float = 0.0) -> tuple[float, float]:
        """The point so far behind the front and to the left [m]."""
        cosine, sine = math.cos(self.heading), math.sin(self.heading)
        return self.x - distance * cosine - left * sine, self.y - distance * sine + left * cosine

    def corners(self) -> list[tuple[float, float]]:
        """Its corners [m]."""
        return [self.behind(back, side * self.width) for back in (0.0, self.length) for side in (-0.5, 0.5)]

    def beyond(self, point: tuple[float, float]) -> Iterator[float]:
        """How far a point is before the front, behind the rear, to the left and to the right of it [m]."""
        x, y = point[0] - self.x, point[1] - self.y
        ahead = x * math.cos(self.heading) + y * math.sin(self.heading)
        left = y * math.cos(self.heading) - x * math.sin(self.heading)
        yield from (ahead, -ahead - self.length, left - 0.5 * self.width, -left - 0.5 * self.width)


def body_of(traffic: TrafficState, row: int) -> Body:
    """Body of the vehicle in a row."""
    x, y = traffic.position[row, :2].tolist()
    return Body(x, y, float(traffic.heading[row]), float(traffic.length[row]), float(traffic.width[row]))


def clearance(one: Body, other: Body) -> float:
    """Straight distance between two bodies, 0 where they overlap [m]."""
    nearest, is_apart = math.inf, False
    for body, corners in ((one, other.corners()), (other, one.corners())):
        beyond = [list(body.beyond(corner)) for corner in corners]
        # They are apart if all corners of one lie beyond a side of the other.
        is_apart |= any(min(side) > 0.0 for side in zip(*beyond, strict=True))
        nearest = min(nearest, *(math.hypot(max(f, r, 0.0), max(le, ri, 0.0)) for f, r, le, ri in beyond))
    return nearest if is_apart else 0.0


EGO = "ego"
"""Name of the ego in conditions, whatever its id."""

Point = tuple[float, float]

_FARTHEST_STEP = 50.0  # Farthest that vehicles come in a step [m]; positions along a closed route jump farther


@dataclass(frozen=True, slots=True)
class _Memory:
    """What moments have of earlier ones."""

    # x, y [m] and distance so far [m], by vehicle
    driven: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    # Time of the latest step [s], and distances in it and in the one before [m], by pair of points
    signed: dict[tuple[str, ...], tuple[float, float, float]] = field(default_factory=dict)
    # Time of the latest step [s], and places in it and in the one before [m], by point of a vehicle
    points: dict[tuple[str, float], tuple[float, Point, Point]] = field(default_factory=dict)


class Moment:
    """One step of a run, with the collided pairs and begun and ended entries so far; positions count along `route`."""

    def __init__(
        self,
        step: TrafficStep,
        collisions: set[tuple[str, str]],
        begun: set[str],
        ended: set[str],
        route: Route | None,
        memory: _Memory,
    ) -> None:
        self.step, self.collisions, self.begun, self.ended = step, collisions, begun, ended
        self._route, self._memory = route, memory
        self._places: dict[str, RoutePlace | None] = {}
        self._by_row: dict[int, RoutePlace | None] = {}

    @property
    def ego_step(self) -> Step | None:
        """The step if there is an ego; None otherwise."""
        return self.step if isinstance(self.step, Step) else None

    @functools.cached_property
    def traffic(self) -> TrafficState:
        """The traffic, with persons on foot behind the vehicles."""
        return with_persons(self.step.traffic)

    def vehicle_id(self, vehicle: str) -> str:
        """Id of a vehicle as conditions name it: the ego's own id for ``ego``."""
        step = self.ego_step
        return step.traffic.ids[step.ego] if step is not None and vehicle == EGO else vehicle

    def row(self, vehicle: str) -> int | None:
        """Row of a vehicle or person in `traffic`; None if it is not on the road now."""
        name = self.vehicle_id(vehicle)
        row = self.step.traffic.row(name)
        return self.traffic.row(name) if row is None and self.step.traffic.persons.ids else row

    def position(self, vehicle: str) -> float | None:
        """Position of a vehicle's front bumper along the route [m], in the ego's count; None if it is not on it."""
        step = self.ego_step
        if step is not None and self.row(vehicle) == step.ego:
            return step.route_position
        place = self.place(vehicle)
        return None if place is None else place.front

    def driven(self, vehicle: str) -> float | None:
        """Distance that a vehicle has driven since it was first asked for [m]; None off the road."""
        row = self.row(vehicle)
        if row is None:
            return None
        x, y = map(float, self.traffic.position[row, :2])
        last_x, last_y, so_far = self._memory.driven.get(vehicle, (x, y, 0.0))
        so_far += math.dist((x, y), (last_x, last_y))
        self._memory.driven[vehicle] = x, y, so_far
        return so_far

    def nearest(self, pair: tuple[str, ...], signed: float) -> float:
        """Least distance since the step before [m]: the present one without its sign, or 0 if the sign has changed."""
        time, now, before = self._memory.signed.get(pair, (-math.inf, signed, signed))
        before = before if time == self.step.time else now
        self._memory.signed[pair] = self.step.time, signed, before
        is_passed = before * signed < 0.0 and abs(before) + abs(signed) < _FARTHEST_STEP
        return 0.0 if is_passed else abs(signed)

    def nearest_to(self, vehicle: str, behind: float, place: Point) -> float | None:
        """Least distance of a vehicle's point from a place since the step before [m]; None if it is not on the road."""
        row = self.row(vehicle)
        if row is None:
            return None
        now = body_of(self.traffic, row).behind(behind)
        time, last, before = self._memory.points.get((vehicle, behind), (-math.inf, now, now))
        before = before if time == self.step.time else last
        self._memory.points[vehicle, behind] = self.step.time, now, before
        x, y = now[0] - before[0], now[1] - before[1]
        if (length := math.hypot(x, y)) == 0.0 or length > _FARTHEST_STEP:
            return math.dist(now, place)
        along = ((place[0] - before[0]) * x + (place[1] - before[1]) * y) / length**2
        along = min(max(along, 0.0), 1.0)
        return math.dist((before[0] + along * x, before[1] + along * y), place)

    def extent(self, vehicle: str) -> Extent | None:
        """The part of the route that a vehicle covers; None if it is not on it."""
        row, place = self.row(vehicle), self.place(vehicle)
        return None if row is None or place is None else extent_of(place, self.traffic, row)

    def curvature(self, vehicle: str) -> float | None:
        """Curvature of the route at a vehicle [1/m]; None if it is not on it."""
        row, route = self.row(vehicle), self._route
        place = None if row is None or route is None else self._on_route(route, row)
        return None if route is None or place is None else route.curvature(place.front)

    def place(self, vehicle: str) -> RoutePlace | None:
        """Place of a vehicle's front bumper along the route; None if it is not on it."""
        if vehicle not in self._places:
            self._places[vehicle] = self._located(vehicle)
        return self._places[vehicle]

    def _located(self, vehicle: str) -> RoutePlace | None:
        row, step = self.row(vehicle), self.ego_step
        if row is None or self._route is None:
            return None
        place = self._on_route(self._route, row)
        if step is None or place is None:
            return place
        # SUMO counts the ego's position along its lanes, the polyline along one: convert others to SUMO's count.
        ego = self._on_route(self._route, step.ego)
        return None if ego is None else RoutePlace(place.front - ego.front + step.route_position, place.along)

    def _on_route(self, route: Route, row: int) -> RoutePlace | None:
        """Position of a vehicle along the polyline."""
        if row not in self._by_row:
            traffic, step = self.traffic, self.ego_step
            near = None if step is None else step.route_position
            self._by_row[row] = route.locate(traffic.position[row], float(traffic.heading[row]), near)
        return self._by_row[row]


class History:
    """Shared memory of a run's conditions, which creates one moment per step."""

    def __init__(self) -> None:
        self._collisions: set[tuple[str, str]] = set()
        self._begun: set[str] = set()
        self._ended: set[str] = set()
        self._route: Route | None = None
        self._memory = _Memory()

    def moment(self, step: TrafficStep) -> Moment:
        """Add the next step and return its moment."""
        self._collisions |= {(hit.collider, hit.victim) for hit in step.collisions}
        for one in step.begun:
            (self._ended if one.is_over else self._begun).update((one.name, one.key))
        points = step.truth.route
        if points is not None and len(points) > 1 and (self._route is None or self._route.points is not points):
            self._route = Route(points)
        return Moment(step, self._collisions, self._begun, self._ended, self._route, self._memory)
