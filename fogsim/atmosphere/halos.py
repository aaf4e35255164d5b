"""Lamps of others as the camera sees them in fog: their glow, and their direct light where a renderer loses it."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.glow import FOLD_CHORD, glow_table
from fogsim.atmosphere.halo_kernels import (
    CORE_SIZE,
    WIDE_SIZE,
    add_cores,
    add_points,
    add_stretched,
    add_wide,
    lamp_profiles,
)
from fogsim.atmosphere.optical_depth import optical_depth
from fogsim.atmosphere.phase import Droplets
from fogsim.pinhole import camera_axes
from fogsim.values import Camera, CameraPose, FogField, LightSources, View

COARSE_PIXELS = 8
"""Pixels between two of the coarse image; it has 40 … 80 cells across."""

FARTHEST = 16.0
"""Optical depth at which a lamp has faded from sight; it begins to fade at three quarters of that [-]."""

SMALL = 2.25
"""Lamps that cover fewer pixels than this are completed [px²]."""

_SOFT_CELLS = 1.4
_CORE_CELLS = 4.0
_BEHIND = 0.2


@dataclass(frozen=True, slots=True)
class _Lamps:
    """Lamps that may be seen, by the camera's axes (right, down, forward)."""

    towards: NDArray[np.float64]
    place: NDArray[np.float64]
    ahead: NDArray[np.float64]
    range: NDArray[np.float64]
    depth: NDArray[np.float64]
    intensity: NDArray[np.float64]
    colour: NDArray[np.float64]
    area: NDArray[np.float64]


class Halos:
    """Draws lamps of other vehicles and of streets in fog.

    Parameters
    ----------
    droplets : Droplets
        What the fog is made of: sets the shape of the glow.
    """

    def __init__(self, droplets: Droplets = Droplets.MODERATE_RADIATION) -> None:
        self._droplets = Droplets(droplets)
        self._directions: dict[Camera, tuple[int, NDArray[np.float32]]] = {}

    def add(
        self,
        radiance: NDArray[np.float32],
        view: View,
        camera: Camera,
        pose: CameraPose,
        fog: FogField,
        sources: LightSources,
    ) -> None:
        """Add glow and lost direct light of lamps to an image.

        Parameters
        ----------
        radiance : (rows, cols, 3) float32
            Radiance at the camera [cd/m²]; added to in place, C-contiguous.
        view : View
            What is seen; lamps that it shows are complete already.
        camera, pose : Camera, CameraPose
            The camera.
        fog : FogField
            The fog at one time.
        sources : LightSources
            The lamps.
        """
        lamps = _seen(camera, pose, fog, sources)
        if not len(lamps.range):
            return
        rows, columns = view.distance.shape
        image = radiance.reshape(rows, 3 * columns)
        distance = np.ascontiguousarray(view.distance, dtype=np.float32)
        if np.any(lamps.depth > 0):
            self._add_glow(image, distance, camera, lamps)
        _complete(image, distance, view, camera, lamps)

    def _add_glow(
        self,
        image: NDArray[np.float32],
        distance: NDArray[np.float32],
        camera: Camera,
        lamps: _Lamps,
    ) -> None:
        cell = camera.width / _cells(camera)
        table, count = glow_table(self._droplets), len(lamps.range)
        wide, core = np.empty((count, WIDE_SIZE), np.float32), np.empty((count, CORE_SIZE), np.float32)
        # Off the axis a pixel sees a smaller angle.
        angle_of_pixel = np.maximum(lamps.ahead, _BEHIND) ** 1.5 / camera.focal_length
        reach = np.full(count, _CORE_CELLS * cell)
        softness = np.sqrt(lamps.area / math.pi / lamps.range**2 + (0.5 * angle_of_pixel) ** 2)
        lamp_profiles(
            lamps.depth,
            lamps.intensity / lamps.range**2 * _fade(lamps),
            softness,
            _SOFT_CELLS * cell / camera.focal_length,
            reach * angle_of_pixel,
            table.log_depth,
            table.log_glow,
            FOLD_CHORD,
            wide,
            core,
        )
        coarse_columns, directions = self._coarse(camera)
        coarse = np.empty((4, directions.shape[1]), np.float32)
        add_wide(
            directions,
            lamps.towards.astype(np.float32),
            wide,
            lamps.colour.astype(np.float32),
            (1.0 / lamps.range).astype(np.float32),
            coarse,
        )
        add_stretched(coarse, coarse_columns, distance, image)
        inside = lamps.ahead > _BEHIND
        cores = (lamps.place[inside], reach[inside], lamps.range[inside], core[inside], lamps.colour[inside])
        add_cores(*cores, distance, image)

    def _coarse(self, camera: Camera) -> tuple[int, NDArray[np.float32]]:
        """Columns of the coarse image, and its directions in the camera's axes (3, m)."""
        if camera not in self._directions:
            cells = _cells(camera)
            rows = max(2, math.ceil(cells * camera.height / camera.width)) + 1
            u0, v0 = camera.principal_point
            right = (np.linspace(0, camera.width - 1, cells + 1) - u0) / camera.focal_length
            down = (np.linspace(0, camera.height - 1, rows) - v0) / camera.focal_length
            plane = np.broadcast_arrays(right, down[:, None], np.ones((1, 1)))
            rays = np.stack([part.reshape(-1) for part in plane])
            unit = np.ascontiguousarray(rays / np.linalg.norm(rays, axis=0), dtype=np.float32)
            self._directions = {camera: (cells + 1, unit)}
        return self._directions[camera]


