"""Signals of vehicles by their ids, X and Y: motion, lamps, and the distances and times between two of them."""

import math
from collections.abc import Callable
from dataclasses import replace

from fogsim.conditions.moment import Body, Moment, body_of, clearance
from fogsim.conditions.route_places import Extent, gap_between, headway_between, time_to_meet
from fogsim.conditions.signal import Kind, LanePlace, Need, Place, Signal, length_signal, speed_signal
from fogsim.units import KMH_PER_MPS
from fogsim.units.quantities import parse_quantity
from fogsim.values import Estimate, Lamp

_FASTEST = 500.0 / KMH_PER_MPS
"""No vehicle drives faster [m/s]."""

_HARDEST = 100.0
"""Limit of accelerations, collisions included [m/s²]."""

LAMP_WORDS = tuple(str(lamp.name).lower() for lamp in Lamp if lamp)
"""Lamps by their words."""

_VEHICLE, _PAIR = (Place.VEHICLE,), (Place.VEHICLE, Place.VEHICLE)
_PAIR_AND_LENGTH = (*_PAIR, Place.LENGTH)
_ROUTE = frozenset({Need.ROUTE})


def _of_vehicle(read: Callable[[Moment, int], float]) -> Callable[[Moment, str], float | None]:
    """Signal of a vehicle that is on the road."""

    def value(moment: Moment, vehicle: str) -> float | None:
        row = moment.row(vehicle)
        return None if row is None else read(moment, row)

    return value


def _of_pair(between: Callable[[Extent, Extent], float]) -> Callable[[Moment, str, str], float | None]:
    """Signal of two vehicles with positions along the route."""

    def value(moment: Moment, one: str, other: str) -> float | None:
        first, second = moment.extent(one), moment.extent(other)
        return None if first is None or second is None else between(first, second)

    return value


def _ahead(time: Callable[[Extent, Extent], float]) -> Callable[[Moment, str, str, str], float | None]:
    """Time between one vehicle and another ahead of it, with a gap that is longer by a length."""

    def value(moment: Moment, one: str, other: str, length: str) -> float | None:
        first, second = moment.extent(one), moment.extent(other)
        further = parse_quantity(length, "m")
        if first is None or second is None or second.begin + further <= first.end:
            return None
        shifted = replace(second, begin=second.begin + further, end=second.end + further)
        found = time(first, shifted)
        return None if math.isinf(found) else found

    return value


def _speed_difference(moment: Moment, one: str, other: str) -> float | None:
    first, second = moment.row(one), moment.row(other)
    if first is None or second is None:
        return None
    return float(moment.traffic.speed[first] - moment.traffic.speed[second])


def lit_lamps(moment: Moment, vehicle: str) -> frozenset[str] | None:
    """Lamps of a vehicle that are lit, by their words; None if it is not on the road."""
    row = moment.row(vehicle)
    if row is None:
        return None
    lit = Lamp(int(moment.traffic.lamps[row]))
    return frozenset(str(lamp.name).lower() for lamp in lit)


def _lane(moment: Moment, vehicle: str) -> LanePlace | None:
    row = moment.row(vehicle)
    if row is None:
        return None
    lane = moment.traffic.lane[row]
    edge, _, number = lane.rpartition("_")
    lanes = moment.step.truth.carriageways.get(edge, ())
    if lane in lanes:
        return LanePlace(lanes.index(lane), len(lanes))
    return LanePlace(int(number), None) if number.isdecimal() else None


def _heard(moment: Moment, row: int) -> float:
    heard = moment.traffic.advised_speed
    return float(heard[row]) if len(heard) else math.inf


def _seen(moment: Moment, row: int) -> float:
    seen = moment.step.truth.vehicle_extinctions
    return math.nan if seen is None or row >= len(seen) else _visibility(float(seen[row]))


def _visibility(extinction: float) -> float:
    return Estimate("", extinction, 0.0).visibility


def _has_collided(moment: Moment, vehicle: str) -> bool:
    name = moment.vehicle_id(vehicle)
    return any(name in pair for pair in moment.collisions)


def _have_collided(moment: Moment, one: str, other: str) -> bool:
    names = moment.vehicle_id(one), moment.vehicle_id(other)
    return names in moment.collisions or names[::-1] in moment.collisions


def _body(moment: Moment, vehicle: str) -> Body | None:
    row = moment.row(vehicle)
    return None if row is None else body_of(moment.traffic, row)


def _straight_distance(
    moment: Moment, one: str, other: str, behind: str = "0 m", other_behind: str = "0 m"
) -> float | None:
    first, second = _body(moment, one), _body(moment, other)
    if first is None or second is None:
        return None
    return math.dist(first.behind(parse_quantity(behind, "m")), second.behind(parse_quantity(other_behind, "m")))


def _distance_along(moment: Moment, one: str, other: str, behind: str, other_behind: str) -> float | None:
    first, second = moment.place(one), moment.place(other)
    if first is None or second is None:
        return None
    at = first.front - parse_quantity(behind, "m") * first.along
    signed = second.front - parse_quantity(other_behind, "m") * second.along - at
    return moment.nearest((one, other, behind, other_behind), signed)


def _distance_to(moment: Moment, vehicle: str, behind: str, x: str, y: str) -> float | None:
    if (body := _body(moment, vehicle)) is None:
        return None
    return math.dist(body.behind(parse_quantity(behind, "m")), (parse_quantity(x, "m"), parse_quantity(y, "m")))


