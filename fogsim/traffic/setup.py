"""What a traffic simulation is, and what it needs to know before it starts."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Protocol

from fogsim.core.parameters import Range, checked_parameters
from fogsim.traffic.drivers.events import Event
from fogsim.traffic.drivers.sight import DriverSight, FogAccess
from fogsim.traffic.drivers.speed_choice import DriverSetup, unaffected
from fogsim.values import Collision, Command, NetworkSnapshot, RoadNetwork, SignMap, TrafficSnapshot, Unplayed
from fogsim.values.script import TrafficAction

UNTOUCHED = DriverSetup(unaffected, spread=0.0)
"""Drivers as the user's own simulation has them."""


ANY_EGO = "any"
"""In place of an ego's id: the first vehicle that suits."""


class AfterCollision(StrEnum):
    """What becomes of vehicles that have collided: they stand and block the lane, or they vanish."""

    STOP = "stop"
    REMOVE = "remove"


@checked_parameters
@dataclass(frozen=True, slots=True)
class TrafficSetup:
    """A SUMO simulation, and who the ego is if there is one.

    Parameters
    ----------
    net : Path or None
        SUMO network; None for the one that the simulation has loaded.
    routes, additional : tuple of Path
        SUMO route and additional files.
    ego : str or None
        Id of the ego vehicle, or `ANY_EGO`; None for traffic alone.
    step_length : float
        SUMO's step [s].
    keep_lane : tuple of str
        Vehicles that never change lane.
    warm_up_limit : float
        Simulated time within which the ego must appear [s].
    advice_deceleration : float
        Deceleration with which an advised vehicle slows down to the advice [m/s²].
    reading_radius : float
        Vehicles farther from the ego than this are not read [m].
    events : tuple of Event
        What is scripted.
    sight : DriverSight or None
        Eyes of the drivers; None lets them see through the fog, as SUMO's do by themselves.
    drivers : DriverSetup
        How drivers choose their speed in fog and follow advice.
    after_collision : AfterCollision
        What becomes of vehicles that have collided.
    config : Path or None
        SUMO configuration, in place of net, routes and additional files.
    sumo_options : tuple of (str, str)
        Further options of SUMO, named without dashes, and their values as on its command line.
    warm_up : float
        Without an ego, simulated time before the run begins [s].
    """

    net: Path | None
    routes: tuple[Path, ...] = ()
    additional: tuple[Path, ...] = ()
    ego: str | None = "ego"
    step_length: Annotated[float, Range(0.001, 10.0, "s")] = 0.1
    keep_lane: tuple[str, ...] = ()
    warm_up_limit: float = 600.0
    advice_deceleration: float = 2.0
    reading_radius: Annotated[float, Range(1.0, math.inf, "m")] = 1000.0
    events: tuple[Event, ...] = ()
    sight: DriverSight | None = None
    drivers: DriverSetup = UNTOUCHED
    after_collision: AfterCollision = AfterCollision.STOP
    config: Path | None = None
    sumo_options: tuple[tuple[str, str], ...] = ()
    warm_up: float = 0.0

    def __post_init__(self) -> None:
        # SUMO takes no number of NumPy's, and its options are chosen by identity.
        object.__setattr__(self, "step_length", float(self.step_length))
        object.__setattr__(self, "after_collision", AfterCollision(self.after_collision))


class AnyTraffic(Protocol):
    """A running traffic simulation."""

    def enter_fog(self, fog: FogAccess) -> None:
        """Let drivers see only what this fog lets them see, from now on and in every later run."""

    def begin(self, actions: Sequence[TrafficAction]) -> tuple[TrafficAction, ...]:
        """Begin, with the next step, what a script asks for; return what could not begin, without vehicle or lane."""

    def advance(self, command: Command) -> None:
        """Move by one traffic step with a command in force."""

    def unplayed(self) -> Unplayed:
        """List what of the script has not been played since the start; before `close`."""

    def close(self) -> None:
        """End the simulation; closing twice is allowed."""


class Traffic(AnyTraffic, Protocol):
    """A running traffic simulation with one ego vehicle."""

    def start(self, seed: int) -> None:
        """Begin, or begin again, and run until the ego is on the road."""

    def planned_network(self) -> tuple[RoadNetwork, SignMap] | None:
        """Roads and signs along the ego's way before `start`; None where no file has it written out."""

    def network(self) -> tuple[RoadNetwork, SignMap]:
        """Roads and signs; after `start`."""

    def observe(self) -> TrafficSnapshot | None:
        """Report where everyone is and what has happened since the last call; None once the ego has left."""


class NetworkTraffic(AnyTraffic, Protocol):
    """A running traffic simulation without an ego vehicle."""

    def start(self, seed: int) -> None:
        """Begin, or begin again."""

    def observe_network(self) -> NetworkSnapshot:
        """Report where everyone is and what has happened since the last call."""


class CollisionLog:
    """Collects collisions until they are asked for."""

    def __init__(self) -> None:
        self._pairs: set[frozenset[str]] = set()
        self._pending: list[Collision] = []

    def add(self, collisions: Iterable[Collision]) -> None:
        """Take in the collisions of a step; those of pairs that have collided before are left out."""
        for collision in collisions:
            pair = frozenset((collision.collider, collision.victim))
            if pair not in self._pairs:
                self._pairs.add(pair)
                self._pending.append(collision)

    def includes(self, vehicle: str | None) -> bool:
        """Whether a vehicle is in a collision that has not been asked for."""
        return any(vehicle in (one.collider, one.victim) for one in self._pending)

    def take(self) -> tuple[Collision, ...]:
        """Collisions since the last call."""
        pending, self._pending = tuple(self._pending), []
        return pending
