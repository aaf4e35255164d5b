"""How far one sees an object on the road by own lamps in fog: the conventional scenario of gallen2014, section II."""

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.visibility.visibility_level import ALMOST_CERTAIN, angular_size, visibility_level
from fogsim.errors import InputError
from fogsim.values import Beam
from fogsim.values.luminous_intensity import luminous_intensity

_PAPER_DEPTH_AT_VISIBILITY = 3.0
"""k · V_met as gallen2014 rounds ln 20 [-]."""


class FogKind(StrEnum):
    """How fog was made, which sets its droplets."""

    RADIATION = "radiation"
    ADVECTION = "advection"


_VEIL = {FogKind.RADIATION: (0.0089, 0.1241), FogKind.ADVECTION: (0.0288, 0.2591)}


@dataclass(frozen=True, slots=True)
class Pavement:
    """What is looked at.

    Attributes
    ----------
    retroreflected_luminance : float
        Coefficient of retroreflected luminance R_L of the road [cd/m² per lx]; dry asphalt 0.005 … 0.030.
    target_reflectance : float
        Diffuse reflectance of the target [-].
    target_size : float
        Side of the square target that stands on the road [m].
    """

    retroreflected_luminance: float = 0.0125
    target_reflectance: float = 0.08
    target_size: float = 0.18


@dataclass(frozen=True, slots=True)
class Observer:
    """Who looks, and from where.

    Attributes
    ----------
    lamp_height : float
        Of the lamps above the road [m].
    lamp_half_spacing : float
        Distance of each lamp from the middle of the car; the target stands straight ahead of the middle [m].
    age : float
        [years]
    exposure_time : float
        Time of a glance [s].
    probability_factor : float
        k of Adrian's formula [-].
    """

    lamp_height: float = 0.65
    lamp_half_spacing: float = 0.6
    age: float = 25.0
    exposure_time: float = 0.2
    probability_factor: float = ALMOST_CERTAIN


_PAVEMENT, _OBSERVER = Pavement(), Observer()


def high_beam_veil(visibility: float, kind: FogKind) -> float:
    """Luminance of the veil of own high beams, L_v = 1 / (a V_met + b) [cd/m²] (gallen2014 eq. 9); 0 in clear air.

    Takes `visibility` [m].
    """
    if not visibility > 0:
        raise InputError(f"meteorological visibility must be positive [m], got {visibility!r}")
    slope, offset = _VEIL[FogKind(kind)]
    return 0.0 if math.isinf(visibility) else 1.0 / (slope * visibility + offset)


def target_visibility_level(
    beam: Beam,
    distance: NDArray[np.float64],
    *,
    visibility: float,
    veil: float,
    pavement: Pavement = _PAVEMENT,
    observer: Observer = _OBSERVER,
    glare: float = 0.0,
) -> NDArray[np.float64]:
    """Visibility level of the target lit by a pair of own lamps (gallen2014 eqs. 3–8).

    Takes `distance` (n,) [m], `visibility` [m], `veil` [cd/m²], `glare` [cd/m²].
    """
    at_target = _pair_intensity(beam, distance, 0.5 * pavement.target_size, observer)
    at_foot = _pair_intensity(beam, distance, 0.0, observer)
    both_ways = np.exp(-2.0 * _PAPER_DEPTH_AT_VISIBILITY / visibility * distance) / distance**2
    added = veil + glare
    return visibility_level(
        pavement.target_reflectance / math.pi * at_target * both_ways + added,
        pavement.retroreflected_luminance * at_foot * both_ways + added,
        angular_size(pavement.target_size, distance),
        exposure_time=observer.exposure_time,
        age=observer.age,
        probability_factor=observer.probability_factor,
    )


def _pair_intensity(
    beam: Beam, distance: NDArray[np.float64], height: float, observer: Observer
) -> NDArray[np.float64]:
    """Intensity of both lamps together toward a point straight ahead [cd]."""
    aside = np.arctan(observer.lamp_half_spacing / distance)
    up = np.arctan((height - observer.lamp_height) / distance)
    return luminous_intensity(beam, aside, up) + luminous_intensity(beam, -aside, up)


def visibility_distance(
    beam: Beam,
    visibility: float,
    kind: FogKind = FogKind.RADIATION,
    *,
    veil_share: float = 1.0,
    pavement: Pavement = _PAVEMENT,
    observer: Observer = _OBSERVER,
    glare: float = 0.0,
    level: float = 7.0,
    farthest: float = 150.0,
) -> float:
    """Distance at which the target is just visible by own lamps in fog [m] (gallen2014 section II).

    The largest distance up to `farthest` at which the visibility level reaches `level`: with a cut-off the level is not
    monotone, so the scan begins far away. 0 where the target is seen nowhere.

    Parameters
    ----------
    beam : Beam
        One lamp of the pair.
    visibility : float
        Meteorological visibility [m], positive; ``inf`` is clear air.
    kind : FogKind
        Radiation or advection fog.
    veil_share : float
        Veil of this beam over that of high beams [-]: 1 as published; 0.20 to 0.33 for a US low beam, by photons.
    pavement, observer : Pavement, Observer
        What is looked at, and by whom.
    glare : float
        Veil inside the eye from oncoming lamps [cd/m²]; see `veiling_luminance`.
    level : float
        Visibility level asked for, positive.
    farthest : float
        Where the scan begins [m], more than 2.

    Raises
    ------
    InputError
        If an argument is out of its range.
    """
    for name, value in (("veil_share", veil_share), ("glare", glare)):
        if not (value >= 0 and math.isfinite(value)):
            raise InputError(f"{name} must be finite and not negative, got {value!r}")
    if not (level > 0 and farthest > 2):
        raise InputError(f"level must be positive and farthest more than 2 m, got {level!r} and {farthest!r}")
    veil = veil_share * high_beam_veil(visibility, kind)
    distance = np.arange(farthest, 2.0, -0.1)
    levels = np.abs(
        target_visibility_level(
            beam, distance, visibility=visibility, veil=veil, pavement=pavement, observer=observer, glare=glare
        )
    )
    seen = np.flatnonzero(levels >= level)
    if not len(seen):
        return 0.0
    first = int(seen[0])
    if first == 0:
        return farthest
    # Between the last step unseen and the first step seen the level is taken as linear.
    share = (level - levels[first - 1]) / (levels[first] - levels[first - 1])
    return float(distance[first - 1] + share * (distance[first] - distance[first - 1]))
