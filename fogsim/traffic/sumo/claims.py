"""Setting attributes of SUMO's vehicles that others set too: several sessions of FogSim may claim one at once.

What each session wants of a vehicle, and what the vehicle had by itself, is kept with the vehicle in SUMO, in
parameters whose keys begin with ``fogsim.``: there all sessions of a simulation find it, those of other processes too,
and it ends with the vehicle.
"""

import json
import secrets
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

from fogsim.errors import SimulationError
from fogsim.traffic.sumo.link import Api, getter, vehicle_getter

SOLE_SESSION = "1"
"""Name of a session that has its simulation for itself."""

_SESSIONS = "fogsim.sessions"
_OWN = "own"
_LEAST = 1e-6
_Value = TypeVar("_Value")


_Rule = Callable[[float, Collection[float]], float]
"""From a vehicle's own value and what sessions claim, which may be nothing, to the value that is in force."""


def lowest(own: float, claims: Collection[float]) -> float:
    """The lowest claim holds, unless the vehicle's own value is lower."""
    return min(own, *claims) if claims else own


def farthest(own: float, claims: Collection[float]) -> float:
    """The claim that is farthest from the vehicle's own value by ratio holds; the lower of two that are as far."""
    return max(claims, key=lambda claim: (max(claim, own) / max(min(claim, own), _LEAST), -claim)) if claims else own


@dataclass(frozen=True, slots=True)
class Attribute:
    """What of a vehicle is set."""

    name: str  # Its name
    read: Callable[[Api, str], float]  # From SUMO's domain of vehicles and a vehicle's id to the value
    write: Callable[[Api, str, float], None]  # Sets a vehicle's value
    rule: _Rule = lowest  # Which value is in force where sessions claim some


TOP_SPEED = Attribute("maxSpeed", lambda get, v: float(get.getMaxSpeed(v)), lambda set_, v, x: set_.setMaxSpeed(v, x))
"""Top speed [m/s]."""

TIME_HEADWAY = Attribute("tau", lambda get, v: float(get.getTau(v)), lambda set_, v, x: set_.setTau(v, x), farthest)
"""Wanted time headway [s], which drivers shorten or lengthen."""


def _set_speed_factor(vehicles: Api, vehicle: str, factor: float) -> None:
    # With the first change of what its type says a vehicle gets a type of its own, and SUMO draws its factor again if
    # the type's has no deviation. So that comes before.
    vehicles.setTau(vehicle, vehicles.getTau(vehicle))
    vehicles.setSpeedFactor(vehicle, factor)


SPEED_FACTOR = Attribute("speedFactor", lambda get, v: float(get.getSpeedFactor(v)), _set_speed_factor)
"""Wanted speed over the speed limit of any lane [-]."""

LANE_CHANGE_MODE = Attribute(
    "laneChangeMode",
    lambda get, v: float(get.getLaneChangeMode(v)),
    lambda set_, v, x: set_.setLaneChangeMode(v, int(x)),
)
"""Bits of why a vehicle may change lane."""

SPEED_MODE = Attribute(
    "speedMode",
    lambda get, v: float(get.getSpeedMode(v)),
    lambda set_, v, x: set_.setSpeedMode(v, int(x)),
)
"""Bits of what a vehicle's speed regards; a claim must clear bits of its own mode, and all claims the same ones."""


def _lane_change_parameter(name: str, sign: int = 1) -> Attribute:
    """Parameter of lane-change models that have it; with sign -1 its highest claim holds, as claims hold -x of it."""
    key = f"laneChangeModel.{name}"
    return Attribute(
        name,
        lambda get, v: sign * float(get.getParameter(v, key)),
        lambda set_, v, x: set_.setParameter(v, key, repr(sign * x)),
    )


SPEED_GAIN = _lane_change_parameter("lcSpeedGain")
"""Eagerness to change lanes for speed (LC2013, SL2015) [-]."""

STRATEGIC = _lane_change_parameter("lcStrategic")
"""Eagerness to change lanes for the route and around what stands; negative for never (LC2013, SL2015) [-]."""

COOPERATIVE_SPEED = _lane_change_parameter("lcCooperativeSpeed")
"""Willingness to change speed for others who change lanes (LC2013, SL2015) [-]."""

COOPERATIVE = _lane_change_parameter("lcCooperative")
"""Willingness to change lanes for others; negative for never (LC2013, SL2015) [-]."""

