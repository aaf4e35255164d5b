"""Curves from light to pixel values that cameras have, whatever their description says, and how likely each is."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera, Response
from fogsim.values.camera_response import exposure_of, respond

Floats = NDArray[np.float64]

POINTS = 1025
"""Signals, evenly from 0 to 1, at which a curve is tabulated."""

MOST_SLOPE = 12.0
"""Most light per signal that a curve is taken to have [-]: the ends of S-curves are flat."""

STATED = 0.45
"""Chance that a camera has the response that its description states [-]."""

_OTHERS = {
    "srgb": 0.12,
    "s .5": 0.15,
    "s 1": 0.07,
    "knee .8": 0.1,
    "knee 2.2": 0.06,
    "film 1": 0.06,
    "film": 0.1,
    "2.5": 0.08,
    "1.8": 0.05,
}
"""How likely the other curves are, before they are scaled to the rest of 1 [-]: sRGB, S-curves over it, soft
shoulders, a film curve and powers."""

_OTHER_LINEAR = 0.02
"""The same for light itself [-]."""


class Curves(NamedTuple):
    """Inverse response curves."""

    light: Floats  # Light behind evenly spaced signals, relative to full scale
    slope: Floats  # Its derivative by the signal
    chance: Floats  # (curves,): How likely each is; their sum is 1


@lru_cache(maxsize=8)
def curves_of(camera: Camera) -> Curves:
    """Curves that a camera may have, the stated one first."""
    signal = np.linspace(0.0, 1.0, POINTS)
    others = (
        dict(_OTHERS) if camera.response is not Response.SRGB else {n: c for n, c in _OTHERS.items() if n != "srgb"}
    )
    if camera.response is not Response.LINEAR:
        others["linear"] = _OTHER_LINEAR
    light = [exposure_of(signal, camera.response, camera.black_level)]
    light += [_inverse(name, signal) for name in others]
    weights = np.array(list(others.values()))
    slope = np.clip(np.gradient(np.array(light), signal, axis=1), 1.0 / MOST_SLOPE, MOST_SLOPE)
    return Curves(np.array(light), slope, np.concatenate([[STATED], (1.0 - STATED) * weights / weights.sum()]))


_WHITE, BRIGHT = 7.3, 0.95
"""Light at which a film curve reaches full scale that is not scaled to do so at 1, and signal from which on its light
counts as full scale [-]."""


def _inverse(name: str, signal: Floats) -> Floats:
    light = np.concatenate([[0.0], np.geomspace(1e-6, 1.0, 4000)])
    srgb = respond(light, Response.SRGB)
    kind, _, number = name.partition(" ")
    if kind == "s":
        out = srgb + float(number) * (srgb * srgb * (3.0 - 2.0 * srgb) - srgb)
    elif kind == "knee":
        # The eye's and many sensors' saturation: 1 − exp(−a light).
        bent = (1.0 - np.exp(-float(number) * light)) / (1.0 - np.exp(-float(number)))
        out = respond(bent, Response.SRGB)
    elif kind == "film":
        # Scaled to full scale at its end, or as cameras use it: there hardly anything is so bright.
        light = light if number else _WHITE * light
        bent = light * (2.51 * light + 0.03) / (light * (2.43 * light + 0.59) + 0.14)
        out = respond(bent / bent[-1], Response.SRGB)
        light = np.minimum(light / np.interp(BRIGHT, out, light), 1.0)
    elif kind == "linear":
        out = light
    elif kind == "srgb":
        out = srgb
    else:
        out = light ** (1.0 / float(kind))
    return np.asarray(np.interp(signal, out, light))
