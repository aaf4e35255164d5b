"""The glow about a pair of tail lamps, over optical depth: what `night_glow` compares pictures with.

The glow is FogSim's own formula (`fogsim.atmosphere.lamps`), for each fog of Shettle & Fenn and for lamps that shine as
tail and stop lamps or as rear fog lamps do; a lens adds glare. Which of these it is, is unknown.
"""

import math
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

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
    """Glow of tail lamps in all fogs, by a table that `fogsim.calibration.tail_glows` made."""
    with (files("fogsim.estimators.night") / "data" / "tail_glows.npz").open("rb") as file, np.load(file) as table:
        plain, shone = table["plain"].astype(np.float64), table["shone"].astype(np.float64)
    found = []
    for of_fog, of_lamps in zip(plain, shone, strict=True):
        for lobe in of_lamps:
            found += [of_fog[..., None] * lobe + _glared(share)[..., None] for share in GLARES]
    return GlowModels(np.log(np.stack(found)))


def _glared(share: float) -> Floats:
    """Luminance (t, g) of a lens's glare, times R² over the intensity [-]."""
    spread = GLARE_SPREADS[:, None]
    each = np.exp(-0.5 * (ANGLES / spread) ** 2) / (2.0 * math.pi * spread**2)
    return np.asarray(share * each.mean(axis=0) * np.exp(-DEPTHS)[:, None])
