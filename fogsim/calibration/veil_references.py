"""Pictures in which the own head lamps' veil is recognised, by the night model for a vehicle's camera and lamps."""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere import Air
from fogsim.atmosphere.lamps.phase_function import Droplets
from fogsim.core.linear_algebra import matrix_product
from fogsim.errors import UnknownNameError
from fogsim.estimators.night.veil_correlation import VeilReferences, camera_of_cells
from fogsim.lighting import own_head_lamps
from fogsim.units import extinction_from_visibility
from fogsim.values.camera import Camera, CameraPose
from fogsim.values.fog import FogField
from fogsim.values.image import View
from fogsim.values.light import HeadLamp, Lamp, Lights, LightSources
from fogsim.values.pinhole import ray_from_pixel

PUBLISHED_VISIBILITIES = (15.0, 50.0, 100.0, 200.0, 500.0, math.inf)
"""Those of gallen2014's simulated references [m] (figure 12)."""

_LOG_SPACED_VISIBILITIES = (*np.geomspace(12.0, 1500.0, 20).tolist(), math.inf)
"""References in equal steps of ln V, and a clear night [m]."""

_RETROREFLECTION = 0.015
"""Coefficient of retroreflected luminance of dry asphalt [cd/m² per lx] (middle of gallen2014's range)."""

_VEIL_SAMPLES, _ROAD_SAMPLES = 8, 8
"""Directions across and along a cell in which veil and road are looked at: far away neither is smooth in a cell."""


_FARTHEST = 1000.0
"""Distance beyond which lamps light no road [m]."""


def compute_references(
    camera: Camera, lamps: Lamp, setback: float, visibilities: Sequence[float] = _LOG_SPACED_VISIBILITIES
) -> VeilReferences:
    """Draw references of a car's lamps by the night model in moderate radiation fog; visibilities rise [m]."""
    cells = camera_of_cells(camera)
    lit = own_head_lamps(lamps, camera.mount_height, setback)
    extinctions = [extinction_from_visibility(visibility) for visibility in visibilities]
    veil = np.array([_veil(cells, lit, extinction) for extinction in extinctions])
    return VeilReferences(camera, np.array(visibilities), veil, _roads(cells, lit, extinctions))


def _veil(cells: Camera, lit: tuple[HeadLamp, ...], extinction: float) -> NDArray[np.float64]:
    camera, pose = _finer(cells, _VEIL_SAMPLES), _pose(cells)
    air = Air(FogField(extinction, (0.0, 0.0, 0.0)), Droplets.MODERATE_RADIATION)
    view = flat_road(camera, pose, response=0.0)
    return _means(air.radiance(view, camera, pose, Lights(lit, LightSources.none()))[:, :, 1], _VEIL_SAMPLES)


def _roads(cells: Camera, lit: tuple[HeadLamp, ...], extinctions: Sequence[float]) -> NDArray[np.float64]:
    """The road as on a clear night, and as the fog dims it on the light's ways to it and back."""
    camera, pose = _finer(cells, _ROAD_SAMPLES), _pose(cells)
    view = flat_road(camera, pose, _RETROREFLECTION)
    clear = Air(FogField(0.0, (0.0, 0.0, 0.0))).radiance(view, camera, pose, Lights(lit, LightSources.none()))[:, :, 1]
    seen = view.distance < _FARTHEST
    there = view.distance[seen].astype(np.float64)
    # All lamps are about as far from a place as the point between them, which is that much nearer than the camera.
    ahead = np.mean([lamp.offset[0] for lamp in lit])
    way = 2.0 * there - ahead
    roads = []
    for extinction in extinctions:
        dimmed = np.zeros(view.distance.shape)
        dimmed[seen] = clear[seen] * np.exp(-extinction * way)
        roads.append(_means(dimmed, _ROAD_SAMPLES))
    return np.array(roads)


def _pose(camera: Camera) -> CameraPose:
    return CameraPose((0.0, 0.0, camera.mount_height), 0.0)


def _finer(cells: Camera, samples: int) -> Camera:
    """The camera that sees each cell in several directions across and along."""
    middle = 0.5 * (samples - 1)
    u0, v0 = cells.principal_point
    return replace(
        cells,
        width=samples * cells.width,
        height=samples * cells.height,
        focal_length=samples * cells.focal_length,
        principal_point=(samples * u0 + middle, samples * v0 + middle),
    )


def _means(luminance: NDArray[Any], samples: int) -> NDArray[np.float64]:
    """Means of the directions of each cell."""
    rows, cols = (size // samples for size in luminance.shape)
    means: NDArray[np.float64] = luminance.reshape(rows, samples, cols, samples).mean(axis=(1, 3), dtype=np.float64)
    return means


def flat_road(camera: Camera, pose: CameraPose, response: float) -> View:
    """View of an endless, flat road that returns a luminance per illuminance of own lamps [cd/m² per lx]."""
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    rays = matrix_product(np.stack((u, v, np.ones_like(u)), axis=-1).astype(np.float64), ray_from_pixel(camera, pose).T)
    slope = -rays[..., 2] / np.sqrt((rays**2).sum(axis=-1))
    distance = np.where(slope > 0.0, pose.position[2] / np.maximum(slope, 1e-9), np.inf).astype(np.float32)
    black = np.zeros((*distance.shape, 3), np.float32)
    returned = np.where(np.isfinite(distance), response, 0.0).astype(np.float32)[..., None].repeat(3, axis=-1)
    return View(black, distance, np.zeros(distance.shape, np.int32), np.ascontiguousarray(returned))


@lru_cache(maxsize=12)
def usual_references(camera: Camera, lamps: Lamp, setback: float) -> VeilReferences:
    """References of a car's usual lamps, computed once per process; `setback` from the front bumper [m]."""
    return compute_references(camera, lamps, setback)


def lamps_named(text: str) -> Lamp:
    """Head lamps by their names, such as "low_beam+front_fog"; UnknownNameError for another name."""
    known = {str(lamp.name).lower(): lamp for lamp in (Lamp.LOW_BEAM, Lamp.HIGH_BEAM, Lamp.FRONT_FOG)}
    found = Lamp.NONE
    for name in text.split("+"):
        if name.strip().lower() not in known:
            raise UnknownNameError("head lamp", name, known)
        found |= known[name.strip().lower()]
    return found
