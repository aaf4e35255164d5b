"""Head lamps of other vehicles light the road, and what stands on it."""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.fog.medium import is_uniform_below
from fogsim.atmosphere.fog.optical_depth import extinction
from fogsim.atmosphere.surfaces.streetlight import GroundLight, Reflection, lit_by_map
from fogsim.core.jit import kernel
from fogsim.values import Beam, Camera, CameraPose, FogField, View
from fogsim.values.light import RoadBeams
from fogsim.values.luminous_intensity import luminous_intensity


class _BeamsAlike(NamedTuple):
    """Beams of one kind from one height."""

    places: NDArray[np.float64]  # (n, 3): Where the lamps are [m]
    headings: NDArray[np.float64]  # (n,): Directions of their axes, counter-clockwise from x [rad]
    slopes: NDArray[np.float64]  # (n,): Rise of the road before them over its length in plan [-]
    scales: NDArray[np.float64]  # (n,): How many lamps shine together at each place
    extinction: NDArray[np.float64]  # (n,): Of the fog before each [1/m]
    height: float  # Of the lamps above the road [m]


@kernel
def _add_beam_illuminance(beams: _BeamsAlike, pattern: NDArray[np.float64], step: float, ground: GroundLight) -> None:
    """Add beams to a map of illuminance, and set how high up what stands there is lit: as high as lamps there.

    Takes `pattern` (m, 2 l + 1) [lx], `step` [m].
    """
    origin, cell, illuminance, tops = ground.origin, ground.cell, ground.illuminance, ground.tops
    rows, columns = illuminance.shape
    ahead, half = pattern.shape[0] - 1, (pattern.shape[1] - 1) // 2
    for i in range(beams.places.shape[0]):
        x0, y0 = (beams.places[i, 0] - origin[0]) / cell, (beams.places[i, 1] - origin[1]) / cell
        cosine, sine = math.cos(beams.headings[i]) * cell / step, math.sin(beams.headings[i]) * cell / step
        # The pattern lies between its far end and its sides, turned.
        far_x, far_y = ahead * (step / cell) ** 2 * cosine, ahead * (step / cell) ** 2 * sine
        side_x, side_y = half * (step / cell) ** 2 * abs(sine), half * (step / cell) ** 2 * abs(cosine)
        first_row, last_row = y0 + min(far_y, 0.0) - side_y, y0 + max(far_y, 0.0) + side_y
        first_column, last_column = x0 + min(far_x, 0.0) - side_x, x0 + max(far_x, 0.0) + side_x
        for row in range(max(0, math.ceil(first_row)), min(rows, math.floor(last_row) + 1)):
            for column in range(max(0, math.ceil(first_column)), min(columns, math.floor(last_column) + 1)):
                along = (column - x0) * cosine + (row - y0) * sine
                across = (column - x0) * sine - (row - y0) * cosine + half
                if not (0.0 < along < ahead and 0.0 < across < 2 * half):
                    continue
                a, b = int(along), int(across)
                down, right = along - a, across - b
                near = pattern[a, b] + (pattern[a, b + 1] - pattern[a, b]) * right
                far = pattern[a + 1, b] + (pattern[a + 1, b + 1] - pattern[a + 1, b]) * right
                way = math.sqrt(beams.height**2 + step**2 * (along**2 + (across - half) ** 2))
                light = beams.scales[i] * (near + (far - near) * down) * math.exp(-beams.extinction[i] * way)
                illuminance[row, column] += np.float32(light)
                # Light fades from the height of the lamps to a metre above it.
                top = beams.places[i, 2] + beams.slopes[i] * step * along + 1.0
                tops[row, column] = max(tops[row, column], np.float32(top))


_CELL, CELLS = 1.0, 160
"""Side of the map's cells [m], and how many there are a side."""

_LOOKED_AHEAD = 60.0
"""How far ahead of the camera the middle of the map is [m]."""

