"""A round sign in fog before an even sky, painted for tests of the methods that look at signs."""

import math

import numpy as np

from fogsim.values import Camera, Frame, Observation, SignSighting

CAMERA = Camera(480, 240, 1100.0, (60.0, 180.0), 1.4)
SETBACK, LATERAL, HEIGHT, DIAMETER, AIRLIGHT = 1.7, -5.0, 2.3, 0.9, 180.0
"""Lengths [m] and luminance of the sky [linear grey levels]."""


def sighting(distance: float, kind: str = "speed_limit", name: str = "s", along: float = 0.0) -> SignSighting:
    """What the map says of a sign; it may err along the road."""
    return SignSighting(name, kind, 22.2, distance + along, LATERAL, DIAMETER, HEIGHT)


def picture(distance: float, visibility: float, *, standing: bool = True, seed: int = 0):
    """Grey picture: fog, a road darker than it, and the sign: white rim, red ring, white field."""
    ahead = distance + SETBACK
    scale = CAMERA.focal_length / ahead
    k, rows = math.log(20.0) / (visibility), np.arange(CAMERA.height)[:, None]
    below = np.maximum(rows - CAMERA.horizon_row, 1e-3)
    road = AIRLIGHT * (1.0 - 0.6 * np.exp(-k * CAMERA.row_distance / below))
    mean = np.repeat(np.where(rows > CAMERA.horizon_row, road, AIRLIGHT), CAMERA.width, axis=1)
    if standing:
        u, v = CAMERA.principal_point[0] - LATERAL * scale, CAMERA.principal_point[1] - 0.9 * scale
        half, fine = round(0.5 * DIAMETER * scale) + 2, 6
        top, left = max(round(v) - half, 0), round(u) - half
        part = mean[top : round(v) + half, left : left + 2 * half]
        y, x = ((np.mgrid[: part.shape[0] * fine, : part.shape[1] * fine] + 0.5) / fine - 0.5).astype(np.float32)
        reach, fall = np.hypot(x + left - u, y + top - v) / (0.5 * DIAMETER * scale), math.exp(-k * ahead)
        light = part.repeat(fine, axis=0).repeat(fine, axis=1)
        for size, reflectance in ((1.0, 0.66), (0.965, 0.107), (0.78, 0.66)):
            light = np.where(reach < size, AIRLIGHT * (1.0 - fall + 0.55 * reflectance * fall), light)
        # The symbol as the grey that digits are from afar.
        x, y = (x + left - u) / (DIAMETER * scale), (y + top - v) / (DIAMETER * scale)
        grey = AIRLIGHT * (1.0 - fall + 0.55 * 0.38 * fall)
        light = np.where((np.abs(x) < 0.31) & (np.abs(y) < 0.23), grey, light)
        part[:] = light.reshape(part.shape[0], fine, part.shape[1], fine).mean(axis=(1, 3))
    noise = np.random.default_rng(seed).normal(0.0, 1.0, mean.shape)
    return np.clip(np.round(mean + noise), 0, 255).astype(np.uint8)


def observed(distance: float, visibility: float, *, time: float = 0.0, name: str = "s", signs=None, **how):
    """What a vehicle has so far before the sign."""
    told = (sighting(distance, name=name),) if signs is None else signs
    image = picture(distance, visibility, seed=round(1000 * time), **how)
    return Observation(Frame(time, image, CAMERA), 20.0, None, told)
