"""What lamps' glows are made of, computed for those kinds of lamps and directions that are seen."""

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.lamps.halo_lamps import SIDES
from fogsim.atmosphere.lamps.lobe_kernels import LampShapes, LobeTables, find_unknown, set_glow_light
from fogsim.atmosphere.lamps.lobes import (
    AZIMUTH_FOLD,
    AZIMUTHS,
    ELEVATION_FOLD,
    ELEVATIONS,
    light_origins,
    mean_intensity,
    table_directions,
)
from fogsim.atmosphere.lamps.phase_function import Droplets
from fogsim.values import Beam, LampLobes, LightSources


class LobeMemory:
    """Light that the glows of lamps are made of.

    It remembers mean intensities, some hundred microseconds' work for each kind of lamp and direction to the eye.
    """

    def __init__(self, droplets: Droplets) -> None:
        self._droplets, self._kinds = droplets, list[Beam]()
        self._azimuth, self._elevation = table_directions()
        origins = light_origins(droplets)
        size = (AZIMUTHS, ELEVATIONS, len(origins.log_depth), len(origins.angle) * SIDES)
        self._tables = LobeTables(np.empty((0, *size), np.float32), AZIMUTH_FOLD, ELEVATION_FOLD, origins.log_depth)
        self._known = np.zeros((0, AZIMUTHS, ELEVATIONS), np.bool_)

    def light(
        self, lamps: NDArray[np.float64], chosen: NDArray[np.int64], eye: NDArray[np.float64], sources: LightSources
    ) -> NDArray[np.float32]:
        """Light of each lamp's glow, by angle and side: the illuminance of a lamp alike in all directions [lx].

        Returns over the angles of `light_origins`. Takes `chosen` (n,) int64, `eye` (3,) [m].
        """
        shapes = self._shapes(sources, chosen)
        position = np.ascontiguousarray(sources.position)
        unknown = np.zeros(self._known.shape, np.bool_)
        if find_unknown(lamps, chosen, eye, position, shapes, self._tables, self._known, unknown):
            self._learn(unknown)
        light = np.empty((len(lamps), self._tables.values.shape[-1]), np.float32)
        set_glow_light(lamps, chosen, eye, position, sources.intensity, shapes, self._tables, light)
        return light

    def _shapes(self, sources: LightSources, chosen: NDArray[np.int64]) -> LampShapes:
        lobes = sources.lobes or LampLobes.alike(len(sources.intensity))
        numbers = np.full(len(lobes.kinds) + 1, -1, np.int64)
        for kind in np.unique(lobes.kind[chosen]).tolist():
            if kind >= 0:
                numbers[kind] = self._number(lobes.kinds[kind])
        return LampShapes(numbers[lobes.kind], lobes.scale, lobes.forward)

    def _number(self, lobe: Beam) -> int:
        for number, known in enumerate(self._kinds):
            if known is lobe:
                return number
        self._kinds.append(lobe)
        values, empty = self._tables.values, np.zeros((1, *self._tables.values.shape[1:]), np.float32)
        self._tables = self._tables._replace(values=np.concatenate((values, empty)))
        self._known = np.concatenate((self._known, np.zeros((1, *self._known.shape[1:]), np.bool_)))
        return len(self._kinds) - 1

    def _learn(self, unknown: NDArray[np.bool_]) -> None:
        for number, lobe in enumerate(self._kinds):
            new = unknown[number]
            if new.any():
                mean = mean_intensity(lobe, self._azimuth[new], self._elevation[new], self._droplets)
                self._tables.values[number][new] = mean.reshape(*mean.shape[:2], -1)
        self._known |= unknown
