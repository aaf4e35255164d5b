"""Scripted manoeuvres: what vehicles are made to do, and when."""

import math
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass

from fogsim.traffic.drivers.playing import Lamps
from fogsim.values import Reason, Unplayed, UnplayedEvent
from fogsim.values.light import ALL_LAMPS
from fogsim.values.script import ChangeLane, SetLamps

Order = tuple[float, float]
"""Target speed [m/s], ``inf`` to free the vehicle, and the deceleration to reach it with [m/s²]."""


def signed_gap(ahead: float | None, behind: float | None, length: float, ego_length: float) -> float | None:
    """Gap of a vehicle to the ego from `ahead`, the ways between front bumpers [m]; `length` and `ego_length` [m].

    Positive bumper to bumper for a vehicle ahead, negative for one behind, 0 side by side; None without a way.
    """
    # On a road that leads in a circle there are both ways: the shorter one counts.
    if ahead is not None and (behind is None or ahead <= behind):
        return max(ahead - length, 0.0)
    return None if behind is None else min(ego_length - behind, 0.0)


@dataclass(frozen=True, slots=True)
class Trigger:
    """When an event begins: as soon as one of the conditions that are given holds."""

    at_position: float | None = None  # Distance that the vehicle has driven since it departed [m]
    at_time: float | None = None  # Time since the ego appeared [s]
    # Gap to the ego along the road, from bumper to bumper [m]: positive for a vehicle ahead of the ego, negative for
    # one behind it, 0 for one next to it. It holds when the gap comes to this value or passes it, from either side, and
    # for a vehicle that is nearer on the same side already when both are first on the road
    at_gap_to_ego: float | None = None
    name: str = ""  # What the event is called in messages

    def fires(self, time: float, driven: float, gap: float | None, earlier_gap: float | None) -> bool:
        """Whether the event begins (`time` [s], `driven` [m], `gap`, `earlier_gap` [m])."""
        return (
            (self.at_position is not None and driven >= self.at_position)
            or (self.at_time is not None and time >= self.at_time)
            or (self.at_gap_to_ego is not None and gap is not None and _reaches(self.at_gap_to_ego, gap, earlier_gap))
        )


def _reaches(wanted: float, gap: float, earlier: float | None) -> bool:
    """Whether a gap has reached a wanted one, or is nearer on the same side at the first look [m]."""
    if earlier is not None:
        return min(earlier, gap) <= wanted <= max(earlier, gap)
    return 0.0 < gap / wanted <= 1.0 if wanted else gap == 0.0


@dataclass(frozen=True, slots=True)
class BrakeEvent:
    """A vehicle brakes, holds the lower speed, and drives on."""

    vehicle: str  # Its id
    trigger: Trigger  # When
    to_speed: float = 0.0  # Speed that it brakes to [m/s]; 0 is a standstill
    deceleration: float = 4.0  # Deceleration while braking [m/s²], positive; the vehicle's own limit applies too
    hold: float = math.inf  # Time from the beginning of the braking until it drives on [s]; ``inf`` for a breakdown


@dataclass(frozen=True, slots=True)
class LaneChangeEvent:
    """A vehicle changes lane, whoever is there: it cuts in."""

    vehicle: str  # Its id
    trigger: Trigger  # When
    lanes: int  # How many lanes to the left; negative to the right
    stay: float = 60.0  # Time for which it stays there [s]


@dataclass(frozen=True, slots=True)
class LampFailureEvent:
    """Lamps of a vehicle go dark, or are switched by hand."""

    vehicle: str  # Its id
    trigger: Trigger  # When
    switches: tuple[SetLamps, ...] = ()  # Which, and how; all of them fail if there are none


Event = BrakeEvent | LaneChangeEvent | LampFailureEvent


@dataclass(frozen=True, slots=True)
class Situation:
    """What triggers look at."""

    time: float  # Time since the ego appeared [s]
    present: set[str]  # Vehicles on the road
    driven: Callable[[str], float]  # Distance that a vehicle has driven [m]
    # Gap of a vehicle to the ego along the road, as of `signed_gap` [m]; None if there is none
    gap_to_ego: Callable[[str], float | None]
    # Whether a vehicle could go so many lanes to the left, negative to the right, where it is
    has_lane: Callable[[str, int], bool]


