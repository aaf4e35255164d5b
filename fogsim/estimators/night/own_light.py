"""Where the light of the own head lamps is measured in an image, and what a camera sees of it in any fog."""

import functools
import itertools
import math
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.core.parameters import FileName
from fogsim.values.camera import Camera, Response
from fogsim.values.light import Lamp
from fogsim.values.observation import Observation
from fogsim.values.pinhole import OWN_FRAME, camera_axes, ray_from_pixel
from fogsim.vision.light.pixel_kernels import Pixels

_HEAD_LAMPS = Lamp.LOW_BEAM | Lamp.HIGH_BEAM | Lamp.FRONT_FOG
"""Lamps that throw light ahead."""

_Known = Literal["usual", "unknown"]
HeadLamps = _Known | FileName
"""A car's head lamps, low beams of any pattern, or a file of lamps."""

KNOWN_HEAD_LAMPS: tuple[str, ...] = get_args(_Known)
"""Names of head lamps: a car's, and low beams of any pattern; every other name is that of a file."""

_USUAL_SETBACK = 1.9
"""Distance of the camera behind the front bumper where no vehicle reports it [m]."""

VISIBILITIES = np.geomspace(8.0, 10_000.0, 37)
"""Meteorological visibilities of the model, in equal steps of ln V [m]."""

SKY = np.radians(np.geomspace(0.7, 18.0, 11)), np.radians((-12.0, -6.0, 0.0, 6.0, 12.0)), math.radians(2.0)
"""Elevations between which the fog above the road is measured, azimuths of the columns, half of their width [rad]."""

_ROAD = np.radians(np.geomspace(0.55, 10.5, 13)), (-0.9, 0.0, 0.9), 0.35
"""Angles below the horizon between which the road is measured [rad]; middles of the strips and half their width [m]."""

SUB_ROWS = 3
"""Rows of a cell for which the model is computed: near the horizon neither veil nor road is linear in a cell."""

_PITCH_STEP, _HALF_FIELD_STEP = math.radians(0.25), math.radians(0.5)
"""Steps of the pitch and of half the field of view, so that cameras that differ little share a calibration [rad]."""

_LEAST_DARK, _MOST_DARK = 0.01, 0.95
"""Share of a cell's pixels that read no light from which on noise is cut off, and the largest that is used [-]."""

FORGOTTEN = 5.0
"""Time without a frame after which those before it show other fog [s]."""

_LEAST_SEEN = 0.6
"""Share of a cell that must be inside the image [-]."""


class Cells(NamedTuple):
    """Rectangles of an image, and where they look."""

    box: NDArray[np.int64]  # (n, 4) int64: First and last row and column + 1 of each [px]
    rays: NDArray[np.float64]  # Unit vectors forward, left and up to the middles of the sub-rows, by the assumed pitch
    is_sky: NDArray[np.bool_]  # (n,) bool: Whether a cell is above the horizon


@dataclass(frozen=True, slots=True, eq=False)
class OwnLight:
    """What the own head lamps light, for draws of all that an estimator does not know about lamps, fog and road."""

    # veil, road (draws, visibilities, cells): luminance of the lit fog before road and sky, and of the lit road through
    # the fog [cd/m²]; visibilities are `VISIBILITIES`, cells those of `cells_of`
    veil: NDArray[np.float32]
    road: NDArray[np.float32]
    depth: NDArray[np.float32]  # (draws, cells): Distance to the road, 1e9 in the sky [m]


def lit_head_lamps(observation: Observation) -> Lamp:
    """Own lamps that throw light ahead; low beams where an observation does not have lamps."""
    return _HEAD_LAMPS & (Lamp.LOW_BEAM if observation.lamps is None else observation.lamps)


def setback_of(observation: Observation) -> float:
    """Distance of the camera behind the front bumper [m]."""
    return round(observation.camera_setback or _USUAL_SETBACK, 3)


def without_noise(camera: Camera) -> Camera:
    """What of a camera decides where it sees what."""
    return replace(camera, bits=8, black_level=0.0, response=Response.LINEAR)


def calibrated_view(camera: Camera) -> Camera:
    """The camera that a calibration is made for, by steps within the deviations that a calibration draws from."""
    pitch, half = round(camera.pitch / _PITCH_STEP) * _PITCH_STEP, math.atan(0.5 * camera.width / camera.focal_length)
    steps, focal_length = round(half / _HALF_FIELD_STEP), camera.focal_length
    # In a narrower view a step would be too much.
    if steps >= 20:
        focal_length = 0.5 * camera.width / math.tan(steps * _HALF_FIELD_STEP)
    return replace(without_noise(camera), pitch=pitch, focal_length=focal_length)


