"""How far a driver sees by the own lamps in fog: a small object on the road, behind the veil of these lamps.

The scenario is that of gallen2014, § II (a square of 0.18 m and reflectance 0.08 on the road straight ahead, R_L = 12.5
mcd m⁻² lx⁻¹, visibility level 7 by Adrian 1989), but the lamps are those of `fogsim.lighting.beams`, and the veil
is that of the pictures, up to the object, in place of the paper's eq. 9, which knows high beams only.
"""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere import Droplets, Pavement, visibility_level
from fogsim.atmosphere.lamps.lamp_tables import lamp_table
from fogsim.atmosphere.lamps.veil import LitAir, VeilRays, lit_air, node_distances, ray_pieces, veil_along
from fogsim.atmosphere.visibility.visibility_level import angular_size
from fogsim.lighting.beams import own_head_lamps
from fogsim.units import extinction_from_visibility
from fogsim.values import HeadLamp, Lamp
from fogsim.values.luminous_intensity import luminous_intensity

_EYE_HEIGHT, _SETBACK = 1.08, 2.0
"""Height of a car driver's eyes above the road (AASHTO), and how far they are behind the front bumper [m]."""

_LEVEL = 7.0
"""Visibility level that is asked for [-], as gallen2014 does."""

_NEAREST, FARTHEST = 6.0, 300.0
"""Distances from the eyes between which the object is looked for [m]."""

_DISTANCES = np.geomspace(_NEAREST, FARTHEST, 64)
_PAVEMENT = Pavement()
_BEAMS = Lamp.LOW_BEAM | Lamp.HIGH_BEAM | Lamp.FRONT_FOG


def headlamp_sight_distance(lamps: Lamp, visibility: float, glare: float = 0.0) -> float:
    """Distance from the eyes at which a small object on the road reaches visibility level 7, 0 … `FARTHEST` [m].

    The largest one up to `FARTHEST`: it is looked for from far away on, since with a cut-off the level is not monotone.
    """
    beams = int(lamps & _BEAMS)
    return _sight_distance(beams, extinction_from_visibility(visibility), glare) if beams else 0.0


def own_veil(lamps: Lamp, visibility: float, distance: float) -> float:
    """Veil that the own lamps make of the fog between a driver's eyes and the road up to a distance [m] [cd/m²]."""
    return float(np.interp(distance, _DISTANCES, _veil(int(lamps & _BEAMS), extinction_from_visibility(visibility))))


@lru_cache(maxsize=8192)
def _sight_distance(beams: int, extinction: float, glare: float) -> float:
    lit = own_head_lamps(Lamp(beams), _EYE_HEIGHT, _SETBACK)
    both_ways = np.exp(-2.0 * extinction * _DISTANCES)
    target = _PAVEMENT.target_reflectance / math.pi * _illuminance(lit, 0.5 * _PAVEMENT.target_size) * both_ways
    road = _PAVEMENT.retroreflected_luminance * _illuminance(lit, 0.0) * both_ways
    veil = _veil(beams, extinction)
    background = road + veil
    level = visibility_level(
        target + veil, background, angular_size(_PAVEMENT.target_size, _DISTANCES), adaptation=background + glare
    )
    margin = np.abs(level) - _LEVEL
    seen = np.flatnonzero(margin >= 0.0)
    if not len(seen):
        return 0.0
    last = int(seen[-1])
    if last + 1 == len(_DISTANCES):
        return FARTHEST
    share = margin[last] / (margin[last] - margin[last + 1])
    return float(_DISTANCES[last] + share * (_DISTANCES[last + 1] - _DISTANCES[last]))


def _illuminance(lit: tuple[HeadLamp, ...], height: float) -> NDArray[np.float64]:
    """Illuminance across the lamps' light at a height [m] above the road at all distances, in clear air [lx]."""
    total = np.zeros(len(_DISTANCES))
    for lamp in lit:
        forward, left, up = lamp.offset
        ahead = _DISTANCES - forward
        below = height - _EYE_HEIGHT - up
        squared = ahead**2 + left**2 + below**2
        total += luminous_intensity(lamp.beam, np.arctan(left / ahead), np.arctan(below / ahead)) / squared
    return total


@lru_cache(maxsize=8)
def _air(beams: int) -> LitAir:
    """Light on the ways to the object at all distances."""
    down = np.arctan(_EYE_HEIGHT / _DISTANCES)
    directions = np.stack((np.cos(down), np.zeros_like(down), -np.sin(down)), axis=1).astype(np.float32)
    rays = VeilRays((len(down), 1), directions, *ray_pieces())
    lamps = [(lamp.offset, lamp_table(lamp.beam)) for lamp in own_head_lamps(Lamp(beams), _EYE_HEIGHT, _SETBACK)]
    return lit_air(rays, lamps, Droplets.MODERATE_RADIATION)


def _veil(beams: int, extinction: float) -> NDArray[np.float64]:
    """Veil between the eyes and the object at all distances [cd/m²]."""
    if extinction <= 0.0:
        return np.zeros(len(_DISTANCES))
    even = np.full((1, 1), extinction, np.float32)
    along = veil_along(_air(beams), even, even)
    nodes = node_distances()
    return np.array([np.interp(d, nodes, ray) for d, ray in zip(_DISTANCES, along, strict=True)])
