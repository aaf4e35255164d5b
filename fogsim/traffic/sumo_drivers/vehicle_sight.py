"""Whether one vehicle's driver sees another vehicle, wherever it is and whichever side it shows."""

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.drivers.lamp_intensity import head_lamp_share, intensity_toward
from fogsim.traffic.drivers.own_beams import high_beam_veil, uses_high_beam
from fogsim.traffic.drivers.sight_kernels import AHEAD, ASIDE, BEARING, END, EYES, LINE, draw_lines_of_sight
from fogsim.traffic.sumo_drivers.seen_vehicles import DriversView, OwnLamps
from fogsim.traffic.sumo_lanes.long_bodies import LONGEST_RIGID, LongBodies

_FARTHEST = 2000.0
"""No one is seen farther away than this [m]; a vehicle that is teleported is nowhere."""

_Pairs = Sequence[tuple[str, str]]


class VehicleSight:
    """Finds which vehicles drivers see, along straight lines through the fog and past what stands next to the road.

    Other vehicles hide no one.
    """

    def __init__(self, view: DriversView) -> None:
        self._hidden_vehicles = view.hidden_vehicles
        self._fog, self._sight, self._vehicles, self._extinction = view.fog, view.sight, view.vehicles, view.extinction
        self._position, self._angle = view.getters("getPosition3D", "getAngle")
        self._bodies = LongBodies(view.api)
        self._seen_through_fog = view.sight.sure_distance(view.fog.maximum_extinction)

    @property
    def certainly_seen(self) -> float:
        """Distance up to which every vehicle is seen, wherever it is and whatever its lamps [m]."""
        return self._seen_through_fog if self._hidden_vehicles is None else 0.0

    def sees(self, pairs: _Pairs, own_lamps: OwnLamps) -> list[bool]:
        """Whether each observer sees its target."""
        if not pairs:
            return []
        lines = self.lines_of_sight(pairs)
        distance = lines[:, LINE]
        seen = distance <= self._seen_through_fog
        doubtful = np.flatnonzero(~seen & (distance <= _FARTHEST))
        if len(doubtful):
            seen[doubtful] = self._are_seen([pairs[n] for n in doubtful.tolist()], lines[doubtful], own_lamps)
        if self._hidden_vehicles is not None:
            seen &= ~np.array(self._hidden_vehicles.are_hidden(pairs))
        answer: list[bool] = seen.tolist()
        return answer

    def lines_of_sight(self, pairs: _Pairs) -> NDArray[np.float64]:
        """Straight lines (n, 10) from observers' eyes to targets; see `sight_kernels.draw_lines_of_sight`."""
        observers, targets = zip(*pairs, strict=True)
        both = observers + targets
        place = {vehicle: i for i, vehicle in enumerate(dict.fromkeys(both))}
        read, count = np.empty((len(place), 7)), len(place)
        flat = itertools.chain.from_iterable(map(self._position, place))
        read[:, :3] = np.fromiter(flat, np.float64, 3 * count).reshape(-1, 3)
        read[:, 3] = np.radians(90.0 - np.fromiter(map(self._angle, place), np.float64, count))
        _, _, eyes, length, width, _, _ = self._vehicles.traits(place).T
        read[:, 4], read[:, 5], read[:, 6] = eyes, length, width
        rows = np.array([place[v] for v in both], dtype=np.int64).reshape(2, -1)
        observing, parts, ends = read[rows[0], :5], read[rows[1]], np.arange(1, len(pairs) + 1)
        if length.max() > LONGEST_RIGID:
            parts, ends = self._bend(targets, parts)
        else:
            parts[:, 4] = 0.0
        lines = np.empty((len(pairs), 10))
        draw_lines_of_sight(observing, parts, ends, lines)
        return lines

    def _bend(
        self, targets: Sequence[str], bodies: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Straight parts (m, 7) of bodies, and where those of each end (n,)."""
        parts, ends = list[tuple[float, ...]](), list[int]()
        for target, (x, y, z, heading, _, length, width) in zip(targets, bodies.tolist(), strict=True):
            for part in self._bodies.parts(target, length, (x, y, z), heading):
                parts.append((*part.front, part.heading, part.behind, part.length, width))
            ends.append(len(parts))
        return np.array(parts), np.array(ends)

    def length(self, vehicle: str) -> float:
        """Length of a vehicle [m]; no part of it is farther from its front."""
        return self._vehicles.body(vehicle).length

    def _are_seen(self, pairs: _Pairs, lines: NDArray[np.float64], own_lamps: OwnLamps) -> NDArray[np.bool_]:
        """Whether targets are seen through the fog (n,)."""
        vehicles, looks = self._vehicles, np.empty((4, len(pairs)))
        looks[0] = lines[:, LINE]
        for n, ((observer, target), line) in enumerate(zip(pairs, lines.tolist(), strict=True)):
            body = vehicles.body(target)
            looks[1, n] = body.contrast
            looks[2, n] = intensity_toward(vehicles.lamps(target, own_lamps), body.length, line[AHEAD], line[ASIDE])
            looks[3, n] = vehicles.head_lamps(observer, own_lamps) * head_lamp_share(line[BEARING])
        limits = self._sight.depth_limits(looks)
        eyes, known = np.ascontiguousarray(lines[:, EYES:END]), self._extinction
        for n, (observer, _) in enumerate(pairs) if own_lamps else ():
            if uses_high_beam(own_lamps.get(observer, 0)):
                glare = high_beam_veil(float(self._fog.extinction(eyes[n])) if known is None else known)
                distance, contrast, intensity, own = looks[:, n].tolist()
                limits[n] = self._sight.depth_limit(distance, contrast, intensity, own, glare)
        ends = np.ascontiguousarray(lines[:, END:LINE])
        depths = self._fog.optical_depth(eyes, ends) if known is None else known * looks[0]
        return np.asarray(depths <= limits)
