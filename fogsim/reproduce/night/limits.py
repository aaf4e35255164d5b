"""Gallen et al. (2014), section II: the veil of figure 2, and the fogs of equations 11 and 12."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.lamps.lamp_tables import lamp_table
from fogsim.atmosphere.lamps.phase_function import Droplets
from fogsim.atmosphere.lamps.veil import FOLD_DISTANCE, INTERVALS, VeilRays, lit_air, ray_pieces, veil_along
from fogsim.atmosphere.visibility.night_visibility import FogKind, high_beam_veil, visibility_distance
from fogsim.lighting.beams import high_beam
from fogsim.units import extinction_from_visibility
from fogsim.values import Beam

_DROPLETS = {FogKind.RADIATION: Droplets.MODERATE_RADIATION, FogKind.ADVECTION: Droplets.HEAVY_ADVECTION}
"""Droplets that stand for the paper's two types of fog."""

_LAMPS = ((1.8, 0.6, -0.85), (1.8, -0.6, -0.85))  # of a car, from its camera [m]
_TARGET, _BELOW = 40.0, math.radians(2.02)  # a point on the road [m], and its angle below the horizon [rad]
_VISIBILITIES = np.geomspace(20.0, 5000.0, 120)


def veil_luminance(beam: Beam, visibilities: Sequence[float], kind: FogKind) -> list[float]:
    """Luminance of the veil of two such lamps in front of a point on the road 40 m ahead, by FogSim's model [cd/m²]."""
    towards = np.array([[math.cos(_BELOW), 0.0, -math.sin(_BELOW)]], np.float32)
    table = lamp_table(beam)
    air = lit_air(VeilRays((1, 1), towards, *ray_pieces()), [(place, table) for place in _LAMPS], _DROPLETS[kind])
    node = _TARGET / (_TARGET + FOLD_DISTANCE) * INTERVALS
    found = []
    for visibility in visibilities:
        k = np.full((1, 1), extinction_from_visibility(visibility), np.float32)
        found.append(float(np.interp(node, np.arange(INTERVALS + 1), veil_along(air, k, k)[0])))
    return found


def limits(low: Beam, kind: FogKind, veil_share: float | None = 1.0) -> tuple[float, float]:
    """V_met from which high beams show more than low beams in the same fog (eq. 11) and in clear air (eq. 12) [m].

    `veil_share` is the veil of low beams over that of high beams, which is equation 9's; with None both beams have the
    veil of FogSim's model. The result is 20 where high beams show more in any fog.
    """
    by_high = _sights(high_beam(), kind, None if veil_share is None else 1.0)
    by_low, in_clear_air = _sights(low, kind, veil_share), visibility_distance(low, math.inf)
    return _turning_point(by_high - by_low), _turning_point(by_high - in_clear_air)


def _sights(beam: Beam, kind: FogKind, veil_share: float | None) -> NDArray[np.float64]:
    """Distance at which the target is seen in fog of each visibility [m]."""
    visibilities = _VISIBILITIES.tolist()
    shares = [veil_share or 0.0] * len(visibilities)
    if veil_share is None:
        veils = veil_luminance(beam, visibilities, kind)
        shares = [veil / high_beam_veil(v, kind) for veil, v in zip(veils, visibilities, strict=True)]
    pairs = zip(visibilities, shares, strict=True)
    return np.array([visibility_distance(beam, v, kind, veil_share=share) for v, share in pairs])


def _turning_point(difference: NDArray[np.float64]) -> float:
    """Visibility above which a difference stays positive [m]."""
    below = np.flatnonzero(difference <= 0.0)
    if not len(below):
        return float(_VISIBILITIES[0])
    around = slice(int(below[-1]), int(below[-1]) + 2)
    return float(np.exp(np.interp(0.0, difference[around], np.log(_VISIBILITIES[around]))))
