"""The glow about a pair of tail lamps, over optical depth: what `night_glow` compares pictures with.

The glow is FogSim's own formula (`fogsim.atmosphere.lamps`), for each fog of Shettle & Fenn and for lamps that shine as
tail and stop lamps or as rear fog lamps do; a lens adds glare. Which of these it is, is unknown.
"""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.lamps.glow import glow
from fogsim.atmosphere.lamps.lobes import light_origins, mean_intensity
from fogsim.atmosphere.lamps.phase_function import Droplets
from fogsim.values.light import Beam

Floats = NDArray[np.float64]

DEPTHS = np.geomspace(0.03, 6.0, 36)
"""Optical depths τ = k R [-]."""

ANGLES = np.radians(np.geomspace(0.3, 25.0, 36))
"""Angles off a lamp [rad]."""

GLARES = (0.0, 0.01, 0.03)
"""Shares of the lamps' light that a lens may scatter [-]."""

GLARE_SPREADS = np.radians((0.12, 0.48, 1.9, 7.7))
"""Standard deviations of the Gaussians among which that light is evenly divided [rad]: about the inverse square of the
angle, as smooth surfaces scatter it (CIE 146)."""

_DIRECTIONS = np.radians((-80.0, -45.0, -30.0, -20.0, -10.0, -5.0, 0.0, 5.0, 10.0, 20.0, 30.0, 45.0, 80.0))
_ELEVATIONS = np.radians((-30.0, -15.0, -10.0, -5.0, 0.0, 5.0, 10.0, 15.0, 30.0))
_SHARES = (
    ((0.012, 0.03, 0.06, 0.12, 0.35, 0.9, 1.0), (0.03, 0.12, 0.3, 0.7, 1.0)),
    ((0.005, 0.03, 0.08, 0.2, 0.75, 0.92, 1.0), (0.02, 0.1, 0.25, 0.75, 1.0)),
)
"""Least intensities aside and above, from the outermost direction inward, of what UNECE R148 asks of tail and stop
lamps, and of rear fog lamps, over that along the axis; beyond its grids, what its fields of visibility ask."""


@dataclass(frozen=True, slots=True)
class GlowModels:
    """Glow about one lamp by every hypothesis.

    Attributes
    ----------
    log_glow : (h, t, g, SIDES) float64
        Ln of the luminance times R² over the axial intensity, for hypotheses, `DEPTHS`, `ANGLES` and the side of the
        lamp, as the lamp sees it: right, right above, above …
    """

    log_glow: Floats

    def about(self, angle: Floats, side: Floats) -> Floats:
        """Glow (h, t, n) at points about a lamp, linear.

        Parameters
        ----------
        angle : (n,) float64
            Angle off the lamp [rad].
        side : (n,) float64
            Direction about it, counterclockwise from its right as the lamp sees it [rad].
        """
        table = self.log_glow
        row = np.clip(np.interp(np.log(angle), np.log(ANGLES), np.arange(len(ANGLES))), 0.0, len(ANGLES) - 1.001)
        low, part = row.astype(np.int64), row % 1.0
        sides = table.shape[3]
        turn = (side / (2.0 * math.pi) * sides) % sides
        left, rest = turn.astype(np.int64) % sides, turn % 1.0
        right = (left + 1) % sides
        near = table[:, :, low, left] * (1.0 - rest) + table[:, :, low, right] * rest
        far = table[:, :, low + 1, left] * (1.0 - rest) + table[:, :, low + 1, right] * rest
        return np.asarray(np.exp(near * (1.0 - part) + far * part))


@cache
def tail_glows() -> GlowModels:
    """Glow of tail lamps in all fogs; computing it takes about a second, once a process."""
    found = []
    for droplets in Droplets:
        plain = glow(DEPTHS[:, None], ANGLES, droplets)
        for aside, above in _SHARES:
            shone = _shone(aside, above, droplets)
            found += [plain[..., None] * shone + _glared(share)[..., None] for share in GLARES]
    return GlowModels(np.log(np.stack(found)))


def _glared(share: float) -> Floats:
    """Luminance (t, g) of a lens's glare, times R² over the intensity [-]."""
    spread = GLARE_SPREADS[:, None]
    each = np.exp(-0.5 * (ANGLES / spread) ** 2) / (2.0 * math.pi * spread**2)
    return np.asarray(share * each.mean(axis=0) * np.exp(-DEPTHS)[:, None])


def _shone(aside: tuple[float, ...], above: tuple[float, ...], droplets: Droplets) -> Floats:
    """Mean intensity (t, g, SIDES) over the axial one of what is seen of a lamp's glow straight behind it."""
    across = np.array([*aside, *aside[-2::-1]])
    upward = np.array([*above, *above[-2::-1]])
    lobe = Beam(_DIRECTIONS, _ELEVATIONS, upward[:, None] * across)
    origins, straight = light_origins(droplets), np.zeros(1)
    mean = mean_intensity(lobe, straight, straight, droplets)[0]
    row = np.clip(np.interp(np.log(DEPTHS), origins.log_depth, np.arange(len(mean))), 0.0, len(mean) - 1.001)
    low, part = row.astype(np.int64), (row % 1.0)[:, None, None]
    at_depth = mean[low] * (1.0 - part) + mean[low + 1] * part
    column = np.interp(np.log(ANGLES), np.log(origins.angle), np.arange(len(origins.angle)))
    column = np.clip(column, 0.0, len(origins.angle) - 1.001)
    left, rest = column.astype(np.int64), (column % 1.0)[:, None]
    return np.asarray(at_depth[:, left] * (1.0 - rest) + at_depth[:, left + 1] * rest)
