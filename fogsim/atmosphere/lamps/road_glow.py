"""Light that the road before head lamps returns, as a source of glow in the fog above it."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.fog.optical_depth import extinction
from fogsim.atmosphere.lamps.veil import LOSS_OF_SPREAD_LIGHT
from fogsim.values import Beam, Camera, CameraPose, FogField, HeadLamp, LampLobes, LightSources
from fogsim.values.light import RoadBeams
from fogsim.values.luminous_intensity import luminous_intensity

ROAD_ALBEDO = 0.1
"""Share of the light on a road that it returns, alike in all directions in luminance: asphalt has 0.07 to 0.12 [-]."""

EDGES = (2.0, 5.0, 9.0, 16.0, 30.0, 60.0)
"""Distances ahead of the lamps between which the lit road counts as one source [m]."""

_MOST = 2
"""Other vehicles' pairs of lamps, the nearest ones, whose lit road glows in the fog."""

_LIT_AREA = 60.0
"""Area of the road before other vehicles from which most of its light comes [m²]."""

_UNIT = 1000.0
_STEPS, _ASIDE = 8, 41
_WIDEST = math.radians(50.0)
_ELEVATIONS = np.radians([0.0, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 40.0, 90.0])

_LAMBERTIAN = Beam(
    np.array([-math.pi, math.pi]), _ELEVATIONS, _UNIT * np.repeat(np.sin(_ELEVATIONS)[:, None], 2, axis=1)
)
"""How a lit piece of road shines that gives 1000 cd straight up."""


@dataclass(frozen=True, slots=True)
class _Patches:
    """Lit pieces of road: middles in the vehicle's axes from the camera [m], range of the lamps, flux."""

    lamps: tuple[HeadLamp, ...]
    middle: NDArray[np.float64]
    range_: NDArray[np.float64]
    flux: NDArray[np.float64]
    # slant, area: Share of its area that a piece shows to the camera [-], and this area [m²]
    slant: NDArray[np.float64]
    area: NDArray[np.float64]


class RoadGlow:
    """Light of the own lamps that the road reflects upwards; caches the lit patches."""

    def __init__(self) -> None:
        self._known: _Patches | None = None

    def sources(self, lamps: tuple[HeadLamp, ...], camera: Camera, pose: CameraPose, fog: FogField) -> LightSources:
        """Lit pieces of the road as sources of light."""
        patches = self._patches(lamps, camera.mount_height)
        cosine, sine = math.cos(pose.heading), math.sin(pose.heading)
        ahead, left, up = patches.middle.T
        rise = math.sin(pose.grade)
        place = np.array((ahead * cosine - left * sine, ahead * sine + left * cosine, up + ahead * rise)).T
        eye = np.asarray(pose.position, dtype=np.float64)
        dense = extinction(fog, eye + 0.5 * place)
        reached = patches.flux * np.exp(-LOSS_OF_SPREAD_LIGHT * dense * patches.range_)
        return _shining_up(eye + place, ROAD_ALBEDO * reached / math.pi, patches.slant, patches.area)

    def _patches(self, lamps: tuple[HeadLamp, ...], height: float) -> _Patches:
        known = self._known
        if known is None or known.lamps != lamps:
            known = self._known = _lit_patches(lamps, height)
        return known


def glow_of_beams(beams: RoadBeams, pose: CameraPose, fog: FogField) -> LightSources:
    """The lit road before other vehicles as sources of light, one a pair of lamps."""
    eye, places = pose.position, beams.position.tolist()
    away = [math.dist(place, eye) for place in places]
    chosen = sorted(range(len(places)), key=away.__getitem__)[:_MOST]
    found, dense = [], extinction(fog, beams.position[chosen]).tolist()
    for i, lost in zip(chosen, dense, strict=True):
        (x, y, z), height, heading = places[i], float(beams.height[i]), float(beams.heading[i])
        road = _lit_road(beams.kinds[beams.kind[i]], round(height, 2))
        flux = road.flux * np.exp(-LOSS_OF_SPREAD_LIGHT * lost * road.range_) * beams.scale[i]
        total = float(flux.sum())
        ahead = float((flux * road.middle[:, 0]).sum()) / total
        rise = ahead * math.tan(beams.grade[i]) - height
        position = (x + ahead * math.cos(heading), y + ahead * math.sin(heading), z + rise)
        found.append((*position, total, max((eye[2] - position[2]) / math.dist(eye, position), 0.01)))
    table = np.array(found)
    slant = table[:, 4]
    return _shining_up(table[:, :3], ROAD_ALBEDO * table[:, 3] / math.pi, slant, _LIT_AREA * slant)


def _shining_up(
    position: NDArray[np.float64], upward: NDArray[np.float64], slant: NDArray[np.float64], area: NDArray[np.float64]
) -> LightSources:
    """Lit pieces of road as sources (`upward` [cd], `slant` share of it toward the camera)."""
    white, kind, axes = _alike(len(upward))
    lobes = LampLobes((_LAMBERTIAN,), kind, upward / _UNIT, axes)
    return LightSources(position, upward * slant, white, area, lobes)


@lru_cache(8)
def _alike(count: int) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64]]:
    """Colours, kinds and axes of some pieces of road."""
    return np.ones((count, 3)), np.zeros(count, np.int64), np.tile((1.0, 0.0, 0.0), (count, 1))


@lru_cache(64)
def _lit_road(beam: Beam, height: float) -> _Patches:
    """The road before one lamp, from the lamp."""
    return _lit_patches((HeadLamp((0.0, 0.0, 0.0), beam),), height)


def _lit_patches(lamps: tuple[HeadLamp, ...], height: float) -> _Patches:
    """Where the beams meet the road, between each two of the `EDGES`."""
    edges = np.array(EDGES)
    near, far = edges[:-1, None], edges[1:, None]
    ahead = near * (far / near) ** ((np.arange(_STEPS) + 0.5) / _STEPS)
    step = np.broadcast_to(np.log(far / near) / _STEPS, ahead.shape)
    azimuth = _WIDEST * (2.0 * (np.arange(_ASIDE) + 0.5) / _ASIDE - 1.0)
    flux, places = [], []
    for lamp in lamps:
        above = height + lamp.offset[2]
        elevation = -np.arctan2(above, ahead)
        # dΩ of a step in ln(distance): cos(elevation) times the change of the elevation.
        solid = np.cos(elevation) * np.abs(np.sin(elevation) * np.cos(elevation)) * step * 2.0 * _WIDEST / _ASIDE
        flux.append(luminous_intensity(lamp.beam, azimuth, elevation[..., None]) * solid[..., None])
        onward, aside = ahead[..., None] * np.cos(azimuth), -ahead[..., None] * np.sin(azimuth)
        places.append(np.stack((onward + lamp.offset[0], aside + lamp.offset[1]), axis=-1))
    weight = np.stack(flux, axis=1).reshape(len(edges) - 1, -1, 1)
    place = np.stack(places, axis=1).reshape(len(edges) - 1, -1, 2)
    total = np.maximum(weight.sum(axis=1), 1e-9)
    middle = (weight * place).sum(axis=1) / total
    spread = np.sqrt((weight * (place - middle[:, None]) ** 2).sum(axis=1) / total)
    down = np.full((len(middle), 1), -height)
    middle = np.hstack((middle, down))
    slant = np.maximum(height / np.linalg.norm(middle, axis=1), 0.01)
    area = 4.0 * spread[:, 0] * spread[:, 1] * slant
    return _Patches(lamps, middle, np.sqrt(edges[1:] * edges[:-1]), total[:, 0], slant, area)
