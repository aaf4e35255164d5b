"""Drivers yield only to those pedestrians on crossings whom they can see.

SUMO lets drivers ignore persons in the same way as vehicles (``junctionModel.ignoreIDs``). Looked at are the persons on
the crossings and walking areas of a junction, or about to step on one, and the drivers on the junction or on the roads
that lead to it. Pedestrians themselves look, or listen, through any fog.
"""

import functools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence

from fogsim.traffic.appearance import OTHERS_LAMPS
from fogsim.traffic.drivers.lamp_intensity import head_lamp_light, head_lamp_share
from fogsim.traffic.sumo.link import getter, vehicle_getter
from fogsim.traffic.sumo_drivers.unseen import UnseenFoes
from fogsim.traffic.sumo_drivers.vehicle_sight import DriversView, OwnLamps

_LOOK_PERIOD = 0.2
"""Time between two looks at pedestrians [s]."""

_FARTHEST_PERSON = 100.0
"""No one yields to a pedestrian farther away than this [m]."""

_CONTRAST = 0.6
"""Contrast of a person in everyday clothes to the airlight [-]; FogSim's choice."""

_HEAD_LAMP_SHARE = 0.3
"""Light that clothes send back over that of an unlit vehicle with its reflectors [-]: at night a person is seen at 30 m
where such a vehicle is at 55 m; FogSim's choice."""

_BODY_MIDDLE = 1.0
"""Height of eyes and persons above the road [m]."""

_HEAD = 1.65
"""Height above the road of a person's head, which may be seen over a hedge or a wall [m]."""

_Point = tuple[float, float, float]

_OWN_PART = "persons"
_CROSSING, _WALKING_AREA = "c", "w"
_PLACES_ON_FOOT = (_CROSSING, _WALKING_AREA)


