"""Light in tunnels: what of the daylight gets in, and lamps under the ceiling."""

import dataclasses
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.fog.medium import FARTHEST, ray
from fogsim.core.jit import kernel
from fogsim.values import Camera, CameraPose, View
from fogsim.values.obstruction import Tunnel
from fogsim.values.pinhole import ray_from_pixel

_Array = NDArray[np.float64]
_Picture = NDArray[np.float32]

_CEILING = 0.12
"""What is no farther than this below the upper face of a tunnel's space is its ceiling [m]."""

BEFORE = 40.0
"""Farther before a portal than this, a tunnel takes less than a thousandth of the sky's light from the road [m]."""

STEP = 0.05
"""Spacing of the points at which daylight is computed; it is interpolated in between [m]."""

_UNDER_CEILING = 0.25
"""What a ceiling gets of the road's light, over what renderers give undersides [-]: a tenth, which the road returns."""


class _TunnelSpace(NamedTuple):
    """A tunnel, as kernels read it."""

    boxes: NDArray[np.float64]  # (m, 10): Its space, in order along it
    stations: NDArray[np.float64]  # (m,): Where along it each box begins [m]
    length: float  # Length from portal to portal [m]
    # (n,): Share of the sky's light each `STEP` along it, from `BEFORE` before it to as far beyond it [-]
    daylight: NDArray[np.float64]


class _Luminaires(NamedTuple):
    """Lamps in a row under the ceiling."""

    illuminance: float  # What they give the road, over what the sky gives it outside [-]
    luminance: float  # Of each of them [cd/m²]
    # spacing, size, half_width: from one to the next, how long each is, and half its width [m]
    spacing: float
    size: float
    half_width: float


@kernel
def sky_share(distance: float, half_width: float, height: float) -> float:
    """Share of an even sky's light that comes through a portal to the road before or behind it [-].

    The configuration factor from a small level surface to an upright rectangle that stands on its plane, centred before
    it, in its closed form.

    Takes `distance` [m], `half_width`, `height` [m].
    """
    if distance <= 0.0:
        return 0.5
    slanted = math.sqrt(distance * distance + height * height)
    return (math.atan(half_width / distance) - distance / slanted * math.atan(half_width / slanted)) / math.pi


@kernel
def daylight_share(station: float, length: float, half_width: float, height: float) -> float:
    """Share of the sky's light on a road in a tunnel, or before it [-].

    Takes `station` [m], `length` [m], `half_width`, `height` [m].
    """
    if station < 0.0:
        return 1.0 - sky_share(-station, half_width, height)
    if station > length:
        return 1.0 - sky_share(station - length, half_width, height)
    return sky_share(station, half_width, height) + sky_share(length - station, half_width, height)


@kernel
def _place_in(space: _TunnelSpace, x: float, y: float, z: float) -> tuple[int, float, float, float]:
    """Box in which, or before which, a place is, or −1; and where it is along it, across it and above it [m]."""
    last = len(space.boxes) - 1
    for number in range(last + 1):
        box = space.boxes[number]
        east, north = x - box[0], y - box[1]
        along, across = east * box[3] + north * box[4], north * box[3] - east * box[4]
        low = -BEFORE if number == 0 else 0.0
        high = box[6] + (BEFORE if number == last else 0.0)
        above = z - box[2] - box[5] * along
        if low <= along <= high and abs(across) <= box[7] and box[8] < above < box[9]:
            return number, along, across, above
    return -1, 0.0, 0.0, 0.0


@kernel
def _light_pixels(
    radiance: _Picture,
    own: _Picture,
    distance: _Picture,
    rays: _Array,
    eye: _Array,
    space: _TunnelSpace,
    lamps: _Luminaires,
) -> None:
    """Light what is seen of a tunnel and of the road before its portals, in place.

    Takes `radiance` (rows, cols, 3) [cd/m²], `own` (rows, cols, 3) [cd/m²], `distance` (rows, cols) [m], `rays` (3, 3),
    `eye` (3,) [m].
    """
    for v in range(distance.shape[0]):
        for u in range(distance.shape[1]):
            reach = float(distance[v, u])
            if not reach < FARTHEST:
                continue
            a, b, c = ray(rays, u, v)
            number, along, across, above = _place_in(space, eye[0] + a * reach, eye[1] + b * reach, eye[2] + c * reach)
            if number < 0:
                continue
            box, station = space.boxes[number], space.stations[number] + along
            place = (station + BEFORE) / STEP
            step = int(place)
            share = space.daylight[step] + (space.daylight[step + 1] - space.daylight[step]) * (place - step)
            if 0.0 <= station <= space.length:
                share += lamps.illuminance
                if above > box[9] - _CEILING:
                    if station % lamps.spacing < lamps.size and abs(across) < lamps.half_width:
                        radiance[v, u, :] = lamps.luminance
                        continue
                    share *= _UNDER_CEILING
            for channel in range(3):
                shining = own[v, u, channel]
                radiance[v, u, channel] = shining + (radiance[v, u, channel] - shining) * share


