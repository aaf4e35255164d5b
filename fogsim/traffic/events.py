"""Scripted manoeuvres: what vehicles are made to do, and when."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from fogsim.traffic.control import Order


@dataclass(frozen=True, slots=True)
class Trigger:
    """When an event begins: as soon as one of the conditions that are given holds.

    Attributes
    ----------
    at_position : float or None
        Distance that the vehicle has driven since it departed [m].
    at_time : float or None
        Time since the ego appeared [s].
    at_gap_to_ego : float or None
        Straight distance between the vehicle's and the ego's front bumpers [m]; nearer counts too.
    """

    at_position: float | None = None
    at_time: float | None = None
    at_gap_to_ego: float | None = None

    def fires(self, time: float, driven: float, gap: float) -> bool:
        """Tell whether the event begins.

        Parameters
        ----------
        time : float
            Time since the ego appeared [s]; negative before.
        driven : float
            Distance that the vehicle has driven [m].
        gap : float
            Its distance from the ego [m]; ``inf`` without an ego.
        """
        return (
            (self.at_position is not None and driven >= self.at_position)
            or (self.at_time is not None and time >= self.at_time)
            or (self.at_gap_to_ego is not None and gap <= self.at_gap_to_ego)
        )


@dataclass(frozen=True, slots=True)
class BrakeEvent:
    """A vehicle brakes, holds the lower speed, and drives on.

    Attributes
    ----------
    vehicle : str
        Its id.
    trigger : Trigger
        When.
    to_speed : float
        Speed that it brakes to [m/s]; 0 is a standstill.
    deceleration : float
        Deceleration while braking [m/s²], positive; the vehicle's own limit applies too.
    hold : float
        Time from the beginning of the braking until it drives on [s]; ``inf`` for a breakdown.
    """

    vehicle: str
    trigger: Trigger
    to_speed: float = 0.0
    deceleration: float = 4.0
    hold: float = math.inf


@dataclass(frozen=True, slots=True)
class LaneChangeEvent:
    """A vehicle changes lane, whoever is there: it cuts in.

    Attributes
    ----------
    vehicle : str
        Its id.
    trigger : Trigger
        When.
    lanes : int
        How many lanes to the left; negative to the right.
    stay : float
        Time for which it stays there [s].
    """

    vehicle: str
    trigger: Trigger
    lanes: int
    stay: float = 60.0


@dataclass(frozen=True, slots=True)
class LampFailureEvent:
    """All lamps of a vehicle go dark.

    Attributes
    ----------
    vehicle : str
        Its id.
    trigger : Trigger
        When.
    """

    vehicle: str
    trigger: Trigger


Event = BrakeEvent | LaneChangeEvent | LampFailureEvent


@dataclass(frozen=True, slots=True)
class Situation:
    """What triggers look at.

    Attributes
    ----------
    time : float
        Time since the ego appeared [s].
    present : set of str
        Vehicles on the road.
    driven : callable
        Distance that a vehicle has driven [m].
    gap_to_ego : callable
        Distance of a vehicle from the ego [m].
    """

    time: float
    present: set[str]
    driven: Callable[[str], float]
    gap_to_ego: Callable[[str], float]


@dataclass(frozen=True, slots=True)
class Doings:
    """What the script wants of this step.

    Attributes
    ----------
    orders : mapping from vehicle id to Order
        Speeds to bring vehicles to.
    lane_changes : tuple of LaneChangeEvent
        Lane changes that begin now.
    """

    orders: Mapping[str, Order]
    lane_changes: tuple[LaneChangeEvent, ...]


class Script:
    """Plays events; remembers which have begun.

    Parameters
    ----------
    events : iterable of Event
        What is scripted.
    """

    def __init__(self, events: Iterable[Event]) -> None:
        self._waiting: list[Event] = list(events)
        self._braking: dict[BrakeEvent, float] = {}
        self._dark: set[str] = set()

    @property
    def dark(self) -> frozenset[str]:
        """Vehicles whose lamps have failed."""
        return frozenset(self._dark)

    @property
    def is_idle(self) -> bool:
        """True if nothing waits and nobody brakes, so that `play` would do nothing."""
        return not (self._waiting or self._braking)

    def play(self, situation: Situation) -> Doings:
        """Begin what is due and go on with what has begun."""
        begun = self._begin(situation) if self._waiting else []
        return Doings(
            orders=self._orders(situation) if self._braking else {},
            lane_changes=tuple(event for event in begun if isinstance(event, LaneChangeEvent)),
        )

    def _begin(self, situation: Situation) -> list[Event]:
        begun = [event for event in self._waiting if self._is_due(event, situation)]
        for event in begun:
            self._waiting.remove(event)
            if isinstance(event, BrakeEvent):
                self._braking[event] = situation.time
            elif isinstance(event, LampFailureEvent):
                self._dark.add(event.vehicle)
        return begun

    def _is_due(self, event: Event, situation: Situation) -> bool:
        vehicle = event.vehicle
        return vehicle in situation.present and event.trigger.fires(
            situation.time, situation.driven(vehicle), situation.gap_to_ego(vehicle)
        )

    def _orders(self, situation: Situation) -> dict[str, Order]:
        orders = {}
        for event, since in list(self._braking.items()):
            over = situation.time - since >= event.hold
            if event.vehicle in situation.present:
                orders[event.vehicle] = (math.inf if over else event.to_speed, event.deceleration)
            if over or event.vehicle not in situation.present:
                del self._braking[event]
        return orders