class PedestrianSight:
    """Decides which pedestrians at junctions are seen."""

    def __init__(self, view: DriversView) -> None:
        self._api, self._fog, self._sight, self._roster = view.api, view.fog, view.sight, view.roster
        self._obstructions = view.obstructions
        self._position, self._angle = (vehicle_getter(view.api, name) for name in ("getPosition3D", "getAngle"))
        self._person_position = getter(view.api, "person", "getPosition3D")
        self._person_count, self._persons = (getter(view.api, "person", name) for name in ("getIDCount", "getIDList"))
        self._person_road, self._next_edge = (getter(view.api, "person", name) for name in ("getRoadID", "getNextEdge"))
        self._on_edge = getter(view.api, "edge", "getLastStepVehicleIDs")
        self._unseen = UnseenFoes(view.api, f"{view.session} {_OWN_PART}", view.sight.reaction_time)
        self._seen_through_fog = view.sight.seen_distance(view.fog.maximum_extinction, _CONTRAST, head_lamps=0.0)
        self._certainly_seen = 0.0 if view.obstructions else self._seen_through_fog
        self._mark = 0
        self._roads: dict[str, tuple[str, ...]] = {}
        self._next = 0.0

    def update(self, own_lamps: OwnLamps) -> None:
        """Make SUMO's drivers ignore pedestrians that they do not see."""
        now = self._roster.time
        if self._certainly_seen >= _FARTHEST_PERSON or now < self._next or not self._has_crossings:
            return
        self._next = now + _LOOK_PERIOD
        new, self._mark = self._roster.entered_since(self._mark)
        present = self._roster.present
        self._unseen.forget([v for v in self._unseen.drivers if v not in present] + new, present.intersection(new))
        doubts: dict[str, list[str]] = {driver: [] for driver in self._unseen.drivers}
        if self._person_count():
            for driver, person in self._pairs_near():
                doubts.setdefault(driver, []).append(person)
        pairs = [(driver, person) for driver, persons in doubts.items() for person in persons]
        seen = dict(zip(pairs, self._sees(pairs, own_lamps), strict=True))
        for driver, persons in doubts.items():
            self._unseen.decide(driver, {person: seen[driver, person] for person in persons}, now)

    @functools.cached_property
    def _has_crossings(self) -> bool:
        """Whether there is a crossing in the network."""
        parts = (edge.rpartition("_")[2] for edge in self._api.edge.getIDList() if edge.startswith(":"))
        return any(part.startswith(_CROSSING) for part in parts)

    def _pairs_near(self) -> Iterator[tuple[str, str]]:
        """Drivers on a junction or the roads to it, and persons on foot there."""
        persons: dict[str, list[str]] = {}
        for person in self._persons():
            junction = self._junction(person)
            if junction:
                persons.setdefault(junction, []).append(person)
        for junction, on_foot in persons.items():
            there = {person: self._person_position(person) for person in on_foot}
            for road in self._roads_to(junction):
                for driver in self._on_edge(road):
                    if driver in self._roster.present:
                        yield from ((driver, person) for person in self._near(driver, there))

    def _junction(self, person: str) -> str:
        """Where a person crosses, or is about to; empty if nowhere."""
        place = self._person_road(person)
        if not place.startswith(":"):
            place = self._next_edge(person)
        junction, _, part = place.rpartition("_")
        return junction[1:] if junction.startswith(":") and part.startswith(_PLACES_ON_FOOT) else ""

    def _roads_to(self, junction: str) -> tuple[str, ...]:
        known = self._roads.get(junction)
        if known is None:
            roads: Iterable[str] = self._api.junction.getIncomingEdges(junction)
            on_foot = tuple(f":{junction}_{part}" for part in _PLACES_ON_FOOT)
            known = self._roads[junction] = tuple(road for road in roads if not road.startswith(on_foot))
        return known

    def _near(self, driver: str, persons: Mapping[str, _Point]) -> list[str]:
        """Those who are near enough to be yielded to, and far enough to be out of sight, or have been."""
        here, unseen = self._position(driver), self._unseen.of(driver)
        distances = {person: math.dist(here, there) for person, there in persons.items()}
        return [p for p, d in distances.items() if p in unseen or self._certainly_seen < d <= _FARTHEST_PERSON]

    def _sees(self, pairs: Sequence[tuple[str, str]], own_lamps: OwnLamps) -> list[bool]:
        """Whether each driver sees a person."""
        drivers, persons = dict(pairs), {person: None for _, person in pairs}
        own = zip(drivers, map(self._position, drivers), strict=True)
        eyes = {driver: (x, y, z + _BODY_MIDDLE) for driver, (x, y, z) in own}
        feet = zip(persons, map(self._person_position, persons), strict=True)
        bodies = {person: ((x, y, z + _BODY_MIDDLE), (x, y, z + _HEAD)) for person, (x, y, z) in feet}
        hidden = self._obstructions.hide([eyes[driver] for driver, _ in pairs], [bodies[person] for _, person in pairs])
        return [
            not is_hidden and self._sees_in_fog(driver, eyes[driver], bodies[person][0], own_lamps)
            for (driver, person), is_hidden in zip(pairs, hidden.tolist(), strict=True)
        ]

    def _sees_in_fog(self, driver: str, eyes: _Point, end: _Point, own_lamps: OwnLamps) -> bool:
        distance = math.dist(eyes, end)
        if distance <= self._seen_through_fog:
            return True
        lamps = head_lamp_light(own_lamps.get(driver, int(OTHERS_LAMPS)))
        bearing = math.atan2(end[1] - eyes[1], end[0] - eyes[0]) - math.radians(90.0 - self._angle(driver))
        share = lamps * _HEAD_LAMP_SHARE * head_lamp_share(math.remainder(bearing, math.tau))
        limit = self._sight.depth_limit(distance, _CONTRAST, 0.0, share)
        return float(self._fog.optical_depth(eyes, end)) <= limit

    def release(self) -> None:
        """Let everyone yield to every pedestrian again."""
        self._unseen.release(self._roster.present)
