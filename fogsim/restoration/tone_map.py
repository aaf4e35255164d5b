"""A tone map for restored pictures that are looked at."""

import numpy as np

from fogsim.restoration.picture import Floats, FoggyPicture, Light, ToneCurve
from fogsim.units import LUMINANCE_WEIGHTS

KEY = 0.18
"""Luminance that the middle of what is seen gets, relative to full scale [-] (Reinhard et al. 2002)."""

BRIGHT, WHITE, DARKEST = 0.99, 1.25, 0.01
"""White is so many times what this share of the picture is darker than; what is darker than that share of the airlight
counts as that [-]."""


def tone_curve(light: Floats, transmission: Floats, picture: FoggyPicture) -> ToneCurve:
    """Curve that brings out what the fog lets through: L (1 + L / L_w²) / (1 + L) (Reinhard et al. 2002, eq. 4).

    L is light over its logarithmic mean, times 0.18. Unlike the paper's, the mean is weighted by transmission: the sky
    and what the fog has hidden, which are brighter than all else, do not make the road black.

    Takes `light` (rows, cols, channels), `transmission` (rows, cols).
    """
    some = light.astype(np.float64) * picture.airlight
    luminance = some[..., 0] if some.shape[2] == 1 else (some * LUMINANCE_WEIGHTS).sum(axis=2)
    luminance = np.maximum(luminance, DARKEST * float(picture.airlight.max()))
    weights = transmission.astype(np.float64)
    middle = float(np.exp((weights * np.log(luminance)).sum() / weights.sum()))
    exposure = KEY / middle
    white = max(exposure * WHITE * float(np.quantile(luminance, BRIGHT)), 1.0)

    def curve(shown: Light) -> Light:
        scaled = exposure * shown
        return np.asarray(scaled * (1.0 + scaled / white**2) / (1.0 + scaled))

    return curve
