"""All signals of conditions, by names with the arguments X, Y, METHOD and so on."""

import math
from collections.abc import Callable
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from fogsim.conditions.moment import EGO, Moment
from fogsim.conditions.signal import Kind, Need, Place, Signal, length_signal, speed_signal
from fogsim.conditions.vehicle_signals import LAMP_WORDS, OF_VEHICLES, lit_lamps
from fogsim.core.kinematics import DECELERATION, REACTION_TIME, stopping_sight_distance
from fogsim.core.registry import Registry
from fogsim.values import DriverWarning, Ending, Estimate, FogBank, Leader, SignalAhead, SignalColour, Step

_EGO, _FRAMES = frozenset({Need.EGO}), frozenset({Need.FRAMES})

_REACH = 250.0
"""Distance ahead and behind in which vehicles count for the traffic density [m]."""


def _is_inside(bank: FogBank, position: NDArray[np.float64]) -> bool:
    """Whether a position (3,) [m] is between the beginning and the end of a bank."""
    east, north, _ = position
    along = (east - bank.origin[0]) * bank.axis[0] + (north - bank.origin[1]) * bank.axis[1]
    return bool(bank.start <= along <= bank.end)


def _density(moment: Moment) -> float | None:
    step = moment.ego_step
    if step is None:
        return None
    traffic, ego = step.traffic, step.ego
    reach = min(_REACH, step.reading_radius)
    apart = traffic.position[:, :2] - traffic.position[ego, :2]
    is_near = np.hypot(apart[:, 0], apart[:, 1]) <= reach
    is_along = np.cos(traffic.heading - traffic.heading[ego]) > 0.0
    return float(np.count_nonzero(is_near & is_along) - 1) / (2.0 * reach)


def _is_in_any_bank(moment: Moment) -> bool | None:
    row, fog = moment.row(EGO), moment.step.truth.fog
    if row is None or fog is None:
        return None
    return any(_is_inside(bank, moment.traffic.position[row]) for bank in fog.banks)


_OF_SURROUNDINGS = {
    "light": Signal(
        "horizontal illuminance of the sky: 10 000 lx by day, below 1 lx at night",
        lambda m: m.step.truth.illuminance,
        unit="lx",
        least=0.0,
    ),
    "ego.curvature": Signal(
        "curvature of the road, over 50 m about the ego: 0 where it is straight, 1 km^-1 for a radius of 1000 m",
        lambda m: m.curvature(EGO),
        unit="m^-1",
        shown_unit="km^-1",
        least=0.0,
        needs=_EGO,
    ),
    "ego.traffic_density": Signal(
        f"other vehicles in the ego's direction within {_REACH:g} m of it, on all lanes, per length of road",
        _density,
        unit="veh/m",
        shown_unit="veh/km",
        least=0.0,
        needs=_EGO,
    ),
    "ego.has_leader": Signal(
        "whether a vehicle is ahead of the ego",
        lambda m: None if m.ego_step is None else m.ego_step.leader is not None,
        Kind.FLAG,
        needs=_EGO,
    ),
    "ego.sensor_fault": Signal(
        "whether a fault of the ego's sensors is in force",
        lambda m: None if m.ego_step is None else bool(m.step.truth.faults),
        Kind.FLAG,
        needs=_EGO,
    ),
    "fog.in_bank": Signal("whether the ego is in any of the fog banks", _is_in_any_bank, Kind.FLAG, needs=_EGO),
}
"""By name."""


NO_LEADER = "none"
"""Value of ``ego.leader`` without a vehicle ahead."""

_NO_WARNING = "none"
"""Value of ``warning`` while the driver is warned of nothing."""

_ENDING_WORDS = tuple(ending.name.lower() for ending in Ending)
"""Endings of a run by their words."""

_Read = TypeVar("_Read", float, str)


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


def _advice(moment: Moment) -> float:
    command = moment.step.command
    if moment.ego_step is not None:
        return command.advice.speed
    return min([command.advice.speed, *command.advised_speeds.values(), *(s.speed for s in command.stretches)])


def _time_to_collision(leader: Leader, speed: float) -> float:
    approach = speed - leader.speed
    return max(leader.gap, 0.0) / approach if approach > 0.0 else math.inf


def _is_in_bank(moment: Moment, number: str, vehicle: str = "ego") -> bool | None:
    row, fog = moment.row(vehicle), moment.step.truth.fog
    if row is None or fog is None or int(number) >= len(fog.banks):
        return None
    return _is_inside(fog.banks[int(number)], moment.traffic.position[row])


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

_OF_EGO = {
    "ego.gap": length_signal(
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
    "ego.stopping_sight_distance": length_signal(
        "way to react and stop at its speed (AASHTO: 2.5 s and 3.4 m/s²)",
        _of_step(lambda s: stopping_sight_distance(float(s.traffic.speed[s.ego]), REACTION_TIME, DECELERATION)),
        needs=_EGO,
    ),
    "ego.signs": Signal(
        "signs ahead in the map", _of_step(lambda s: float(len(s.observation.signs))), least=0.0, needs=_EGO
    ),
    "ego.sign_distance": length_signal(
        "how far ahead the nearest of them is, as the map has it; inf without one",
        _of_step(lambda s: min((sign.distance for sign in s.observation.signs), default=math.inf)),
        needs=_EGO,
    ),
    "advice": speed_signal(
        "advised speed in force: the ego's; without one, the lowest anywhere; inf for none", _advice
    ),
    "limit": speed_signal(
        "speed limit where the ego is; inf off the lanes", _of_step(lambda s: s.speed_limit), needs=_EGO
    ),
    "lamps": Signal(
        "lamps of the ego that are lit", lambda m: lit_lamps(m, "ego"), Kind.WORDS, words=LAMP_WORDS, needs=_EGO
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
    "signal(ID).distance": length_signal(
        "distance to its stop line, while it is the next one ahead of the ego",
        _light(lambda light: light.distance),
        places=(Place.SIGNAL,),
        needs=_EGO,
    ),
}

_OF_FOG = {
    "fog.visibility_at_camera": length_signal(
        "true visibility at the camera; without an ego, at the densest visibility meter",
        lambda m: m.step.truth.visibility,
    ),
    "fog.visibility_ahead": length_signal(
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
    "belief.visibility": length_signal(
        "believed visibility, the median", _of_belief(lambda s: s.belief.visibility), needs=_FRAMES
    ),
    "belief.low": length_signal(
        "visibility below which the truth is believed to be with 5 %",
        _of_belief(lambda s: s.belief.visibility_quantile(0.05)),
        needs=_FRAMES,
    ),
    "belief.high": length_signal(
        "visibility below which the truth is believed to be with 95 %",
        _of_belief(lambda s: s.belief.visibility_quantile(0.95)),
        needs=_FRAMES,
    ),
    "belief.denser_fog": length_signal(
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
    "estimate(METHOD).visibility": length_signal(
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
    "signal", {**_OF_RUN, **OF_VEHICLES, **_OF_EGO, **_OF_SURROUNDINGS, **_OF_LIGHTS, **_OF_FOG}
)
"""Every signal by name. In a name, X and Y are vehicles (``ego`` for the ego), METHOD an estimator of the
scenario, ID a traffic light, N the number of a fog bank, EVENT an entry of the timeline."""
