"""Light that the road before head lamps returns, as a source of glow in the fog above it."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

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
    """Lit pieces of road: middles and spreads in the vehicle's axes from the camera [m], range of the lamps, flux."""

    lamps: tuple[HeadLamp, ...]
    middle: NDArray[np.float64]
    spread: NDArray[np.float64]
    range_: NDArray[np.float64]
    flux: NDArray[np.float64]


class RoadGlow:
    """Light of the own lamps that the road reflects upwards; caches the lit patches."""

    def __init__(self) -> None:
        self._known: _Patches | None = None

    def sources(self, lamps: tuple[HeadLamp, ...], camera: Camera, pose: CameraPose, fog: FogField) -> LightSources:
        """Lit pieces of the road as sources of light."""
        patches = self._patches(lamps, camera.mount_height)
        reached = patches.flux * np.exp(-LOSS_OF_SPREAD_LIGHT * fog.extinction * patches.range_)
        cosine, sine = math.cos(pose.heading), math.sin(pose.heading)
        ahead, left, up = patches.middle.T
        rise = math.sin(pose.grade)
        place = np.stack((ahead * cosine - left * sine, ahead * sine + left * cosine, up + ahead * rise), axis=1)
        distance = np.linalg.norm(patches.middle, axis=1)
        slant = np.maximum(-up / distance, 0.01)
        upward = ROAD_ALBEDO * reached / math.pi
        count = len(reached)
        return LightSources(
            position=np.asarray(pose.position, dtype=np.float64) + place,
            intensity=upward * slant,
            colour=np.ones((count, 3)),
            area=4.0 * patches.spread[:, 0] * patches.spread[:, 1] * slant,
            lobes=LampLobes(
                (_LAMBERTIAN,), np.zeros(count, np.int64), upward / _UNIT, np.tile((1.0, 0.0, 0.0), (count, 1))
            ),
        )

    def _patches(self, lamps: tuple[HeadLamp, ...], height: float) -> _Patches:
        known = self._known
        if known is None or known.lamps != lamps:
            known = self._known = _lit_patches(lamps, height)
        return known


def glow_of_beams(beams: RoadBeams, pose: CameraPose, fog: FogField) -> LightSources:
    """The lit road before other vehicles as sources of light, one a pair of lamps."""
    eye = np.asarray(pose.position, dtype=np.float64)
    chosen = np.argsort(((beams.position - eye) ** 2).sum(axis=1), kind="stable")[:_MOST]
    roads = [_lit_road(beams.kinds[beams.kind[i]], round(float(beams.height[i]), 2)) for i in chosen.tolist()]
    kept = np.exp(-LOSS_OF_SPREAD_LIGHT * fog.extinction * roads[0].range_)
    flux = np.stack([road.flux for road in roads]) * kept * beams.scale[chosen, None]
    total = flux.sum(axis=1)
    ahead = (flux * np.stack([road.middle[:, 0] for road in roads])).sum(axis=1) / total
    heading = beams.heading[chosen]
    position = beams.position[chosen] + np.stack(
        (ahead * np.cos(heading), ahead * np.sin(heading), -beams.height[chosen]), axis=1
    )
    way = eye - position
    slant = np.maximum(way[:, 2] / np.sqrt((way**2).sum(axis=1)), 0.01)
    upward, count = ROAD_ALBEDO * total / math.pi, len(chosen)
    axes = np.tile((1.0, 0.0, 0.0), (count, 1))
    return LightSources(
        position=position,
        intensity=upward * slant,
        colour=np.ones((count, 3)),
        area=_LIT_AREA * slant,
        lobes=LampLobes((_LAMBERTIAN,), np.zeros(count, np.int64), upward / _UNIT, axes),
    )


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
    return _Patches(lamps, np.hstack((middle, down)), spread, np.sqrt(edges[1:] * edges[:-1]), total[:, 0])