OVERTAKE_RIGHT = _lane_change_parameter("lcOvertakeRight", sign=-1)
"""Minus the probability of overtaking on the right where that is forbidden (LC2013) [-]."""


def new_session(api: Api) -> str:
    """Name of a new session of a simulation, which no other session of it has."""
    number = int(api.simulation.getParameter("", _SESSIONS) or 0) + 1
    api.simulation.setParameter("", _SESSIONS, str(number))
    return str(number)


class LoadMark:
    """A mark of one session in a simulation, which SUMO forgets when another simulation is loaded in its place."""

    def __init__(self, api: Api, session: str) -> None:
        self._read = getter(api, "simulation", "getParameter")
        self._key, self._value = f"fogsim.mark.{session}", secrets.token_hex(8)
        api.simulation.setParameter("", self._key, self._value)

    def is_there(self) -> bool:
        """Whether the simulation is still the one that was marked."""
        return bool(self._read("", self._key) == self._value)

    def check(self) -> None:
        """Refuse another simulation."""
        if self._read("", self._key) != self._value:
            raise SimulationError(
                "the simulation was loaded again while FogSim was using it: attach to it, or start the run, again"
            )


class SessionValues(Generic[_Value]):
    """Values that the sessions keep with vehicles under one key."""

    def __init__(self, api: Api, name: str) -> None:
        self._vehicles = api.vehicle
        self._read = vehicle_getter(api, "getParameter")
        self._key = f"fogsim.{name}"
        # What was written last, so that it need not be taken apart again unless somebody else has written since.
        self._written: dict[str, tuple[str, dict[str, _Value]]] = {}

    def read(self, vehicle: str) -> dict[str, _Value]:
        """Values of a vehicle, by session."""
        text = self._read(vehicle, self._key)
        if not text:
            self._written.pop(vehicle, None)
            return {}
        known, values = self._written.get(vehicle, ("", {}))
        return dict(values) if text == known else dict(json.loads(text))

    def write(self, vehicle: str, values: dict[str, _Value]) -> None:
        """Replace the values of a vehicle."""
        text = json.dumps(values) if values else ""
        self._written[vehicle] = text, dict(values)
        self._vehicles.setParameter(vehicle, self._key, text)


class Claims:
    """One session's claims to one attribute of vehicles.

    Which claim of all sessions holds is the attribute's rule: mostly the lowest, unless the vehicle's own value is
    lower. A value that somebody else has set meanwhile is the vehicle's own from then on.
    """

    def __init__(self, api: Api, attribute: Attribute, session: str) -> None:
        self._vehicles = api.vehicle
        self._attribute = attribute
        self._session = session
        self._values = SessionValues[float](api, attribute.name)

    def own_value(self, vehicle: str) -> float:
        """The value that a vehicle has without any claim."""
        return self._current(vehicle)[1][_OWN]

    def _current(self, vehicle: str) -> tuple[float, dict[str, float]]:
        """The value in force, and all claims with the vehicle's own value."""
        now, values = self._attribute.read(self._vehicles, vehicle), self._values.read(vehicle)
        if not values or now != self._in_force(values):
            values[_OWN] = now
        return now, values

    def claim(self, vehicle: str, value: float) -> None:
        """Claim a value of the attribute."""
        now, values = self._current(vehicle)
        values[self._session] = value
        self._put_in_force(vehicle, now, values)

    def hold(self, vehicle: str, value: float) -> None:
        """Claim a value that the attribute does not have."""
        if self._attribute.read(self._vehicles, vehicle) != value:
            self.claim(vehicle, value)

    def withdraw(self, vehicle: str) -> None:
        """Withdraw the claim to a vehicle, if there is one: what others claim, or its own value, comes into force."""
        # Before anything else is asked: mostly there is none.
        if self._session in self._values.read(vehicle):
            now, values = self._current(vehicle)
            del values[self._session]
            self._put_in_force(vehicle, now, values)

    def _in_force(self, values: Mapping[str, float]) -> float:
        return self._attribute.rule(values[_OWN], [value for name, value in values.items() if name != _OWN])

    def _put_in_force(self, vehicle: str, now: float, values: dict[str, float]) -> None:
        value = self._in_force(values)
        if value != now:
            self._attribute.write(self._vehicles, vehicle, value)
        self._values.write(vehicle, values if len(values) > 1 else {})
