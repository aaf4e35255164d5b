"""Whether one vehicle's driver sees another vehicle, wherever it is and whichever side it shows."""

import itertools
import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.appearance import OTHERS_LAMPS, body_kind, eye_height, lamps_from_signals, paint
from fogsim.traffic.drivers.lamp_intensity import (
    head_lamp_light,
    head_lamp_share,
    high_beam_veil,
    intensity_toward,
    uses_high_beam,
)
from fogsim.traffic.drivers.sight import DriverSight, FogAccess, inherent_contrast
from fogsim.traffic.drivers.sight_kernels import AHEAD, ASIDE, BEARING, END, EYES, LINE, draw_lines_of_sight
from fogsim.traffic.sumo.claims import SOLE_SESSION
from fogsim.traffic.sumo.link import Api, Getter, vehicle_getter, vehicle_getters
from fogsim.traffic.sumo.roster import Roster
from fogsim.traffic.sumo_lanes.long_bodies import LONGEST_RIGID, LongBodies, Part
from fogsim.values.light import MIDDLE_LAMPS, Side, dark_on
from fogsim.values.obstruction import CLEAR_SIGHT, Obstructions

OwnLamps = dict[str, int]
"""Lamps, as `TrafficState.lamps` has them, of vehicles whose lamps are not SUMO's; with the sides that have failed."""

_Point = tuple[float, float, float]

_NO_THIRD_STOP_LAMP = frozenset({"truck", "motorcycle"})
"""Body kinds without a stop lamp in the middle next to two others."""

_CORNERS = np.array(list(itertools.product((-1.0, 0.0), (-0.5, 0.5), (0.5, 1.0))))
"""From the middle of the front bumper ahead, to the left and up, in lengths, widths and heights."""


class _SeenBody(NamedTuple):
    """A vehicle's body, and how its driver sits in it."""

    minimum_gap: float  # The driver's [m]
    contrast: float  # To the airlight without fog between, 0 … 1
    eye_height: float  # Of the driver's eyes above the road [m]
    # length, width, height: [m]
    length: float
    width: float
    height: float
    missing: int  # Bits of sides on which there is no lamp


_CONTRAST, _EYES_TO_WIDTH = 1, slice(2, 5)
"""Columns of bodies in an array."""

_OF_TARGET = 10
"""Column of lines of sight, after those that kernels draw: the target's contrast."""


class _SeenVehicles:
    """Bodies, each read once, and lit lamps of vehicles."""

    def __init__(self, api: Api, remote: bool, airlight_share: float) -> None:
        self._airlight_share = airlight_share
        (self._signals,) = vehicle_getters(api, remote, ("getSignals",))
        names = ("getColor", "getMinGap", "getLength", "getWidth", "getHeight", "getVehicleClass", "getShapeClass")
        self._getters = tuple(vehicle_getter(api, name) for name in names)
        self._bodies: dict[str, _SeenBody] = {}
        self._rows: dict[str, int] = {}
        self.traits = np.empty((64, len(_SeenBody._fields)))
        """A row for each body, in the order of the fields of `_SeenBody`; another array once it has grown."""
        self._count = 0

    def forget(self, vehicles: Iterable[str]) -> None:
        """Forget vehicles whose ids others may bear now."""
        for vehicle in vehicles:
            self._bodies.pop(vehicle, None)
            self._rows.pop(vehicle, None)

    def body(self, vehicle: str) -> _SeenBody:
        """Body of a vehicle."""
        return self._bodies.get(vehicle) or self._read(vehicle)

    def rows(self, vehicles: Sequence[str]) -> NDArray[np.intp]:
        """Rows of vehicles in `traits` (n,)."""
        try:
            return np.fromiter(map(self._rows.__getitem__, vehicles), np.intp, len(vehicles))
        except KeyError:
            for vehicle in set(vehicles).difference(self._rows):
                self._read(vehicle)
            return self.rows(vehicles)

    def _read(self, vehicle: str) -> _SeenBody:
        colour, gap, length, width, height, vehicle_class, shape = (get(vehicle) for get in self._getters)
        contrast = inherent_contrast(paint(vehicle, colour), self._airlight_share)
        kind = body_kind(vehicle_class, shape, length)
        missing = dark_on(int(MIDDLE_LAMPS), Side.MIDDLE) if kind in _NO_THIRD_STOP_LAMP else 0
        eyes = eye_height(vehicle_class, shape, length)
        body = _SeenBody(gap, contrast, eyes, length, width, height, missing)
        row = self._rows[vehicle] = self._count
        self._count += 1
        if row == len(self.traits):
            self.traits = np.concatenate((self.traits, np.empty_like(self.traits)))
        self.traits[row] = self._bodies[vehicle] = body
        return body

    def lamps(self, vehicle: str, own_lamps: OwnLamps) -> int:
        """Lit lamps of a vehicle, with sides that are dark."""
        own = own_lamps.get(vehicle)
        usual = lamps_from_signals(self._signals(vehicle))
        return usual | int(OTHERS_LAMPS) if own is None else usual | own | self.body(vehicle).missing

    @staticmethod
    def head_lamps(vehicle: str, own_lamps: OwnLamps) -> float:
        """Light of a vehicle's head lamps over that of low beams [-]; SUMO's vehicles have these, by `OTHERS_LAMPS`."""
        own = own_lamps.get(vehicle)
        return 1.0 if own is None else head_lamp_light(own)