@functools.lru_cache(maxsize=8)
def cells_of(camera: Camera) -> Cells:
    """Cells of a camera's image."""
    edges, azimuths, half = SKY
    looks = [
        (azimuth - half, azimuth + half, low, high) for low, high in itertools.pairwise(edges) for azimuth in azimuths
    ]
    edges, sides, half = _ROAD
    for high, low in itertools.pairwise(-edges):
        away = camera.mount_height / math.tan(math.sqrt(low * high))
        looks += [(math.atan((side - half) / away), math.atan((side + half) / away), low, high) for side in sides]
    boxes = np.array([_box(camera, *look) for look in looks])
    size = np.array((camera.height, camera.height, camera.width, camera.width))
    inside = np.clip(boxes, 0, size)
    seen = _areas(inside) >= _LEAST_SEEN * np.maximum(_areas(boxes), 1)
    is_sky = np.array([low > 0.0 for _, _, low, _ in looks])
    box = np.ascontiguousarray(inside[seen])
    return Cells(box, _rays(camera, box), is_sky[seen])


def _box(camera: Camera, left: float, right: float, low: float, high: float) -> tuple[int, int, int, int]:
    """Rows and columns of a cell between azimuths to the right and elevations; at least one pixel."""
    axes = camera_axes(camera, OWN_FRAME)
    middle, up = 0.5 * (left + right), np.array((low, high))
    ray = np.stack((np.cos(up) * math.cos(middle), -np.cos(up) * math.sin(middle), np.sin(up)))
    across, down, ahead = (axes[:, :, None] * ray).sum(axis=1)
    u, v = (
        principal + camera.focal_length * part / ahead
        for principal, part in zip(camera.principal_point, (across, down), strict=True)
    )
    half = max(0.5 * camera.focal_length * (math.tan(right) - math.tan(left)), 0.5)
    first, left_column = math.floor(v.min() + 0.5), math.floor(u.mean() - half + 0.5)
    last, right_column = math.floor(v.max() + 0.5), math.floor(u.mean() + half + 0.5)
    return first, max(last, first + 1), left_column, max(right_column, left_column + 1)


def _areas(boxes: NDArray[np.int64]) -> NDArray[np.int64]:
    area: NDArray[np.int64] = (boxes[:, 1] - boxes[:, 0]) * (boxes[:, 3] - boxes[:, 2])
    return area


def _rays(camera: Camera, box: NDArray[np.int64]) -> NDArray[np.float64]:
    part = (np.arange(SUB_ROWS) + 0.5) / SUB_ROWS
    v = box[:, :1] - 0.5 + (box[:, 1:2] - box[:, :1]) * part
    u = np.broadcast_to(0.5 * (box[:, 2:3] + box[:, 3:4] - 1.0), v.shape)
    pixels = np.stack((u, v, np.ones_like(v)), axis=-1)
    rays = (pixels[..., None, :] * ray_from_pixel(camera, OWN_FRAME)).sum(axis=-1)
    unit: NDArray[np.float64] = rays / np.sqrt((rays**2).sum(axis=-1, keepdims=True))
    return unit


class Seen(NamedTuple):
    """Cells of an image."""

    luminance: NDArray[np.float64]  # (n,): Means, full scale being 1
    # clipped, dark (n,): shares of their pixels that are as bright, and as dark, as a pixel can be [-]
    clipped: NDArray[np.float64]
    dark: NDArray[np.float64]


def without_cut_noise(seen: Seen) -> Seen:
    """Cells with the luminance that they would have were noise about the dark not cut off, if it is normal."""
    luminance, normal = seen.luminance.copy(), NormalDist()
    for cell in np.flatnonzero(seen.dark > _LEAST_DARK).tolist():
        # Of a normal variable, the share below 0 and the mean of what is above, with 0 in place of the rest.
        place = normal.inv_cdf(1.0 - min(float(seen.dark[cell]), _MOST_DARK))
        luminance[cell] *= max(place, 0.0) / (place * normal.cdf(place) + normal.pdf(place))
    return seen._replace(luminance=luminance)


@kernel
def cell_luminance(pixels: Pixels, table: NDArray[np.float32], box: NDArray[np.int64]) -> Seen:
    """Luminance of cells (`pixels` (rows, cols) uint8, `table` (levels,), `box` (n, 4) int64)."""
    mean, clipped, dark = np.zeros(len(box)), np.zeros(len(box)), np.zeros(len(box))
    last = len(table) - 1
    for cell in range(len(box)):
        top, bottom, left, right = box[cell]
        for row in range(top, bottom):
            for col in range(left, right):
                value = pixels[row, col]
                mean[cell] += table[value]
                if value >= last:
                    clipped[cell] += 1.0
                elif value == 0:
                    dark[cell] += 1.0
        share = 1.0 / ((bottom - top) * (right - left))
        mean[cell] *= share / table[last]
        clipped[cell] *= share
        dark[cell] *= share
    return Seen(mean, clipped, dark)
