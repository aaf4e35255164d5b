"""Tunnels that keep fog out, as pictures see them."""

import functools
import math

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.fog.shelter_kernels import find_pixels_within
from fogsim.obstruction import Obstructions, Tunnel
from fogsim.values import Camera, CameraPose, FogShelter, View
from fogsim.values.pinhole import ray_from_pixel


def is_sheltered(shelters: tuple[FogShelter, ...], place: tuple[float, float, float]) -> bool:
    """Whether a place is in a tunnel (`place` [m])."""
    above = (place[0], place[1], place[2] + 0.01)
    return bool(Obstructions(_boxes(shelters)).way_through([place], [above])[0] > 0.0)


def sheltered_pixels(
    shelters: tuple[FogShelter, ...], view: View, camera: Camera, pose: CameraPose
) -> NDArray[np.bool_]:
    """Pixels whose rays pass through a tunnel before they end (rows, cols)."""
    distance, rays = np.ascontiguousarray(view.distance, np.float32), ray_from_pixel(camera, pose)
    within = np.zeros(distance.shape, np.bool_)
    find_pixels_within(distance, rays, np.array(pose.position, np.float64), _portals(shelters), within)
    return within


@functools.lru_cache(maxsize=8)
def _boxes(shelters: tuple[FogShelter, ...]) -> NDArray[np.float64]:
    return np.concatenate([Tunnel(np.array(one.line), one.half_width, one.height).boxes() for one in shelters])


@functools.lru_cache(maxsize=8)
def _portals(shelters: tuple[FogShelter, ...]) -> NDArray[np.float64]:
    """Where each tunnel begins and ends (2 n, 7); see `find_pixels_within`."""
    rows = list[tuple[float, ...]]()
    for one in shelters:
        for (x, y, z), (inner_x, inner_y, _) in (one.line[:2], one.line[:-3:-1]):
            length = math.hypot(inner_x - x, inner_y - y)
            rows.append((x, y, z, (inner_x - x) / length, (inner_y - y) / length, one.half_width, one.height))
    return np.array(rows)