class _HiddenVehicles:
    """Finds vehicles hidden by obstructions: no corner of the body is in sight, neither halfway up nor at the top."""

    def __init__(self, api: Api, vehicles: _SeenVehicles, obstructions: Obstructions, remote: bool) -> None:
        self._obstructions = obstructions
        self._vehicles = vehicles
        self._position, self._angle = vehicle_getters(api, remote, ("getPosition3D", "getAngle"))
        self._bodies = LongBodies(api)

    def are_hidden(self, pairs: Sequence[tuple[str, str]]) -> list[bool]:
        """Whether each observer's target is hidden, however clear the air is (`pairs` (str, str))."""
        if not pairs:
            return []
        # Mostly who leads one follows another.
        places = {vehicle: self._position(vehicle) for pair in pairs for vehicle in pair}
        angles = {target: math.radians(90.0 - self._angle(target)) for _, target in pairs}
        bodies = [self._vehicles.body(target) for _, target in pairs]
        parts = [
            self._bodies.parts(t, body.length, places[t], angles[t]) for (_, t), body in zip(pairs, bodies, strict=True)
        ]
        eyes = np.array([places[observer] for observer, _ in pairs])
        eyes[:, 2] += [self._vehicles.body(observer).eye_height for observer, _ in pairs]
        counts = [len(own) for own in parts]
        sizes = [
            (part.length, body.width, body.height) for body, own in zip(bodies, parts, strict=True) for part in own
        ]
        corners = _corners(list(itertools.chain.from_iterable(parts)), np.array(sizes))
        hidden = self._obstructions.hide(eyes.repeat(counts, axis=0), corners)
        each: list[bool] = np.logical_and.reduceat(hidden, np.cumsum([0, *counts[:-1]])).tolist()
        return each


