"""Whether one vehicle's driver sees another vehicle, wherever it is and whichever side it shows."""

import itertools
import math
from collections.abc import Collection, Iterable, Mapping, Sequence
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
from fogsim.traffic.drivers.sight_kernels import (
    AHEAD,
    ASIDE,
    BEARING,
    END,
    EYES,
    FARTHEST_SIGHT,
    HIDDEN,
    IN_DOUBT,
    JUDGED,
    LINE,
    LINE_DEPTH,
    SEEN,
    TARGET_CONTRAST,
    draw_lines_of_sight,
)
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


_LINE_WIDTH = JUDGED + 1
_NO_PARTS = np.empty((0, 6))


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
        self.long: set[str] = set()
        """Vehicles whose bodies may bend."""

    def forget(self, vehicles: Iterable[str]) -> None:
        """Forget vehicles whose ids others may bear now."""
        for vehicle in vehicles:
            self._bodies.pop(vehicle, None)
            self._rows.pop(vehicle, None)
            self.long.discard(vehicle)

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
        if length > LONGEST_RIGID:
            self.long.add(vehicle)
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
        ends, sizes = np.array([(places[a], places[b]) for a, b in pairs]), [self._vehicles.body(b) for _, b in pairs]
        reaches = np.array([body.length + body.width for body in sizes])
        near = self._obstructions.are_near(ends[:, 0], ends[:, 1], reaches).tolist()
        hidden = dict.fromkeys(pairs, False)
        if any(near):
            those = list(itertools.compress(pairs, near))
            hidden.update(zip(those, self._are_hidden(those, places), strict=True))
        return list(map(hidden.__getitem__, pairs))

    def _are_hidden(self, pairs: Sequence[tuple[str, str]], places: Mapping[str, _Point]) -> list[bool]:
        """Whether all corners of each target are hidden, by where vehicles are [m]."""
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
    """What all parts of drivers' perception go by; `remote` if a call is a message, `obstructions` beside the roads."""

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


_Pairs = Sequence[tuple[str, str]]


class VehicleSight:
    """Finds which vehicles drivers see, along straight lines through fog and past roadside objects, not vehicles."""

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
        if self._extinction is None and (in_fog := self._is_in_fog(lines)).any():
            lines[in_fog, LINE_DEPTH] = self._fog.optical_depth(lines[in_fog, EYES:END], lines[in_fog, END:LINE])
        self._sight.judge_lines(lines, self._seen_through_fog, self._extinction)
        judged = lines[:, JUDGED]
        dazzling = {vehicle for vehicle, lit in own_lamps.items() if uses_high_beam(lit)} if own_lamps else ()
        if dazzling:
            judged[self._is_in_fog(lines) & [observer in dazzling for observer, _ in pairs]] = IN_DOUBT
        # Mostly the body is seen, whatever lamps are lit.
        doubtful = (judged == IN_DOUBT).nonzero()[0]
        if len(doubtful):
            those = [pairs[i] for i in doubtful.tolist()]
            judged[doubtful] = self._are_seen(those, lines[doubtful], own_lamps, dazzling)
        seen = judged == SEEN
        if self._hidden_vehicles is not None:
            seen &= ~np.array(self._hidden_vehicles.are_hidden(pairs))
        answer: list[bool] = seen.tolist()
        return answer

    def _is_in_fog(self, lines: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether fog may hide what lines of sight end at (n,)."""
        distance = lines[:, LINE]
        return np.asarray((distance > self._seen_through_fog) & (distance <= FARTHEST_SIGHT))

    def lines_of_sight(self, pairs: _Pairs) -> NDArray[np.float64]:
        """Straight lines (n, 13) from observers' eyes to targets; see `sight_kernels.draw_lines_of_sight`."""
        observers, targets = zip(*pairs, strict=True)
        both, count = observers + targets, len(pairs)
        flat = itertools.chain(itertools.chain.from_iterable(map(self._position, both)), map(self._angle, both))
        read, rows = np.fromiter(flat, np.float64, 8 * count), self._vehicles.rows(both)
        bent, lines = self._bend(targets, read), np.empty((count, _LINE_WIDTH))
        draw_lines_of_sight(self._vehicles.traits, rows, read, *bent, lines)
        return lines

    def _bend(self, targets: Sequence[str], read: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Straight parts (m, 6) of those bodies that bend, and where those of each target end (n,)."""
        counts, parts, vehicles = np.zeros(len(targets), np.int64), list[Part](), self._vehicles
        if vehicles.long.isdisjoint(targets):
            return _NO_PARTS, counts
        places, angles = read[: 6 * len(targets)].reshape(-1, 3), read[6 * len(targets) :]
        for n, target in enumerate(targets, len(targets)):
            if target in vehicles.long:
                x, y, z = places[n].tolist()
                own = self._bodies.parts(target, self.length(target), (x, y, z), math.radians(90.0 - angles[n]))
                counts[n - len(targets)], parts = len(own), parts + own
        return np.array([(*one.front, one.heading, one.behind, one.length) for one in parts]), counts.cumsum()

    def length(self, vehicle: str) -> float:
        """Length of a vehicle [m]; no part of it is farther from its front."""
        return self._vehicles.body(vehicle).length

    def _are_seen(
        self, pairs: _Pairs, lines: NDArray[np.float64], own_lamps: OwnLamps, dazzling: Collection[str]
    ) -> NDArray[np.float64]:
        """Judge by the lamps whether targets are seen through the fog (n,)."""
        looks, vehicles = np.empty((4, len(pairs))), self._vehicles
        looks[0], looks[1] = lines[:, LINE], lines[:, TARGET_CONTRAST]
        for n, ((observer, target), line) in enumerate(zip(pairs, lines.tolist(), strict=True)):
            lit = vehicles.lamps(target, own_lamps)
            looks[2, n] = intensity_toward(lit, vehicles.body(target).length, line[AHEAD], line[ASIDE])
            looks[3, n] = vehicles.head_lamps(observer, own_lamps) * head_lamp_share(line[BEARING])
        limits = self._sight.depth_limits(looks)
        for n, (observer, _) in enumerate(pairs) if dazzling else ():
            if observer in dazzling:
                known = self._extinction
                here = float(self._fog.extinction(lines[n, EYES:END])) if known is None else known
                distance, contrast, intensity, own = looks[:, n].tolist()
                limits[n] = self._sight.depth_limit(distance, contrast, intensity, own, high_beam_veil(here))
        return np.where(lines[:, LINE_DEPTH] <= limits, SEEN, HIDDEN)