REACH, _HALF_WIDTH, STEP = 70.0, 20.0, 0.5
"""How far ahead and to either side a lamp lights the road, and the step of its pattern [m]."""

_WHITEST = 0.95
"""Reflectance above which a surface must be a lamp [-]."""

_MIDDLE_OF_BEAM = 10.0
"""Where before a lamp its fog is taken [m]."""


class TrafficLight:
    """Adds the light of other vehicles' head lamps on the road to drawn scenes.

    A horizontal surface at the distance s from a lamp at the height h has the illuminance I h e^(−ks) / s³. Surfaces
    return it as they do the sky's, upright ones as the road next to them would, up to the height of the lamps.
    """

    def __init__(self) -> None:
        self._lit = np.empty((0, 0, 3), np.float32)

    def on(self, view: View, camera: Camera, pose: CameraPose, fog: FogField, beams: RoadBeams) -> View:
        """A drawn scene with the beams' light.

        Returns Its image is valid until the next call.
        """
        if not len(beams.kind) or beams.sky_illuminance <= 0.0:
            return view
        ground = _map_of(pose, fog, beams)
        if self._lit.shape != view.radiance.shape:
            self._lit = np.empty(view.radiance.shape, np.float32)
        reflection = Reflection(
            np.full(3, 1.0 / beams.sky_illuminance, dtype=np.float32),
            np.float32(_WHITEST * beams.sky_illuminance / math.pi),
        )
        place = (np.array(pose.position[:2]) - ground.origin) / _CELL
        return lit_by_map(view, camera, pose, place, ground, reflection, self._lit)


def _map_of(pose: CameraPose, fog: FogField, beams: RoadBeams) -> GroundLight:
    ahead = np.array((math.cos(pose.heading), math.sin(pose.heading)))
    origin = np.array(pose.position[:2]) + _LOOKED_AHEAD * ahead - 0.5 * (CELLS - 1) * _CELL
    dark, low = np.zeros((CELLS, CELLS), np.float32), np.full((CELLS, CELLS), -np.inf, np.float32)
    ground = GroundLight(origin, _CELL, dark, low)
    dense = _extinction_before(fog, beams)
    alike: dict[tuple[int, float], list[int]] = {}
    for row, which in enumerate(zip(beams.kind.tolist(), beams.height.tolist(), strict=True)):
        alike.setdefault(which, []).append(row)
    for (kind, height), rows in sorted(alike.items()):
        lamps = beams.position[rows], beams.heading[rows], np.tan(beams.grade[rows]), beams.scale[rows]
        pattern = _pattern(beams.kinds[kind], height)
        _add_beam_illuminance(_BeamsAlike(*lamps, dense[rows], height), pattern, STEP, ground)
    return ground


def _extinction_before(fog: FogField, beams: RoadBeams) -> NDArray[np.float64]:
    if is_uniform_below(fog, float(beams.position[:, 2].max())):
        return np.full(len(beams.kind), fog.extinction)
    ahead = np.stack((np.cos(beams.heading), np.sin(beams.heading), np.zeros(len(beams.kind))), axis=1)
    return extinction(fog, beams.position + _MIDDLE_OF_BEAM * ahead)


@lru_cache(64)
def _pattern(beam: Beam, height: float) -> NDArray[np.float64]:
    """Horizontal illuminance of the road by one lamp without fog [lx], fading towards the farthest."""
    along = np.arange(0.0, REACH + 0.5 * STEP, STEP)[:, None]
    across = np.arange(-_HALF_WIDTH, _HALF_WIDTH + 0.5 * STEP, STEP)
    way = np.sqrt(along**2 + across**2 + height**2)
    intensity = luminous_intensity(beam, np.arctan2(across, along), -np.arcsin(height / way))
    share = np.maximum((along / REACH) ** 2, (across / _HALF_WIDTH) ** 2)
    return np.asarray(intensity * height / way**3 * np.minimum(1.0, 4.0 * np.maximum(1.0 - share, 0.0)))
