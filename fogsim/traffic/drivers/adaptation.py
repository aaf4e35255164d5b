"""Thresholds of a driver's eyes, which follow the light they are adapted to, from a moonless night to the day.

The adaptation luminance is that of the fog in the sky's light, of what the own head lamps light, and of the veil that
others' head lamps lay over the eye. Adrian's threshold (1989) says how much more contrast and how much less light of a
lamp the eye asks for then than by day: a contrast threshold goes as (√φ/α + √L)²/L, the illuminance at which a lamp is
noticed, too small to have a size, as φ. By day both are what they are taken to be in fog and on roads.
"""

import functools
import math
from typing import NamedTuple

import numpy as np

from fogsim.core.jit import kernel
from fogsim.units import DAY_ILLUMINANCE
from fogsim.values.eye import flux_root, luminance_root
from fogsim.values.fog import AIRLIGHT_SHARE

DAY_EYE_THRESHOLD = 1e-3
"""Illuminance at the eye at which a lamp is noticed by day, before fog of `_BRIGHT_LUMINANCE` and more [lx]."""

_BRIGHT_LUMINANCE = 302.0
"""Luminance before which no lamp needs more light to be noticed than before less [cd/m²]."""

HEAD_LAMP_LUMINANCE = 0.28
"""Luminance to which eyes are adapted in the light of the own head lamps alone [cd/m²].

A road lit by halogen low beams has 0.5, 0.2, 0.05 cd/m² at 10, 20, 40 m (FHWA, Enhanced Night Visibility Series VII,
appendix I). With it Adrian's φ takes `DAY_EYE_THRESHOLD` to 1.0·10⁻⁵ lx at night, where 10⁻⁶ … 10⁻⁵ lx are known for
roads at night. It counts for drivers whose own head lamps are dark, too: eyes take minutes to adapt further.
"""

VEHICLE_SIZE = 1.5
"""Size of what a driver looks for [m]: a car's height."""

_MINUTES = math.degrees(VEHICLE_SIZE) * 60.0
"""Angular size of a vehicle times its distance [minutes of arc · m]."""

# Adrian's formulas change at 0.6 cd/m² by a jump of 1 %: between points on either side there is none.
_LOG_LUMINANCES = np.linspace(-3.0, 5.0, 81)
_LOG_FLUX_ROOTS = np.log10(flux_root(10.0**_LOG_LUMINANCES))
_LOG_LUMINANCE_ROOTS = np.log10(luminance_root(10.0**_LOG_LUMINANCES))


def airlight_luminance(illuminance: float, share: float = AIRLIGHT_SHARE) -> float:
    """Luminance of fog under an overcast sky [cd/m²] (`illuminance` [lx])."""
    return share * illuminance / math.pi


def _roots(luminance: float) -> tuple[float, float]:
    """√φ and √L of Adrian's formula."""
    log = math.log10(luminance)
    flux, extended = (np.interp(log, _LOG_LUMINANCES, roots) for roots in (_LOG_FLUX_ROOTS, _LOG_LUMINANCE_ROOTS))
    return 10.0 ** float(flux), 10.0 ** float(extended)


_DAY_LUMINANCE = airlight_luminance(DAY_ILLUMINANCE)
_DAY_FLUX_ROOT, _DAY_LUMINANCE_ROOT = _roots(_DAY_LUMINANCE)
_BRIGHT_FLUX_ROOT, _ = _roots(_BRIGHT_LUMINANCE)


class Adaptation(NamedTuple):
    """Eyes that are adapted; made by `adaptation`."""

    airlight: float  # Luminance of the fog in the sky's light [cd/m²]
    # What the eye sees behind a vehicle and is adapted to [cd/m²]: the airlight, what the own head lamps light, and the
    # veil of glare
    luminance: float
    eye_threshold: float  # Illuminance at the eye at which a lamp is noticed [lx]
    # flux_root, luminance_root: √φ and √L of Adrian's formula
    flux_root: float
    luminance_root: float


@kernel
def contrast_ratio(eyes: Adaptation, distance: float) -> float:
    """Smallest contrast at which a vehicle is noticed at a distance [m] over that by day [-]: more in the dark."""
    # By day Koschmieder's law knows one threshold, for small and large, in dim light and in bright.
    if eyes.luminance >= _DAY_LUMINANCE:
        return 1.0
    by_size = distance / _MINUTES
    least = eyes.flux_root * by_size + eyes.luminance_root
    by_day = _DAY_FLUX_ROOT * by_size + _DAY_LUMINANCE_ROOT
    return max((least / by_day) ** 2 * _DAY_LUMINANCE / eyes.luminance, 1.0)


@functools.lru_cache(maxsize=256)
def adaptation(illuminance: float, glare: float = 0.0, share: float = AIRLIGHT_SHARE) -> Adaptation:
    """Eyes adapted to the light of the sky [lx], of the own head lamps, and to glare [cd/m²]."""
    airlight = airlight_luminance(illuminance, share)
    luminance = airlight + HEAD_LAMP_LUMINANCE + glare
    flux, extended = _roots(min(luminance, _BRIGHT_LUMINANCE))
    return Adaptation(airlight, luminance, DAY_EYE_THRESHOLD * (flux / _BRIGHT_FLUX_ROOT) ** 2, flux, extended)


NIGHT_EYE_THRESHOLD = adaptation(0.0).eye_threshold
"""Illuminance at the eye at which a lamp is noticed on a road in the dark [lx]."""
