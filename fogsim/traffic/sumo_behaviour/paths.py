"""Vehicles and persons that a script moves along paths of their own, on and off the lanes."""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from fogsim.traffic.sumo.link import Api, is_off_lanes
from fogsim.values.script import FollowPath


@dataclass(frozen=True, slots=True)
class _Glide:
    """A move across the lane along half a wave of a cosine, from one offset to the left to another [m]."""

    begun: float
    duration: float
    first: float
    last: float

    def offset(self, time: float) -> float:
        """Offset at a time [m]."""
        share = min((time - self.begun) / self.duration, 1.0) if self.duration > 0.0 else 1.0
        return self.first + (0.5 - 0.5 * math.cos(math.pi * share)) * (self.last - self.first)


class LaneOffsets:
    """Moves vehicles within their lanes; SUMO keeps each where it is, also in the next lane."""

    def __init__(self, api: Api) -> None:
        self._api = api
        self._glides: dict[str, _Glide] = {}

    def begin(self, vehicle: str, offset: float, duration: float, time: float) -> None:
        """Begin a move to an offset to the left of the lane's middle [m]."""
        now = 0.0 if is_off_lanes(self._api, vehicle) else float(self._api.vehicle.getLateralLanePosition(vehicle))
        self._glides[vehicle] = _Glide(time, duration, now, offset)

    def play(self, time: float, present: Collection[str]) -> None:
        """Move those under way to where they are at a time [s]."""
        for vehicle, glide in list(self._glides.items()) if self._glides else ():
            if vehicle in present and not is_off_lanes(self._api, vehicle):
                self._api.vehicle.setLateralLanePosition(vehicle, glide.offset(time))
            if time >= glide.begun + glide.duration:
                del self._glides[vehicle]


_ANYWHERE = 2
"""SUMO's `keepRoute` for a vehicle that is exactly where it is put, on a lane or off the lanes."""

_LANES_FROM = 10_000.0
"""Distance from which SUMO looks for a lane [m]; at 0 none is found, and a vehicle is off the lanes."""

_NEAR, _EDGE = 50.0, 1.0
"""Distance up to which others are regarded, and beyond a lane up to which SUMO may take one for in it [m]."""

_UNCHECKED, _SUMO_DRIVES = 0, -1.0


class _Path:
    """A path under way: how far its vehicle has come [m], and how fast it is [m/s]."""

    def __init__(self, action: FollowPath, begun: float, speed: float) -> None:
        self.action, self.begun, self.speed, self.driven = action, begun, speed, 0.0
        self.aside = _Glide(begun, 0.0, 0.0, 0.0)
        points = np.array(action.points, dtype=np.float64)
        self._points, steps = points[:, :2], np.diff(points[:, :2], axis=0)
        self._ends = np.concatenate([[0.0], np.cumsum(np.hypot(steps[:, 0], steps[:, 1]))])
        # Who stands keeps the heading with which it came; a path of no length has that of its point.
        given = np.unwrap(points[:, 2])
        self._headings = None if np.isnan(given).any() else given
        self._steps = steps
        self.length = float(self._ends[-1])

    def move(self, time: float, step: float, wanted: float) -> None:
        """Move until a time [s], a step later, at a speed that is wanted [m/s]; ``inf`` for the present one."""
        before = self.driven
        if self.action.times:
            self.driven = float(np.interp(time - self.begun, self.action.times, self._ends))
            self.speed = (self.driven - before) / step
        else:
            self.speed = self.speed if math.isinf(wanted) else wanted
            self.driven = min(before + self.speed * step, self.length)
            if before >= self.length > 0.0:
                self.speed = 0.0

    def is_over(self, time: float, step: float) -> bool:
        """Whether its end is reached within a step after a time [s]."""
        if self.action.times:
            return time - self.begun >= self.action.times[-1]
        return self.driven + self.speed * step >= self.length

    def place(self, time: float, step: float) -> tuple[float, float, float]:
        """Where the front bumper is at a time [m], and the heading [rad]."""
        x, y = (float(np.interp(self.driven, self._ends, self._points[:, axis])) for axis in (0, 1))
        if self._headings is not None:
            heading = float(np.interp(self.driven, self._ends, self._headings))
        else:
            piece = min(int(np.searchsorted(self._ends, self.driven, side="right")), len(self._steps)) - 1
            heading = math.atan2(self._steps[piece, 1], self._steps[piece, 0])
        ahead, aside = self.action.ahead, self.aside.offset(time)
        x, y = x - aside * math.sin(heading), y + aside * math.cos(heading)
        if self.speed > 0.0:
            heading += math.atan2(aside - self.aside.offset(time - step), self.speed * step)
        return x + ahead * math.cos(heading), y + ahead * math.sin(heading), heading


