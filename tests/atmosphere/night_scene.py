"""A flat road by night, without a renderer: what the tests of lamplight look at."""

import numpy as np

from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, CameraPose, FogField, LightSources, View
from fogsim.values.pinhole import ray_from_pixel

CAMERA = Camera(160, 120, 144.2, (79.5, 59.5), 1.5, 0.035)
POSE = CameraPose((0.0, 0.0, 1.5), 0.0)
RESPONSE = 0.0125


def fog(visibility):
    return FogField(extinction_from_visibility(visibility), (0.0, 0.0, 0.0))


def rays(camera=CAMERA, pose=POSE):
    """Unit vectors to what the pixels see, in the world."""
    v, u = np.mgrid[: camera.height, : camera.width]
    towards = np.stack((u, v, np.ones_like(u)), axis=-1) @ ray_from_pixel(camera, pose).T
    return towards / np.linalg.norm(towards, axis=-1)[..., None]


def road_view(camera=CAMERA, pose=POSE):
    """A dark road that returns the own lamps' light, under a dark sky."""
    down = -rays(camera, pose)[..., 2]
    with np.errstate(divide="ignore"):
        distance = np.where(down > 1e-6, pose.position[2] / np.maximum(down, 1e-9), np.inf)
    shape = (camera.height, camera.width)
    response = np.where(np.isfinite(distance), RESPONSE, 0.0)[..., None] * np.ones(3)
    return View(
        np.zeros((*shape, 3), np.float32),
        distance.astype(np.float32),
        np.zeros(shape, np.int32),
        response.astype(np.float32),
    )


def empty_view(camera=CAMERA, distance=np.inf):
    """Nothing, at a distance."""
    shape = (camera.height, camera.width)
    return View(
        np.zeros((*shape, 3), np.float32), np.full(shape, distance, np.float32), np.zeros(shape, np.int32), None
    )


def lamps(*places, intensity=100.0, area=1e-4, colour=(1.0, 1.0, 1.0)):
    """Lamps of others."""
    count = len(places)
    return LightSources(
        np.array(places, dtype=float).reshape(count, 3),
        np.full(count, intensity),
        np.tile(colour, (count, 1)).astype(float),
        np.full(count, area),
    )
