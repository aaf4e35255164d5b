"""The tail lamps of the tracked vehicle ahead in a picture by night, and the red light about them."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera
from fogsim.values.camera_response import exposure_of
from fogsim.vision.light.pixel_kernels import Pixels
from fogsim.vision.sources import tree_kernels
from fogsim.vision.sources.source_tree import compactness, elongation
from fogsim.vision.sources.tree_kernels import AREA, SUM_U, SUM_V

Floats = NDArray[np.float64]

ASIDE, LOWEST, HIGHEST = 3.0, 0.3, 1.6
"""Where lamps are looked for: so far aside of the own axis, and between these heights above the road [m]."""

HALF_SPACING = (0.45, 1.3)
"""Half the distance between two tail lamps [m]."""

USUAL_HALF_SPACING = 0.62
"""That of a car, which is taken where the two are one blot [m]."""

SEED = 0.8
"""Threshold of the lamps over the brightest red of where they are looked for [-]."""

DIM = 0.35
"""Red, as a share of full scale, that is no lamp's even where it is the brightest [-]."""

EXCESS = (-1.43, 0.43)
"""What is added to red of green and blue [-]: neither neutral nor warm white light, as of other lamps, is then left."""

RED = 0.25
"""Least share that is left of red about a tail lamp [-]."""

ANGLES = np.radians(np.geomspace(0.8, 16.0, 14))
"""Angles off the middle of the lamps at which the glow is measured, ring by ring [rad]."""

SECTORS = np.radians((15.0, 40.0, 65.0, 90.0, 115.0, 140.0, 165.0))
"""Directions about the lamps, counterclockwise from the right of the picture: above the road [rad]."""

FULL, LEAST = 0.9, 0.03
"""Shares of full exposure between which red can be read; darker, noise that is cut off at zero adds to it [-]."""

ROAD, HALF_LANE = (7.0, 11.0), 1.0
"""Between which distances, and how far aside, the near road is looked at [m]."""

SURELY = 1.5
"""Least red over its noise in a pixel [-]."""

PATCH = 0.10
"""Half of a patch's side over its distance from the lamps [-]."""


@dataclass(frozen=True, slots=True)
class TailLamps:
    """A pair of tail lamps, or what looks like one.

    Attributes
    ----------
    u, v : float
        The middle between them [px].
    half_spacing : float
        Half of their distance [px].
    radius : float
        Radius of the blot that they are [px].
    """

    u: float
    v: float
    half_spacing: float
    radius: float


@dataclass(frozen=True, slots=True)
class RedGlow:
    """Red light about the lamps, ring by ring and sector by sector.

    Attributes
    ----------
    u, v : (rings, sectors) float64
        Where it was measured [px].
    log_red : (rings, sectors) float64
        Ln of the red beyond that of white light, of full exposure; NaN where it cannot be told.
    noise : (rings, sectors) float64
        Its standard deviation by the pixels' noise [-].
    """

    u: Floats
    v: Floats
    log_red: Floats
    noise: Floats


def find_tail_lamps(image: Pixels, camera: Camera, distance: float) -> TailLamps | str:
    """Find the tail lamps of a vehicle at a known range; why there are none to be found, if so.

    Parameters
    ----------
    image : (rows, cols, 3) uint8 or uint16
        The picture.
    camera : Camera
        The told calibration.
    distance : float
        Range of the vehicle's rear from the camera [m].
    """
    scale = camera.focal_length / distance
    top = camera.horizon_row + (camera.mount_height - HIGHEST) * scale - 3.0
    bottom = camera.horizon_row + (camera.mount_height - LOWEST) * scale + 3.0
    left, right = (camera.principal_point[0] + side * (ASIDE * scale + 3.0) for side in (-1, 1))
    first, last = max(math.floor(top), 0), min(math.ceil(bottom) + 1, camera.height)
    begin, end = max(math.floor(left), 0), min(math.ceil(right) + 1, camera.width)
    if last - first < 3 or end - begin < 3:
        return "the vehicle ahead is not in the picture"
    part = np.ascontiguousarray((image[first:last, begin:end, :1] >> (camera.bits - 8)).astype(np.uint8))
    red = part[:, :, 0]
    brightest = int(red.max())
    if brightest < DIM * 255.0:
        return "the vehicle ahead shows no lamp"
    _, found = tree_kernels.find_components(red, math.ceil(SEED * brightest), 64, red.size + 1)
    found = found[(found[:, AREA] >= 3.0)]
    found = found[(compactness(found) > 0.6) & (elongation(found) < 8.0)] if len(found) else found
    if not len(found):
        return "the vehicle ahead shows no lamp"
    place = found[:, [SUM_U, SUM_V]] / found[:, AREA, None] + (begin, first)
    return _pair(place, found[:, AREA], scale)