def _cells(camera: Camera) -> int:
    """Cells of the coarse image across."""
    return min(max(round(camera.width / COARSE_PIXELS), 40), 80)


def _seen(camera: Camera, pose: CameraPose, fog: FogField, sources: LightSources) -> _Lamps:
    """Lamps that shine toward the camera from before it."""
    eye = np.array(pose.position)
    from_eye = sources.position - eye
    distance = np.linalg.norm(from_eye, axis=1)
    in_camera = from_eye @ camera_axes(camera, pose).T
    ahead = in_camera[:, 2] / np.maximum(distance, 1e-9)
    chosen = np.flatnonzero((sources.intensity > 0) & (distance > 0.5) & (ahead > 0.0))
    depth = optical_depth(fog, np.repeat(eye[None], len(chosen), axis=0), sources.position[chosen])
    near = depth < FARTHEST
    chosen, depth = chosen[near], depth[near]
    axis = np.array(camera.principal_point)
    beside = in_camera[chosen, :2] / np.maximum(in_camera[chosen, 2:], 1e-9)
    return _Lamps(
        towards=in_camera[chosen] / distance[chosen, None],
        place=axis + camera.focal_length * beside,
        ahead=ahead[chosen],
        range=distance[chosen],
        depth=depth,
        intensity=sources.intensity[chosen],
        colour=np.ascontiguousarray(sources.colour[chosen]),
        area=sources.area[chosen],
    )


def _fade(lamps: _Lamps) -> NDArray[np.float64]:
    """Factor that lets lamps vanish smoothly, far away and as they pass the camera."""
    far = np.clip(4.0 * (1.0 - lamps.depth / FARTHEST), 0.0, 1.0)
    passing = np.clip(lamps.ahead / _BEHIND, 0.0, 1.0)
    return np.asarray((3.0 - 2.0 * far) * far**2 * (3.0 - 2.0 * passing) * passing**2)


def _complete(
    image: NDArray[np.float32], distance: NDArray[np.float32], view: View, camera: Camera, lamps: _Lamps
) -> None:
    """Add direct light of lamps that are too small to be met by a pixel's ray."""
    # A pixel sees the solid angle cos³ / f² of its direction off the axis.
    cosine = np.maximum(lamps.ahead, _BEHIND)
    pixels = lamps.area / lamps.range**2 * camera.focal_length**2 / cosine**3
    u, v = lamps.place.T
    rows, columns = distance.shape
    small = (pixels < SMALL) & (lamps.ahead > _BEHIND) & (u > -1) & (u < columns) & (v > -1) & (v < rows)
    expected = lamps.intensity / lamps.range**2 * camera.focal_length**2 / cosine**3
    add_points(
        lamps.place[small],
        lamps.range[small],
        expected[small],
        np.exp(-lamps.depth[small]),
        lamps.colour[small],
        np.ascontiguousarray(view.radiance, dtype=np.float32).reshape(rows, 3 * columns),
        distance,
        image,
    )