class Paths:
    """Moves those on paths; who reaches the end along a lane drives on, and all others stay there."""

    def __init__(self, api: Api) -> None:
        self._api = api
        self._paths: dict[str, _Path] = {}
        self._modes: dict[str, int] = {}

    @property
    def vehicles(self) -> Collection[str]:
        """Who is on a path."""
        return self._paths.keys()

    def driven(self, vehicle: str) -> float | None:
        """How far one has come along its path [m], which SUMO does not count; None if it is on none."""
        path = self._paths.get(vehicle)
        return None if path is None else path.driven

    def begin(self, action: FollowPath, time: float, present: Collection[str]) -> bool:
        """Begin a path, unless SUMO knows no such vehicle; who is not on the road yet appears at its first point."""
        vehicle, get = action.vehicle, self._api.vehicle
        if not self._is_known(vehicle, present):
            return False
        speed = action.speed
        if vehicle in present and speed is None:
            earlier = self._paths.get(vehicle)
            speed = float(get.getSpeed(vehicle)) if earlier is None else earlier.speed
        if vehicle in present and vehicle not in self._paths:
            self._modes[vehicle] = int(get.getSpeedMode(vehicle))
            get.setSpeedMode(vehicle, _UNCHECKED)
        moved = action if action.origin == "map" else self._from_here(action)
        self._paths[vehicle] = _Path(moved, time, speed or 0.0)
        return True

    def _is_known(self, vehicle: str, present: Collection[str]) -> bool:
        """Whether one is on the road, or waits to come onto it."""
        return vehicle in present or vehicle in self._api.vehicle.getLoadedIDList()

    def _from_here(self, action: FollowPath) -> FollowPath:
        """The path with its points on the map."""
        (x, y), get = self._api.vehicle.getPosition(action.vehicle), self._api.vehicle
        heading = math.radians(90.0 - get.getAngle(action.vehicle))
        x, y = x - action.ahead * math.cos(heading), y - action.ahead * math.sin(heading)
        turn = heading if action.origin == "vehicle" else 0.0
        cosine, sine = math.cos(turn), math.sin(turn)
        points = ((x + u * cosine - v * sine, y + u * sine + v * cosine, h + turn) for u, v, h in action.points)
        return replace(action, points=tuple(points), origin="map")

    def play(self, time: float, step: float, speeds: Mapping[str, float], present: Collection[str]) -> None:
        """Move all for the step after a time [s]; `speeds` are those that they are to have [m/s]."""
        get = self._api.vehicle
        for vehicle, path in list(self._paths.items()):
            if not self._is_known(vehicle, present):
                self.leave(vehicle)
                continue
            wanted = speeds.get(vehicle, math.inf)
            # Who has come to stand there waits for a speed.
            waits = vehicle not in present or (path.speed == 0.0 and math.isinf(wanted))
            stays = waits or path.action.stays or is_off_lanes(self._api, vehicle)
            if path.is_over(time, step) and not stays:
                turn = self._turn(vehicle, path.place(time, step)[2])
                if math.cos(turn) > 0.0:
                    self._drive_on(vehicle, path, turn)
                    continue
            path.move(time + step, step, wanted)
            x, y, heading = path.place(time + step, step)
            aside = (
                vehicle in present and path.action.stays and self._is_passed(vehicle, (x, y), heading, step, present)
            )
            get.moveToXY(vehicle, "", -1, x, y, 90.0 - math.degrees(heading), _ANYWHERE, 0.0 if aside else _LANES_FROM)
            if vehicle in present:
                get.setPreviousSpeed(vehicle, path.speed)
                get.setSpeed(vehicle, path.speed)

    def _is_passed(
        self, vehicle: str, front: tuple[float, float], heading: float, step: float, present: Collection[str]
    ) -> bool:
        """Whether another vehicle passes in its lane without touching it, which SUMO would take for a collision."""
        get = self._api.vehicle
        length, width = float(get.getLength(vehicle)), float(get.getWidth(vehicle))
        middle = front[0] - 0.5 * length * math.cos(heading), front[1] - 0.5 * length * math.sin(heading)
        for other in present:
            (x, y), angle = get.getPosition(other), math.radians(90.0 - get.getAngle(other))
            if other == vehicle or math.dist((x, y), middle) > _NEAR or is_off_lanes(self._api, other):
                continue
            cosine, sine, turn = math.cos(angle), math.sin(angle), heading - angle
            ahead = (middle[0] - x) * cosine + (middle[1] - y) * sine
            left = (middle[1] - y) * cosine - (middle[0] - x) * sine
            along = 0.5 * (length * abs(math.cos(turn)) + width * abs(math.sin(turn)))
            across = 0.5 * (length * abs(math.sin(turn)) + width * abs(math.cos(turn)) + get.getWidth(other))
            gap = get.getMinGap(other) + get.getSpeed(other) * step
            from_middle = left + get.getLateralLanePosition(other)
            is_in_lane = abs(from_middle) <= 0.5 * self._api.lane.getWidth(get.getLaneID(other)) + _EDGE
            is_next_to = -get.getLength(other) - get.getMinGap(vehicle) < ahead + along < gap + 2.0 * along
            if is_in_lane and is_next_to and abs(left) >= across:
                return True
        return False

    def shift(self, vehicle: str, aside: float, duration: float, time: float) -> None:
        """Let one move to the left of its path [m], along half a wave of a cosine."""
        path = self._paths[vehicle]
        path.aside = _Glide(time, duration, path.aside.offset(time), aside)

    def leave(self, vehicle: str) -> None:
        """Forget one that leaves the road."""
        self._paths.pop(vehicle, None)
        self._modes.pop(vehicle, None)

    def _turn(self, vehicle: str, heading: float) -> float:
        """Angle from its lane to a heading [rad], to the left."""
        get = self._api.vehicle
        lane = self._api.lane.getAngle(get.getLaneID(vehicle), get.getLanePosition(vehicle))
        return heading - math.radians(90.0 - float(lane))

    def _drive_on(self, vehicle: str, path: _Path, turn: float) -> None:
        """Turn a vehicle into its lane, about the point that followed the path."""
        get = self._api.vehicle
        get.setPreviousSpeed(vehicle, path.speed)
        get.setLateralLanePosition(vehicle, get.getLateralLanePosition(vehicle) - path.action.ahead * math.sin(turn))
        self._end(vehicle)

    def _end(self, vehicle: str) -> None:
        del self._paths[vehicle]
        if vehicle in self._modes:
            self._api.vehicle.setSpeed(vehicle, _SUMO_DRIVES)
            self._api.vehicle.setSpeedMode(vehicle, self._modes.pop(vehicle))

    def release(self, present: Collection[str]) -> None:
        """Let all go."""
        for vehicle in self._paths.keys() & set(present):
            self._end(vehicle)
        self._paths.clear()
