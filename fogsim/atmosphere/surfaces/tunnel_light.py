"""Light in tunnels: what of the daylight gets in, and lamps under the ceiling."""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.surfaces.tunnel_light_kernels import (
    BEFORE,
    STEP,
    Luminaires,
    TunnelSpace,
    daylight_share,
    light_pixels,
)
from fogsim.obstruction import Tunnel
from fogsim.values import Camera, CameraPose, View
from fogsim.values.pinhole import ray_from_pixel

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
    """

    def __init__(self, tunnels: Sequence[Tunnel], sky_illuminance: float) -> None:
        self._lit = [_space_and_lamps(tunnel, sky_illuminance) for tunnel in tunnels]
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
        for space, lamps in self._lit:
            light_pixels(radiance, np.ascontiguousarray(own, np.float32), distance, rays, eye, space, lamps)
        return dataclasses.replace(view, radiance=radiance)


def _space_and_lamps(tunnel: Tunnel, sky_illuminance: float) -> tuple[TunnelSpace, Luminaires]:
    boxes = tunnel.boxes()
    stations = np.concatenate([[0.0], np.cumsum(boxes[:-1, 6])])
    # What a lamp sends out, to all sides alike, lights its part of the road.
    flux = LAMPS_ON_ROAD * _SPACING * 2.0 * tunnel.half_width / _UTILANCE
    lamps = Luminaires(
        LAMPS_ON_ROAD / sky_illuminance, flux / (math.pi * _SIZE * _WIDTH), _SPACING, _SIZE, 0.5 * _WIDTH
    )
    length = float(boxes[:, 6].sum())
    places = np.arange(-BEFORE, length + BEFORE + 2.0 * STEP, STEP)
    daylight = np.array([daylight_share(place, length, boxes[0, 7], boxes[0, 9]) for place in places.tolist()])
    return TunnelSpace(boxes, stations, length, daylight), lamps
