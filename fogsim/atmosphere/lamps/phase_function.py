"""Where fog droplets scatter light to: phase functions by Mie theory of the fogs of Shettle & Fenn (1979)."""

import math
from dataclasses import dataclass
from enum import StrEnum
from functools import cache, lru_cache
from importlib.resources import files

import numpy as np
from numpy.typing import ArrayLike, NDArray


class Droplets(StrEnum):
    """Droplet size distributions of Shettle & Fenn (1979): from advection of moist air, or from radiative cooling."""

    HEAVY_ADVECTION = "heavy_advection"
    MODERATE_ADVECTION = "moderate_advection"
    HEAVY_RADIATION = "heavy_radiation"
    MODERATE_RADIATION = "moderate_radiation"


@dataclass(frozen=True, slots=True)
class PhaseFunction:
    """Share of scattered light per solid angle, over the scattering angle; its integral over the sphere is 1."""

    angle: NDArray[np.float64]  # (n,): Ascending scattering angles from 0, straight on, to π, straight back [rad]
    value: NDArray[np.float64]  # (n,): Phase function [1/sr]

    def __call__(self, angle: ArrayLike) -> NDArray[np.float64]:
        """Phase function at scattering angles [rad], interpolated in its logarithm [1/sr]."""
        return np.asarray(np.exp(np.interp(np.asarray(angle, dtype=np.float64), self.angle, np.log(self.value))))


@cache
def phase_function(droplets: Droplets) -> PhaseFunction:
    """Phase function of fog by its droplets, at 0.55 µm (Mie theory; `benchmarks/mie_phase.py` made the table).

    Extinction and phase functions of droplets that are larger than the wavelength hardly depend on colour.
    """
    path = files("fogsim.atmosphere") / "data" / "phase_functions.csv"
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    column = lines[0].split(",").index(Droplets(droplets))
    table = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    return PhaseFunction(np.radians(table[:, 0]), np.ascontiguousarray(table[:, column]))


def henyey_greenstein(angle: ArrayLike, asymmetry: float) -> NDArray[np.float64]:
    """Phase function of Henyey & Greenstein (1941), p = (1 − g²) / (4π (1 + g² − 2 g cos θ)^(3/2)) [1/sr].

    Takes `angle` [rad].
    """
    cosine = np.cos(np.asarray(angle, dtype=np.float64))
    square = asymmetry * asymmetry
    return np.asarray((1.0 - square) / (4.0 * math.pi * (1.0 + square - 2.0 * asymmetry * cosine) ** 1.5))


def blurred(phase: PhaseFunction, width: float) -> PhaseFunction:
    """Phase function after light's direction has been spread, as by earlier scattering at small angles.

    Takes `width` [rad].
    """
    log, (place, beyond) = np.log(phase.value), _rings(width, phase.angle.tobytes())
    slope = np.diff(log, append=log[-1]) / np.diff(phase.angle, append=np.inf)
    around = np.exp(slope.take(place) * beyond + log.take(place))
    return PhaseFunction(_BLURRED_ANGLES, around.mean(axis=(1, 2)))


_BLURRED_ANGLES = np.linspace(0.0, math.pi, 361)
_BLURRED_ANGLES.flags.writeable = False


@lru_cache(4)
def _rings(width: float, known: bytes) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Directions around others, by how much light is spread there: the known angle below each, and that beyond it."""
    # A ring at distance ε about direction θ lies at angles acos(cos θ cos ε − sin θ sin ε cos ψ) from the axis.
    ring = width * np.sqrt(-2.0 * np.log(1.0 - (np.arange(24) + 0.5) / 24))
    turn, angle = math.pi * (np.arange(24) + 0.5) / 24, _BLURRED_ANGLES
    cosine = np.cos(angle)[:, None, None] * np.cos(ring)[:, None] - np.sin(angle)[:, None, None] * np.sin(ring)[
        :, None
    ] * np.cos(turn)
    found, angles = np.arccos(np.clip(cosine, -1.0, 1.0)), np.frombuffer(known)
    place = np.searchsorted(angles, found, side="right") - 1
    return place, found - angles.take(place)
