"""Head lamps of other vehicles light the road, and what stands on it."""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.fog.optical_depth import extinction
from fogsim.atmosphere.surfaces.streetlight import Beams, GroundLight, Reflection, lit_by_map
from fogsim.values import Beam, Camera, CameraPose, FogField, View
from fogsim.values.light import RoadBeams
from fogsim.values.luminous_intensity import luminous_intensity

_CELL, CELLS = 1.0, 160
"""Side of the map's cells [m], and how many there are a side."""

_LOOKED_AHEAD = 60.0
"""How far ahead of the camera the middle of the map is [m]."""

REACH, _HALF_WIDTH, STEP = 70.0, 20.0, 0.5
"""How far ahead and to either side a lamp lights the road, and the step of its pattern [m]."""

_FADED = math.hypot(REACH, _HALF_WIDTH) + 2.0 * _CELL
"""Distance from a lamp at which nothing is lit any more [m]."""

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
    """A map whose cells are lit when they are seen, which few are."""
    ahead = np.array((math.cos(pose.heading), math.sin(pose.heading)))
    origin = np.array(pose.position[:2]) + _LOOKED_AHEAD * ahead - 0.5 * (CELLS - 1) * _CELL
    each = list(zip(beams.kind.tolist(), beams.height.tolist(), strict=True))
    alike = sorted(set(each))
    columns = (beams.position.tolist(), beams.heading.tolist(), beams.grade.tolist(), beams.scale.tolist())
    lost, (x0, y0) = _extinction_before(fog, beams).tolist(), origin.tolist()
    lamps = [
        (
            (x - x0) / _CELL,
            (y - y0) / _CELL,
            math.cos(heading) * _CELL / STEP,
            math.sin(heading) * _CELL / STEP,
            scale,
            height**2,
            -dense,
            z,
            math.tan(grade) * STEP,
        )
        for (x, y, z), heading, grade, scale, dense, (_, height) in zip(*columns, lost, each, strict=True)
    ]
    order = sorted(range(len(each)), key=each.__getitem__)
    patterns = _patterns(tuple((beams.kinds[kind], height) for kind, height in alike))
    which = np.array([alike.index(each[row]) for row in order])
    shape = (CELLS, CELLS)
    on_map = Beams(np.array([lamps[row] for row in order]), which, patterns, STEP, np.zeros(CELLS * CELLS, np.uint8))
    farthest = max(math.dist(place, pose.position) for place in columns[0]) + _FADED
    return GroundLight(
        origin, _CELL, np.empty(shape, np.float32), np.empty(shape, np.float32), np.float32(farthest), on_map
    )


def _extinction_before(fog: FogField, beams: RoadBeams) -> NDArray[np.float64]:
    ahead = np.stack((np.cos(beams.heading), np.sin(beams.heading), np.zeros(len(beams.kind))), axis=1)
    return extinction(fog, beams.position + _MIDDLE_OF_BEAM * ahead)


@lru_cache(16)
def _patterns(lamps: tuple[tuple[Beam, float], ...]) -> NDArray[np.float64]:
    return np.stack([_pattern(*lamp) for lamp in lamps])


@lru_cache(64)
def _pattern(beam: Beam, height: float) -> NDArray[np.float64]:
    """Horizontal illuminance of the road by one lamp without fog [lx], fading towards the farthest."""
    along = np.arange(0.0, REACH + 0.5 * STEP, STEP)[:, None]
    across = np.arange(-_HALF_WIDTH, _HALF_WIDTH + 0.5 * STEP, STEP)
    way = np.sqrt(along**2 + across**2 + height**2)
    intensity = luminous_intensity(beam, np.arctan2(across, along), -np.arcsin(height / way))
    share = np.maximum((along / REACH) ** 2, (across / _HALF_WIDTH) ** 2)
    return np.asarray(intensity * height / way**3 * np.minimum(1.0, 4.0 * np.maximum(1.0 - share, 0.0)))
