"""Light of the own head lamps: on what the camera sees, and in the fog between."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.fog.frustum_kernels import grid_depths
from fogsim.atmosphere.fog.medium import is_uniform_below, medium_of
from fogsim.atmosphere.lamps.lamp_tables import lamp_table
from fogsim.atmosphere.lamps.lamplight_kernels import LampGroup, VeilGrid, add_own_light
from fogsim.atmosphere.lamps.phase_function import Droplets
from fogsim.atmosphere.lamps.plane_pieces import piece_length
from fogsim.atmosphere.lamps.veil import FOLD_DISTANCE, INTERVALS, lit_air, node_distances, veil_along, veil_rays
from fogsim.atmosphere.lamps.veil_kernels import LitAir, VeilRays, average_extinctions
from fogsim.core.linear_algebra import matrix_product
from fogsim.values import Camera, CameraPose, FogField, HeadLamp, View
from fogsim.values.pinhole import camera_axes, ray_from_pixel

_AT_REST = CameraPose((0.0, 0.0, 0.0), 0.0)
_MIRROR = np.diag((1.0, -1.0, 1.0))
"""Tables of beams count to the right, the vehicle's axes to the left."""

_REMEMBERED = 16

_HIGHEST = 50.0
"""Height above the camera up to which own lamps light the fog [m]."""


@dataclass(frozen=True, slots=True)
class _Group:
    """Lamps of one colour, ready for drawing."""

    light: LampGroup
    air: LitAir


class OwnLamplight:
    """Draws the light of the lamps of the camera's own vehicle."""

    def __init__(self, droplets: Droplets = Droplets.MODERATE_RADIATION) -> None:
        self._droplets = Droplets(droplets)
        self._veils: dict[tuple[int, float], tuple[_Group, NDArray[np.float32]]] = {}

    def prepare(self, camera: Camera, lamps: tuple[HeadLamp, ...]) -> None:
        """Compute beforehand what depends on camera, lamps and droplets alone."""
        self._groups(camera, lamps)

    def add(
        self,
        luminance: NDArray[np.float32],
        view: View,
        camera: Camera,
        pose: CameraPose,
        fog: FogField,
        lamps: tuple[HeadLamp, ...],
    ) -> None:
        """Add the lamps' light on surfaces, R E e^(−τ), and their veil to an image.

        Takes `luminance` (rows, cols, 3) [cd/m²].
        """
        rows, columns = view.distance.shape
        response = np.zeros((0, columns, 3), np.float32) if view.lamp_response is None else view.lamp_response
        rays, ray_map = _rays(camera)
        mean, local = _extinction_on(rays, camera, pose, fog)
        for group in self._groups(camera, lamps):
            grid = VeilGrid(
                columns=rays.shape[1],
                nodes=np.uint32(INTERVALS + 1),
                fold=np.float32(FOLD_DISTANCE),
                veil=self._veil(group, mean, local).reshape(-1, rays.shape[1] * (INTERVALS + 1)),
                attenuation=mean if mean.size == 1 else mean.reshape(rays.shape[0], -1),
            )
            add_own_light(
                np.ascontiguousarray(view.distance, dtype=np.float32),
                np.ascontiguousarray(response, dtype=np.float32).reshape(len(response), 3 * columns),
                ray_map,
                piece_length(camera.focal_length),
                group.light,
                grid,
                luminance.reshape(rows, 3 * columns),
            )

    def _groups(self, camera: Camera, lamps: tuple[HeadLamp, ...]) -> list[_Group]:
        colours = dict.fromkeys(lamp.colour for lamp in lamps)
        of_colour = [tuple(lamp for lamp in lamps if lamp.colour == colour) for colour in colours]
        return [_group(camera, together, self._droplets) for together in of_colour]

    def _veil(self, group: _Group, mean: NDArray[np.float32], local: NDArray[np.float32]) -> NDArray[np.float32]:
        if mean.size > 1:
            return veil_along(group.air, local, mean)
        if mean[0, 0] == 0:
            return np.zeros((0, INTERVALS + 1), np.float32)
        key = (id(group), float(mean[0, 0]))
        # An identity may have passed from a group that was forgotten to another one.
        known = self._veils.get(key)
        if known is None or known[0] is not group:
            while len(self._veils) >= _REMEMBERED:
                del self._veils[next(iter(self._veils))]
            known = self._veils[key] = (group, veil_along(group.air, local, mean))
        return known[1]


@lru_cache(_REMEMBERED)
def _rays(camera: Camera) -> tuple[VeilRays, NDArray[np.float32]]:
    """Rays of the veil, and the map from pixels to rays by (forward, right, up)."""
    ray_map = matrix_product(_MIRROR, ray_from_pixel(camera, _AT_REST))
    return veil_rays(camera), ray_map.astype(np.float32)


@lru_cache(_REMEMBERED)
def _group(camera: Camera, lamps: tuple[HeadLamp, ...], droplets: Droplets) -> _Group:
    """Lamps of one colour, by what is the same in every scene: the next one's renderer needs not compute it again."""
    places = list(dict.fromkeys(lamp.offset for lamp in lamps))
    # Lamps in one housing shine together.
    tables = [
        np.stack([lamp_table(lamp.beam) for lamp in lamps if lamp.offset == place]).sum(axis=0) for place in places
    ]
    return _Group(
        light=LampGroup(
            places=matrix_product(np.array(places, dtype=np.float32), _MIRROR.astype(np.float32)),
            tables=np.stack([table[0] for table in tables]),
            colour=np.array(lamps[0].colour, dtype=np.float32),
        ),
        air=lit_air(_rays(camera)[0], list(zip(places, tables, strict=True)), droplets),
    )


def _extinction_on(
    rays: VeilRays, camera: Camera, pose: CameraPose, fog: FogField
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Mean extinction coefficient to each node, and that in the interval before it; one number where fog is even."""
    if is_uniform_below(fog, pose.position[2] + _HIGHEST):
        everywhere = np.full((1, 1), fog.extinction, np.float32)
        return everywhere, everywhere
    distances = node_distances()
    to_world = matrix_product(camera_axes(camera, pose).T, camera_axes(camera, _AT_REST))
    shape = (len(rays.directions), len(distances))
    extinction, depth = np.empty(shape, np.float32), np.empty(shape, np.float32)
    directions = np.ascontiguousarray(matrix_product(rays.directions.astype(np.float64), to_world.T))
    grid_depths(np.array(pose.position), directions, distances, medium_of(fog), extinction, depth)
    local = np.empty((shape[0], shape[1] - 1), np.float32)
    average_extinctions(distances.astype(np.float32), depth, local, extinction)
    return extinction, local