LAMPS_ON_ROAD = 150.0
"""Illuminance that the lamps of a tunnel give its road [lx]: 4 cd/m² on asphalt; FogSim's choice."""

_SPACING, _SIZE, _WIDTH = 8.0, 1.2, 0.3
"""From one lamp to the next, and length and width of each [m]."""

_UTILANCE = 0.6
"""Share of the lamps' light that comes to the road [-]."""


class TunnelLight:
    """Lights what a camera sees of tunnels.

    A surface in a tunnel gets, of the light of the whole sky, the share that the road next to it gets through the
    portals (`sky_share`), whichever way it faces, and the light of lamps in a row under the ceiling. Light that walls
    and road pass on is left out, as is the brighter lighting of an entrance zone.

    Parameters
    ----------
    tunnels : sequence of Tunnel
        The tunnels.
    sky_illuminance : float
        Horizontal illuminance of the daylight outside [lx], positive.

    Attributes
    ----------
    sky_illuminance : float
        The daylight outside [lx]; another one from when it is set.
    """

    def __init__(self, tunnels: Sequence[Tunnel], sky_illuminance: float) -> None:
        self.sky_illuminance = sky_illuminance
        self._lit = [_space_and_lamps(tunnel) for tunnel in tunnels]
        boxes = [space.boxes for space, _ in self._lit]
        self._boxes: NDArray[np.float64] = np.concatenate(boxes) if boxes else np.zeros((0, 10))

    def is_seen_by(self, pose: CameraPose, reach: float = 2000.0) -> bool:
        """Whether a camera is near enough for any tunnel to matter in its picture.

        Parameters
        ----------
        pose : CameraPose
            Where it is.
        reach : float
            Tunnels beyond this are small in it [m].
        """
        if not len(self._boxes):
            return False
        near = self._boxes[:, :2] - np.array(pose.position[:2])
        return bool(np.any(np.hypot(near[:, 0], near[:, 1]) < reach + self._boxes[:, 6]))

    def on(self, view: View, own: NDArray[np.float32], camera: Camera, pose: CameraPose) -> View:
        """A drawn scene as it is lit.

        Parameters
        ----------
        view : View
            The scene in the sky's light everywhere.
        own : (rows, cols, 3) float32
            What surfaces shine by themselves [cd/m²].
        camera, pose : Camera, CameraPose
            The camera.
        """
        radiance = np.array(view.radiance, np.float32)
        distance, rays = np.ascontiguousarray(view.distance, np.float32), ray_from_pixel(camera, pose)
        eye = np.array(pose.position, np.float64)
        for space, lamps_by_lux in self._lit:
            lamps = lamps_by_lux._replace(illuminance=lamps_by_lux.illuminance / self.sky_illuminance)
            _light_pixels(radiance, np.ascontiguousarray(own, np.float32), distance, rays, eye, space, lamps)
        return dataclasses.replace(view, radiance=radiance)


def _space_and_lamps(tunnel: Tunnel) -> tuple[_TunnelSpace, _Luminaires]:
    """A tunnel, and its lamps under a sky that gives 1 lx."""
    boxes = tunnel.boxes()
    stations = np.concatenate([[0.0], np.cumsum(boxes[:-1, 6])])
    # What a lamp sends out, to all sides alike, lights its part of the road.
    flux = LAMPS_ON_ROAD * _SPACING * 2.0 * tunnel.half_width / _UTILANCE
    lamps = _Luminaires(LAMPS_ON_ROAD, flux / (math.pi * _SIZE * _WIDTH), _SPACING, _SIZE, 0.5 * _WIDTH)
    length = float(boxes[:, 6].sum())
    places = np.arange(-BEFORE, length + BEFORE + 2.0 * STEP, STEP)
    daylight = np.array([daylight_share(place, length, boxes[0, 7], boxes[0, 9]) for place in places.tolist()])
    return _TunnelSpace(boxes, stations, length, daylight), lamps