def _nearest_to(moment: Moment, vehicle: str, behind: str, x: str, y: str) -> float | None:
    return moment.nearest_to(vehicle, parse_quantity(behind, "m"), (parse_quantity(x, "m"), parse_quantity(y, "m")))


def _clearance(moment: Moment, one: str, other: str) -> float | None:
    first, second = _body(moment, one), _body(moment, other)
    return None if first is None or second is None else clearance(first, second)


OF_VEHICLES = {
    "X.present": Signal(
        "whether a vehicle is on the road, and near enough to the ego to be read",
        lambda m, x: m.row(x) is not None,
        Kind.FLAG,
        places=_VEHICLE,
    ),
    "X.speed": speed_signal(
        "speed", _of_vehicle(lambda m, i: float(m.traffic.speed[i])), most=_FASTEST, places=_VEHICLE
    ),
    "X.acceleration": Signal(
        "acceleration along the heading",
        _of_vehicle(lambda m, i: float(m.traffic.acceleration[i])),
        unit="m/s^2",
        least=-_HARDEST,
        most=_HARDEST,
        places=_VEHICLE,
    ),
    "X.position": Signal(
        "position of the front bumper along the ego's route, or along `traffic.along`; no value 30 m off it",
        lambda m, x: m.position(x),
        unit="m",
        places=_VEHICLE,
        needs=_ROUTE,
    ),
    "X.driven": length_signal(
        "distance that a vehicle has driven since the run began, or since it came onto the road",
        lambda m, x: m.driven(x),
        places=_VEHICLE,
    ),
    "X.lane": Signal(
        "lane counted from the right, from 0; or `right` and `left`, the outermost ones (in left-hand traffic the "
        "other way round)",
        _lane,
        Kind.LANE,
        least=0.0,
        words=("right", "left"),
        places=_VEHICLE,
    ),
    "X.lamps": Signal("lamps that are lit", lit_lamps, Kind.WORDS, words=LAMP_WORDS, places=_VEHICLE),
    "X.advice": speed_signal(
        "lowest speed in force that the driver has heard advised; inf for none", _of_vehicle(_heard), places=_VEHICLE
    ),
    "X.visibility": length_signal("true visibility at the driver's eyes", _of_vehicle(_seen), places=_VEHICLE),
    "X.collision": Signal("whether it has collided so far", _has_collided, Kind.FLAG, places=_VEHICLE),
    "collision(X, Y)": Signal("whether they have collided so far", _have_collided, Kind.FLAG, places=_PAIR),
    "gap(X, Y)": length_signal(
        "gap from X to Y along the route, bumper to bumper, whatever the lane: positive if Y is ahead, negative if it "
        "is behind, 0 if they overlap",
        _of_pair(gap_between),
        least=-math.inf,
        places=_PAIR,
        needs=_ROUTE,
    ),
    "distance(X, Y)": length_signal("straight distance between the front bumpers", _straight_distance, places=_PAIR),
    "distance(X, Y, LENGTH, LENGTH)": length_signal(
        "straight distance between the points that are a length behind each one's front bumper",
        _straight_distance,
        places=(*_PAIR_AND_LENGTH, Place.LENGTH),
    ),
    "distance_along(X, Y, LENGTH, LENGTH)": length_signal(
        "the distance between these points along the route, in any lanes; 0 if they have passed since the step before",
        _distance_along,
        places=(*_PAIR_AND_LENGTH, Place.LENGTH),
        needs=_ROUTE,
    ),
    "distance_to(X, LENGTH, LENGTH, LENGTH)": length_signal(
        "straight distance between the point that is a length behind X's front bumper and the place x, y of the map",
        _distance_to,
        places=(Place.VEHICLE, *[Place.LENGTH] * 3),
    ),
    "nearest_to(X, LENGTH, LENGTH, LENGTH)": length_signal(
        "the least such distance since the step before",
        _nearest_to,
        places=(Place.VEHICLE, *[Place.LENGTH] * 3),
    ),
    "clearance(X, Y)": length_signal(
        "straight distance between the bodies, 0 where they touch", _clearance, places=_PAIR
    ),
    "ttc(X, Y)": Signal(
        "time until X and Y are side by side at constant speeds, whatever the lane: inf if they do not approach",
        _of_pair(time_to_meet),
        unit="s",
        least=0.0,
        places=_PAIR,
        needs=_ROUTE,
    ),
    "headway(X, Y)": Signal(
        "time that the hind one of X and Y takes for the gap at its speed, whatever the lane: inf if it stands",
        _of_pair(headway_between),
        unit="s",
        least=0.0,
        places=_PAIR,
        needs=_ROUTE,
    ),
    "speed_difference(X, Y)": Signal(
        "how much faster X is than Y",
        _speed_difference,
        unit="m/s",
        shown_unit="km/h",
        least=-_FASTEST,
        most=_FASTEST,
        places=_PAIR,
    ),
    "headway(X, Y, LENGTH)": Signal(
        "time that X takes at its speed for the gap to Y and a length (`0 m`, or what lies between the bumpers and the "
        "points that a distance counts from); no value unless Y is ahead and X drives",
        _ahead(headway_between),
        unit="s",
        least=0.0,
        places=_PAIR_AND_LENGTH,
        needs=_ROUTE,
    ),
    "ttc(X, Y, LENGTH)": Signal(
        "time in which X drives the gap to Y and a length at constant speeds; no value unless Y is ahead and they "
        "approach",
        _ahead(time_to_meet),
        unit="s",
        least=0.0,
        places=_PAIR_AND_LENGTH,
        needs=_ROUTE,
    ),
}
"""By names with the arguments X, Y and LENGTH."""