def _pair(place: Floats, area: Floats, scale: float) -> TailLamps:
    """The two blots that lie as tail lamps do, or the largest one."""
    radius, best = np.sqrt(area / math.pi), (0.0, -1, -1)
    for i in range(len(area)):
        for j in range(i + 1, len(area)):
            across, along = abs(place[i, 0] - place[j, 0]), abs(place[i, 1] - place[j, 1])
            fits = (
                2.0 * HALF_SPACING[0] * scale < across < 2.0 * HALF_SPACING[1] * scale and along < 0.15 * across + 1.0
            )
            alike = min(area[i], area[j]) > 0.3 * max(area[i], area[j])
            if fits and alike and area[i] + area[j] > best[0]:
                best = float(area[i] + area[j]), i, j
    largest = int(np.argmax(area))
    if best[0] > float(area[largest]):
        _, i, j = best
        u, v = (0.5 * (place[i] + place[j])).tolist()
        half = 0.5 * math.dist(place[i], place[j])
        return TailLamps(u, v, half, half + float(max(radius[i], radius[j])))
    u, v = place[largest].tolist()
    half = USUAL_HALF_SPACING * scale
    return TailLamps(u, v, half, max(float(radius[largest]), half))


def red_glow(image: Pixels, camera: Camera, lamps: TailLamps) -> RedGlow:
    """Measure the red light about tail lamps, without the red of white light: the own lamps' and others'.

    Parameters
    ----------
    image : (rows, cols, 3) uint8 or uint16
        The picture.
    camera : Camera
        The told calibration.
    lamps : TailLamps
        Where they are.
    """
    inner = max(1.25 * lamps.radius, 1.6 * lamps.half_spacing)
    ring = camera.focal_length * np.tan(ANGLES)[:, None]
    u, v = lamps.u + ring * np.cos(SECTORS), lamps.v - ring * np.sin(SECTORS)
    log_red, noise = np.full(u.shape, np.nan), np.full(u.shape, np.inf)
    full = 2**camera.bits - 1
    for at in np.ndindex(u.shape):
        half = max(PATCH * float(ring[at[0], 0]), 1.5)
        box = _box(float(u[at]), float(v[at]), half, camera) if ring[at[0], 0] > inner else None
        if box is None:
            continue
        patch = exposure_of(image[box].astype(np.float64) / full, camera.response, camera.black_level)
        red = patch[..., 0]
        beyond = red + EXCESS[0] * patch[..., 1] + EXCESS[1] * patch[..., 2]
        level, excess = float(red.mean()), float(beyond.mean())
        deviation = float(beyond.std()) / math.sqrt(red.size)
        # Noise that is cut off at zero is light that is none.
        is_light = float(red.max()) < FULL and level > max(LEAST, SURELY * float(red.std()))
        if is_light and excess > max(4.0 * deviation, RED * level):
            log_red[at], noise[at] = math.log(excess), deviation / excess
    return RedGlow(u, v, log_red, noise)


def road_light(image: Pixels, camera: Camera) -> float:
    """Light of the near road in the own beams, of full exposure: what the exposure is told by [-].

    Parameters
    ----------
    image : (rows, cols, 3) uint8 or uint16
        The picture.
    camera : Camera
        The told calibration.
    """
    last = camera.height - 1
    near, far = (min(camera.horizon_row + camera.row_distance / at, last) for at in ROAD)
    if near - far < 2.0:
        near, far = last, 0.75 * last + 0.25 * camera.horizon_row
    half = HALF_LANE * camera.focal_length / ROAD[1]
    left, right = (max(min(camera.principal_point[0] + side * half, camera.width), 0.0) for side in (-1, 1))
    part = image[round(far) : round(near) + 1 : 2, round(left) : max(round(right), round(left) + 1) : 2, 1]
    full = 2**camera.bits - 1
    return float(np.median(exposure_of(part.astype(np.float64) / full, camera.response, camera.black_level)))


def _box(u: float, v: float, half: float, camera: Camera) -> tuple[slice, slice] | None:
    """Pixels about a place, every so manieth of a large patch; None where it reaches beyond the picture."""
    left, right, top, bottom = round(u - half), round(u + half) + 1, round(v - half), round(v + half) + 1
    if left < 0 or top < 0 or right > camera.width or bottom > camera.height:
        return None
    step = max(round(half / 6.0), 1)
    return slice(top, bottom, step), slice(left, right, step)
