"""Figure 2 of gallen2014, and the fogs from which on high beams show less than low beams: its equations 11 and 12."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from fogsim.atmosphere.lamps.lamp_tables import lamp_table
from fogsim.atmosphere.lamps.phase_function import Droplets
from fogsim.atmosphere.lamps.veil import FOLD_DISTANCE, INTERVALS, lit_air, ray_pieces, veil_along
from fogsim.atmosphere.lamps.veil_kernels import VeilRays
from fogsim.atmosphere.visibility.night_visibility import FogKind, visibility_distance
from fogsim.lighting.beams import high_beam
from fogsim.units import extinction_from_visibility
from fogsim.values import Beam

DROPLETS = {FogKind.RADIATION: Droplets.MODERATE_RADIATION, FogKind.ADVECTION: Droplets.HEAVY_ADVECTION}
"""Droplets that are taken for the paper's kinds of fog."""

_LAMPS = ((1.8, 0.6, -0.85), (1.8, -0.6, -0.85))  # of a car, from its camera [m]
_TARGET, _BELOW = 40.0, math.radians(2.02)  # a point on the road [m], and how far it is below the horizon [rad]


def veil_luminance(beam: Beam, visibilities: Sequence[float], kind: FogKind) -> list[float]:
    """Luminance of the own lamps' veil before a point on the road 40 m ahead, by FogSim's model [cd/m²].

    Parameters
    ----------
    beam : Beam
        Of one of two lamps.
    visibilities : sequence of float
        Meteorological visibilities [m].
    kind : FogKind
        Kind of the fog.
    """
    towards = np.array([[math.cos(_BELOW), 0.0, -math.sin(_BELOW)]], np.float32)
    table = lamp_table(beam)
    air = lit_air(VeilRays((1, 1), towards, *ray_pieces()), [(place, table) for place in _LAMPS], DROPLETS[kind])
    node = _TARGET / (_TARGET + FOLD_DISTANCE) * INTERVALS
    found = []
    for visibility in visibilities:
        k = np.full((1, 1), extinction_from_visibility(visibility), np.float32)
        found.append(float(np.interp(node, np.arange(INTERVALS + 1), veil_along(air, k, k)[0])))
    return found


def equal_sight(low: Beam, kind: FogKind, veil_share: float) -> float:
    """V_met at which high and low beams show equally far [m] (eq. 11); 20 where they do in any fog.

    Parameters
    ----------
    low : Beam
        The low beam.
    kind : FogKind
        Kind of the fog.
    veil_share : float
        Veil of low beams over that of high beams [-].
    """
    return _turning_point(
        lambda v: visibility_distance(high_beam(), v, kind) - visibility_distance(low, v, kind, veil_share=veil_share)
    )


def clear_low_sight(low: Beam, kind: FogKind) -> float:
    """V_met at which high beams show as far as low beams do in clear air [m] (eq. 12).

    Parameters
    ----------
    low : Beam
        The low beam.
    kind : FogKind
        Kind of the fog.
    """
    far = visibility_distance(low, math.inf)
    return _turning_point(lambda v: visibility_distance(high_beam(), v, kind) - far)


def _turning_point(difference: Callable[[float], float], low: float = 20.0, high: float = 5000.0) -> float:
    """Visibility at which a difference turns positive [m], `low` if it is so all along."""
    if difference(low) > 0:
        return low
    for _ in range(40):
        middle = math.sqrt(low * high)
        low, high = (low, middle) if difference(middle) > 0 else (middle, high)
    return high
