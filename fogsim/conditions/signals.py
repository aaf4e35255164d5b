"""All signals of conditions, by names with the arguments X, Y, METHOD and so on."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from fogsim.conditions.moment import Body, Moment, body_of, clearance
from fogsim.conditions.route_places import Extent, gap_between, headway_between, time_to_meet
from fogsim.conditions.signal import Kind, LanePlace, Need, Place, Signal
from fogsim.core.kinematics import DECELERATION, REACTION_TIME, stopping_sight_distance
from fogsim.core.registry import Registry
from fogsim.units import KMH_PER_MPS
from fogsim.units.quantities import parse_quantity
from fogsim.values import DriverWarning, Ending, Estimate, FogBank, Lamp, Leader, SignalAhead, SignalColour, Step

_FASTEST = 500.0 / KMH_PER_MPS
"""No vehicle drives faster [m/s]."""

_HARDEST = 100.0
"""Limit of accelerations, collisions included [m/s²]."""

NO_LEADER = "none"
"""Value of ``ego.leader`` without a vehicle ahead."""

_LAMP_WORDS = tuple(str(lamp.name).lower() for lamp in Lamp if lamp)
"""Lamps by their words."""

_NO_WARNING = "none"
"""Value of ``warning`` while the driver is warned of nothing."""

_ENDING_WORDS = tuple(ending.name.lower() for ending in Ending)
"""Endings of a run by their words."""

_Read = TypeVar("_Read", float, str)

_EGO, _FRAMES, _ROUTE = (frozenset({need}) for need in Need)


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


def _of_leader(read: Callable[[Leader, float], float]) -> Callable[[Moment], float | None]:
    """Signal of the ego and the vehicle ahead of it; inf without one."""

    def value(moment: Moment) -> float | None:
        step = moment.ego_step
        if step is None:
            return None
        return math.inf if step.leader is None else read(step.leader, float(step.traffic.speed[step.ego]))

    return value


def _of_step(read: Callable[[Step], _Read]) -> Callable[[Moment], _Read | None]:
    """Signal of a step with an ego."""
    return lambda moment: None if moment.ego_step is None else read(moment.ego_step)


def _of_belief(read: Callable[[Step], float | None]) -> Callable[[Moment], float | None]:
    """Signal of the belief; None without an estimate."""
    return lambda moment: read(moment.ego_step) if moment.ego_step is not None and moment.ego_step.estimates else None


def _lamps(moment: Moment, vehicle: str) -> frozenset[str] | None:
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
    beside = moment.step.truth.carriageways.get(edge, ())
    if lane in beside:
        return LanePlace(beside.index(lane), len(beside))
    return LanePlace(int(number), None) if number.isdecimal() else None


def _advice(moment: Moment) -> float:
    command = moment.step.command
    if moment.ego_step is not None:
        return command.advice.speed
    return min([command.advice.speed, *command.advised_speeds.values(), *(s.speed for s in command.stretches)])


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


def _time_to_collision(leader: Leader, speed: float) -> float:
    approach = speed - leader.speed
    return max(leader.gap, 0.0) / approach if approach > 0.0 else math.inf


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


def _distance_to(moment: Moment, vehicle: str, behind: str, x: str, y: str) -> float | None:
    if (body := _body(moment, vehicle)) is None:
        return None
    return math.dist(body.behind(parse_quantity(behind, "m")), (parse_quantity(x, "m"), parse_quantity(y, "m")))


def _clearance(moment: Moment, one: str, other: str) -> float | None:
    first, second = _body(moment, one), _body(moment, other)
    return None if first is None or second is None else clearance(first, second)


def _is_in_bank(moment: Moment, number: str, vehicle: str = "ego") -> bool | None:
    row, fog = moment.row(vehicle), moment.step.truth.fog
    if row is None or fog is None or int(number) >= len(fog.banks):
        return None
    bank: FogBank = fog.banks[int(number)]
    east, north, _ = moment.traffic.position[row]
    along = (east - bank.origin[0]) * bank.axis[0] + (north - bank.origin[1]) * bank.axis[1]
    return bool(bank.start <= along <= bank.end)


def _estimate(read: Callable[[Moment, Estimate], float | bool | None]) -> Callable[[Moment, str], float | bool | None]:
    def value(moment: Moment, method: str) -> float | bool | None:
        step = moment.ego_step
        # A method's own name may be shorter than its name in a scenario, which includes the module.
        names = {method, method.rpartition(":")[2]}
        found = (one for one in (() if step is None else step.estimates) if one.method in names)
        estimate = next(found, None)
        return None if estimate is None else read(moment, estimate)

    return value


def _light(read: Callable[[SignalAhead], _Read]) -> Callable[[Moment, str], _Read | None]:
    """Signal of the next traffic light, if it has the given id."""

    def value(moment: Moment, name: str) -> _Read | None:
        ahead = None if moment.ego_step is None else moment.ego_step.signal_ahead
        return read(ahead) if ahead is not None and ahead.signal_id == name else None

    return value


def _relative_error(visibility: float, truth: float) -> float | None:
    """Relative error of a visibility; None in clear air, where it is undefined."""
    return None if math.isinf(truth) else abs(visibility / truth - 1.0)


_VEHICLE, _PAIR = (Place.VEHICLE,), (Place.VEHICLE, Place.VEHICLE)
_PAIR_AND_LENGTH = (*_PAIR, Place.LENGTH)


def _speed(meaning: str, value: Callable[..., float | None], **further: object) -> Signal:
    return Signal(meaning, value, unit="m/s", shown_unit="km/h", least=0.0, **further)  # type: ignore[arg-type]  # its keywords


def _metres(meaning: str, value: Callable[..., float | None], **further: object) -> Signal:
    return Signal(meaning, value, unit="m", **{"least": 0.0, **further})  # type: ignore[arg-type]  # in the same way


_OF_RUN = {
    "time": Signal("simulated time since the run began", lambda m: m.step.time, unit="s", least=0.0),
    "ending": Signal(
        "why the run is over; no value while it goes on",
        lambda m: None if m.step.ending is None else m.step.ending.name.lower(),
        Kind.WORD,
        words=_ENDING_WORDS,
    ),
    "collisions": Signal(
        "pairs of vehicles, or of a vehicle and a person, that have collided so far",
        lambda m: float(len(m.collisions)),
        least=0.0,
    ),
    "happened(EVENT)": Signal(
        "whether an entry of the timeline, by its name or as `timeline.N`, has begun",
        lambda m, name: name in m.begun,
        Kind.FLAG,
        places=(Place.EVENT,),
    ),
    "over(EVENT)": Signal(
        "whether what an entry of the timeline has begun is over; false where it lasts no time, or no known one",
        lambda m, name: name in m.ended,
        Kind.FLAG,
        places=(Place.EVENT,),
    ),
}

_OF_VEHICLES = {
    "X.present": Signal(
        "whether a vehicle is on the road, and near enough to the ego to be read",
        lambda m, x: m.row(x) is not None,
        Kind.FLAG,
        places=_VEHICLE,
    ),
    "X.speed": _speed("speed", _of_vehicle(lambda m, i: float(m.traffic.speed[i])), most=_FASTEST, places=_VEHICLE),
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
    "X.lane": Signal(
        "lane counted from the right, from 0; or `right` and `left`, the outermost ones",
        _lane,
        Kind.LANE,
        least=0.0,
        words=("right", "left"),
        places=_VEHICLE,
    ),
    "X.lamps": Signal("lamps that are lit", _lamps, Kind.WORDS, words=_LAMP_WORDS, places=_VEHICLE),
    "X.advice": _speed(
        "lowest speed in force that the driver has heard advised; inf for none", _of_vehicle(_heard), places=_VEHICLE
    ),
    "X.visibility": _metres("true visibility at the driver's eyes", _of_vehicle(_seen), places=_VEHICLE),
    "X.collision": Signal("whether it has collided so far", _has_collided, Kind.FLAG, places=_VEHICLE),
    "gap(X, Y)": _metres(
        "gap from X to Y along the route, bumper to bumper, whatever the lane: positive if Y is ahead, negative if it "
        "is behind, 0 if they overlap",
        _of_pair(gap_between),
        least=-math.inf,
        places=_PAIR,
        needs=_ROUTE,
    ),
    "distance(X, Y)": _metres("straight distance between the front bumpers", _straight_distance, places=_PAIR),
    "distance(X, Y, LENGTH, LENGTH)": _metres(
        "straight distance between the points that are a length behind each one's front bumper",
        _straight_distance,
        places=(*_PAIR_AND_LENGTH, Place.LENGTH),
    ),
    "distance_to(X, LENGTH, LENGTH, LENGTH)": _metres(
        "straight distance between the point that is a length behind X's front bumper and the place x, y of the map",
        _distance_to,
        places=(Place.VEHICLE, *[Place.LENGTH] * 3),
    ),
    "clearance(X, Y)": _metres("straight distance between the bodies, 0 where they touch", _clearance, places=_PAIR),
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
}

_OF_PAIRS_BEYOND = {
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

_OF_EGO = {
    "ego.gap": _metres(
        "gap to the vehicle ahead; inf without one",
        _of_leader(lambda ahead, _: ahead.gap),
        least=-math.inf,
        needs=_EGO,
    ),
    "ego.ttc": Signal(
        "time to collision with the vehicle ahead at constant speeds; inf without one or if the gap does not shrink",
        _of_leader(_time_to_collision),
        unit="s",
        least=0.0,
        needs=_EGO,
    ),
    "ego.headway": Signal(
        "gap to the vehicle ahead over the ego's speed; inf without one, or at a standstill",
        _of_leader(lambda ahead, speed: max(ahead.gap, 0.0) / speed if speed > 0.0 else math.inf),
        unit="s",
        least=0.0,
        needs=_EGO,
    ),
    "ego.leader": Signal(
        "id of the vehicle ahead; `none` without one",
        _of_step(lambda s: NO_LEADER if s.leader is None else s.leader.vehicle_id),
        Kind.WORD,
        needs=_EGO,
    ),
    "ego.stopping_sight_distance": _metres(
        "way to react and stop at its speed (AASHTO: 2.5 s and 3.4 m/s²)",
        _of_step(lambda s: stopping_sight_distance(float(s.traffic.speed[s.ego]), REACTION_TIME, DECELERATION)),
        needs=_EGO,
    ),
    "ego.signs": Signal(
        "signs ahead in the map", _of_step(lambda s: float(len(s.observation.signs))), least=0.0, needs=_EGO
    ),
    "ego.sign_distance": _metres(
        "how far ahead the nearest of them is, as the map has it; inf without one",
        _of_step(lambda s: min((sign.distance for sign in s.observation.signs), default=math.inf)),
        needs=_EGO,
    ),
    "advice": _speed("advised speed in force: the ego's; without one, the lowest anywhere; inf for none", _advice),
    "limit": _speed("speed limit where the ego is; inf off the lanes", _of_step(lambda s: s.speed_limit), needs=_EGO),
    "lamps": Signal(
        "lamps of the ego that are lit", lambda m: _lamps(m, "ego"), Kind.WORDS, words=_LAMP_WORDS, needs=_EGO
    ),
    "warning": Signal(
        "what the ego's driver is warned of; `none` for nothing",
        _of_step(lambda s: _NO_WARNING if s.command.warning is None else s.command.warning.value),
        Kind.WORD,
        words=(_NO_WARNING, *(one.value for one in DriverWarning)),
        needs=_FRAMES,
    ),
}

_OF_LIGHTS = {
    "signal(ID).state": Signal(
        "colour of a traffic light for the ego, while it is the next one ahead",
        _light(lambda light: light.colour.value),
        Kind.WORD,
        words=tuple(colour.value for colour in SignalColour),
        places=(Place.SIGNAL,),
        needs=_EGO,
    ),
    "signal(ID).distance": _metres(
        "distance to its stop line, while it is the next one ahead of the ego",
        _light(lambda light: light.distance),
        places=(Place.SIGNAL,),
        needs=_EGO,
    ),
}

_OF_FOG = {
    "fog.visibility_at_camera": _metres(
        "true visibility at the camera; without an ego, at the densest visibility meter",
        lambda m: m.step.truth.visibility,
    ),
    "fog.visibility_ahead": _metres(
        "true mean visibility from the camera to one visibility length ahead", lambda m: m.step.truth.visibility_ahead
    ),
    "fog.bank(N)": Signal(
        "whether the ego is between the beginning and the end of `fog.banks.N`, where it is half as dense as inside",
        _is_in_bank,
        Kind.FLAG,
        places=(Place.BANK,),
        needs=_EGO,
    ),
    "fog.bank(N, X)": Signal("whether a vehicle is", _is_in_bank, Kind.FLAG, places=(Place.BANK, Place.VEHICLE)),
    "belief.visibility": _metres(
        "believed visibility, the median", _of_belief(lambda s: s.belief.visibility), needs=_FRAMES
    ),
    "belief.low": _metres(
        "visibility below which the truth is believed to be with 5 %",
        _of_belief(lambda s: s.belief.visibility_quantile(0.05)),
        needs=_FRAMES,
    ),
    "belief.high": _metres(
        "visibility below which the truth is believed to be with 95 %",
        _of_belief(lambda s: s.belief.visibility_quantile(0.95)),
        needs=_FRAMES,
    ),
    "belief.denser_fog": _metres(
        "distance from the camera to denser fog ahead that is believed; no value while there is none",
        _of_belief(lambda s: None if s.belief.denser is None else s.belief.denser.distance),
        needs=_FRAMES,
    ),
    "belief.error": Signal(
        "how far the believed visibility is from the true one ahead, as a share of it, unsigned",
        _of_belief(lambda s: _relative_error(s.belief.visibility, s.truth.visibility_ahead)),
        shown_unit="%",
        least=0.0,
        needs=_FRAMES,
    ),
    "estimate(METHOD).visibility": _metres(
        "visibility that an estimator gives; no value if the estimate is invalid",
        _estimate(lambda _, e: e.visibility if e.valid else None),
        places=(Place.METHOD,),
        needs=_FRAMES,
    ),
    "estimate(METHOD).valid": Signal(
        "whether an estimator gives a visibility",
        _estimate(lambda _, e: e.valid),
        Kind.FLAG,
        places=(Place.METHOD,),
        needs=_FRAMES,
    ),
    "estimate(METHOD).error": Signal(
        "absolute relative error of its visibility against the true one ahead; no value if the estimate is invalid",
        _estimate(lambda m, e: _relative_error(e.visibility, m.step.truth.visibility_ahead) if e.valid else None),
        shown_unit="%",
        least=0.0,
        places=(Place.METHOD,),
        needs=_FRAMES,
    ),
}

SIGNALS: Registry[Signal] = Registry(
    "signal", {**_OF_RUN, **_OF_VEHICLES, **_OF_PAIRS_BEYOND, **_OF_EGO, **_OF_LIGHTS, **_OF_FOG}
)
"""Every signal by name. In a name, X and Y are vehicles (``ego`` for the ego), METHOD an estimator of the
scenario, ID a traffic light, N the number of a fog bank, EVENT an entry of the timeline."""