@dataclass(frozen=True, slots=True)
class _ScriptedActions:
    """What the script asks for in this step."""

    orders: Mapping[str, Order]  # Speeds to bring vehicles to
    lane_changes: tuple[ChangeLane, ...]  # Lane changes that begin now


class Script:
    """Plays events; remembers which have begun, and which lamps are not the vehicles' own."""

    def __init__(self, events: Iterable[Event]) -> None:
        self.lamps = Lamps()
        self._events = tuple(events)
        self._waiting: list[Event] = list(self._events)
        self._without_lane: set[LaneChangeEvent] = set()
        self._braking: dict[BrakeEvent, float] = {}
        self._gaps: dict[str, float | None] = {}

    @property
    def dark(self) -> frozenset[str]:
        """Vehicles whose lamps have failed."""
        return self.lamps.dark

    @property
    def is_idle(self) -> bool:
        """True if no event waits and no vehicle brakes, so that `play` would do nothing."""
        return not (self._waiting or self._braking)

    def play(self, situation: Situation) -> _ScriptedActions:
        """Begin what is due and go on with what has begun."""
        begun = self._begin(situation) if self._waiting else []
        return _ScriptedActions(
            orders=self._orders(situation) if self._braking else {},
            lane_changes=self._lane_changes(begun, situation) if begun else (),
        )

    def unplayed(self, seen: Collection[str], present: Collection[str], others: Iterable[str] = ()) -> Unplayed:
        """List what has not been played so far."""

        def why(event: Event) -> Reason:
            if event in self._without_lane:
                return Reason.NO_LANE
            if event.vehicle in present:
                return Reason.NOT_REACHED
            return Reason.LEFT if event.vehicle in seen else Reason.NEVER_SEEN

        missed = [event for event in self._events if event in self._waiting or event in self._without_lane]
        # What stands for one event of a scenario has one name, and is listed once.
        names = dict.fromkeys(
            UnplayedEvent(event.trigger.name or f"event of {event.vehicle}", why(event)) for event in missed
        )
        expected = {*others, *(event.vehicle for event in self._events)}
        return Unplayed(tuple(names), tuple(sorted(expected.difference(seen))))

    def _begin(self, situation: Situation) -> list[Event]:
        measured = {event.vehicle for event in self._waiting if event.trigger.at_gap_to_ego is not None}
        gaps = {v: situation.gap_to_ego(v) for v in sorted(measured & situation.present)}
        begun = [event for event in self._waiting if self._is_due(event, situation, gaps.get(event.vehicle))]
        self._gaps = gaps
        for event in begun:
            self._waiting.remove(event)
            if isinstance(event, BrakeEvent):
                self._braking[event] = situation.time
            elif isinstance(event, LampFailureEvent):
                for switch in event.switches or (SetLamps(event.vehicle, failed=ALL_LAMPS),):
                    self.lamps.switch(switch)
        return begun

    def _lane_changes(self, begun: Iterable[Event], situation: Situation) -> tuple[ChangeLane, ...]:
        """Lane changes among events that begin, without those for which there is no lane."""
        changes = [event for event in begun if isinstance(event, LaneChangeEvent)]
        possible = tuple(event for event in changes if situation.has_lane(event.vehicle, event.lanes))
        self._without_lane.update(set(changes).difference(possible))
        return tuple(ChangeLane(event.vehicle, event.lanes, event.stay) for event in possible)

    def _is_due(self, event: Event, situation: Situation, gap: float | None) -> bool:
        vehicle, on_the_way = event.vehicle, event.trigger.at_position is not None
        return vehicle in situation.present and event.trigger.fires(
            situation.time, situation.driven(vehicle) if on_the_way else 0.0, gap, self._gaps.get(vehicle)
        )

    def _orders(self, situation: Situation) -> dict[str, Order]:
        orders: dict[str, Order] = {}
        for event, since in list(self._braking.items()):
            over = situation.time - since >= event.hold
            if event.vehicle in situation.present:
                order = (math.inf if over else event.to_speed, event.deceleration)
                # Of several that hold a vehicle at once the lowest speed counts, and none frees it from another.
                orders[event.vehicle] = min(order, orders.get(event.vehicle, order), key=lambda o: o[0])
            if over or event.vehicle not in situation.present:
                del self._braking[event]
        return orders