def _corners(parts: Sequence[Part], sizes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Corners of parts of bodies (n, 8, 3) [m]; the lower ones are halfway up."""
    heading = np.array([part.heading for part in parts])
    forward = np.stack([np.cos(heading), np.sin(heading)], axis=1)[:, None]
    left = forward[..., ::-1] * (-1.0, 1.0)
    offsets = sizes[:, None] * _CORNERS
    corners = np.array([part.front for part in parts])[:, None] + np.zeros((1, len(_CORNERS), 1))
    corners[..., :2] += offsets[..., :1] * forward + offsets[..., 1:2] * left
    corners[..., 2] += offsets[..., 2]
    return corners


class DriversView:
    """What all parts of drivers' perception go by.

    Takes `remote`, true where every call is a message to another process, and `obstructions`, what stands next to the
    roads.
    """

    def __init__(
        self,
        api: Api,
        fog: FogAccess,
        sight: DriverSight,
        roster: Roster,
        session: str = SOLE_SESSION,
        remote: bool = False,
        obstructions: Obstructions = CLEAR_SIGHT,
    ) -> None:
        self.api, self.fog, self.sight, self.roster = api, fog, sight, roster
        self.session, self.remote, self.obstructions = session, remote, obstructions
        self.extinction = fog.maximum_extinction if fog.minimum_extinction == fog.maximum_extinction else None
        """Extinction coefficient of fog that is the same everywhere [1/m]; None of other fog."""
        self.vehicles = _SeenVehicles(api, remote, sight.airlight_share)
        self.hidden_vehicles = _HiddenVehicles(api, self.vehicles, obstructions, remote) if obstructions else None

    def getters(self, *names: str) -> tuple[Getter, ...]:
        """Getters of what is asked of vehicles often."""
        return vehicle_getters(self.api, self.remote, names)


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
        doubtful = (~seen & (distance <= _FARTHEST)).nonzero()[0]
        if len(doubtful):
            seen[doubtful] = self._are_seen([pairs[i] for i in doubtful.tolist()], lines[doubtful], own_lamps)
        if self._hidden_vehicles is not None:
            seen &= ~np.array(self._hidden_vehicles.are_hidden(pairs))
        answer: list[bool] = seen.tolist()
        return answer

    def lines_of_sight(self, pairs: _Pairs) -> NDArray[np.float64]:
        """Straight lines (n, 11) from observers' eyes to targets; see `sight_kernels.draw_lines_of_sight`."""
        observers, targets = zip(*pairs, strict=True)
        both, count = observers + targets, len(pairs)
        read, lines, rows = np.empty((2 * count, 7)), np.empty((count, _OF_TARGET + 1)), self._vehicles.rows(both)
        traits = self._vehicles.traits[rows]
        flat = itertools.chain.from_iterable(map(self._position, both))
        read[:, :3] = np.fromiter(flat, np.float64, 6 * count).reshape(-1, 3)
        read[:, 3] = np.radians(90.0 - np.fromiter(map(self._angle, both), np.float64, 2 * count))
        read[:, 4:], lines[:, _OF_TARGET] = traits[:, _EYES_TO_WIDTH], traits[count:, _CONTRAST]
        bodies, ends = read[count:], np.arange(1, count + 1)
        bodies[:, 4] = 0.0
        if (bodies[:, 5] > LONGEST_RIGID).any():
            bodies, ends = self._bend(targets, bodies)
        draw_lines_of_sight(read[:count], bodies, ends, lines)
        return lines

    def _bend(
        self, targets: Sequence[str], bodies: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Straight parts (m, 7) of bodies, and where those of each end (n,)."""
        counts, bent = np.ones(len(targets), np.int64), dict[int, list[Part]]()
        for n in np.flatnonzero(bodies[:, 5] > LONGEST_RIGID).tolist():
            x, y, z, heading, _, length, _ = bodies[n].tolist()
            bent[n] = self._bodies.parts(targets[n], length, (x, y, z), heading)
            counts[n] = len(bent[n])
        parts, ends = bodies.repeat(counts, axis=0), counts.cumsum()
        for n, own in bent.items():
            first = ends[n] - counts[n]
            parts[first : ends[n], :6] = [(*one.front, one.heading, one.behind, one.length) for one in own]
        return parts, ends

    def length(self, vehicle: str) -> float:
        """Length of a vehicle [m]; no part of it is farther from its front."""
        return self._vehicles.body(vehicle).length

    def _are_seen(self, pairs: _Pairs, lines: NDArray[np.float64], own_lamps: OwnLamps) -> NDArray[np.bool_]:
        """Whether targets are seen through the fog (n,)."""
        eyes, looks, known = lines[:, EYES:END], np.zeros((4, len(pairs))), self._extinction
        looks[0], looks[1] = lines[:, LINE], lines[:, _OF_TARGET]
        depths = self._fog.optical_depth(eyes, lines[:, END:LINE]) if known is None else known * looks[0]
        # Mostly the body is seen, whatever lamps are lit.
        seen = np.asarray(depths <= self._sight.depth_limits(looks))
        dazzling = {vehicle for vehicle, lit in own_lamps.items() if uses_high_beam(lit)} if own_lamps else ()
        if dazzling:
            seen &= [observer not in dazzling for observer, _ in pairs]
        doubtful = (~seen).nonzero()[0]
        if len(doubtful):
            looks, vehicles, rows = np.take(looks, doubtful, axis=1), self._vehicles, doubtful.tolist()
            for n, (row, line) in enumerate(zip(rows, lines[doubtful].tolist(), strict=True)):
                (observer, target), toward = pairs[row], (line[AHEAD], line[ASIDE])
                lit = vehicles.lamps(target, own_lamps)
                looks[2, n] = intensity_toward(lit, vehicles.body(target).length, *toward)
                looks[3, n] = vehicles.head_lamps(observer, own_lamps) * head_lamp_share(line[BEARING])
            limits = self._sight.depth_limits(looks)
            for n, row in enumerate(rows) if dazzling else ():
                if pairs[row][0] in dazzling:
                    glare = high_beam_veil(float(self._fog.extinction(eyes[row])) if known is None else known)
                    distance, contrast, intensity, own = looks[:, n].tolist()
                    limits[n] = self._sight.depth_limit(distance, contrast, intensity, own, glare)
            seen[doubtful] = depths[doubtful] <= limits
        return seen
