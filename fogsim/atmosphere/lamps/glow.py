"""Glow about a lamp in fog: light that droplets scatter out of its way and into the eye.

Light that an isotropic point source of intensity I at a distance R sends past the eye is scattered once into a line of
sight at an angle γ from the source with the luminance

    L(γ) = ∫ k p(Θ) I e^(−k (s + r)) / s² dr = I / R² · P₁(γ, τ),        τ = k R.

In fog more than τ ≈ 1 away most light is scattered several times, at small angles each. As in the veil of own lamps,
light that was scattered a little is not lost but goes on, spread: the glow is the sum of three such integrals,

    P = P₁[p, η₁] + (P₁[p₂, η₂] − P₁[p₂, η₁]) + (P₁[p₃, η₃] − P₁[p₃, η₂]),

each with its part η of the extinction and with phase functions p₂, p₃ that are blurred ever wider. 1 − η₁ is what the
droplets scatter by less than a degree. For τ → 0 that is single scattering. The other four numbers were fitted to
photons (`benchmarks/monte_carlo.py halo`); the docs have the deviations, and those of Narasimhan & Nayar's series.
"""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogsim.atmosphere.lamps.phase_function import Droplets, PhaseFunction, blurred, phase_function

_SPREADS = (0.42, 0.91)
"""Widths by which the phase functions p₂ and p₃ are blurred [rad]."""

_LOSS_ONCE_SPREAD = 0.70
"""η₂: part of the extinction that light suffers which was spread a little [-]."""

_LOSS_OF_DIFFUSE_LIGHT = 1.5
"""η₃ / (1 − g): light that was spread widely is lost by what droplets turn round, as in diffusion theory [-]."""

_FORWARD = math.radians(1.0)
"""Scattering angle below which light is not lost at all [rad]."""

FOLD_CHORD = 0.15
"""Chord that is placed half-way in the table's direction of angles [-]."""

_CHORDS = 144
_DEPTHS = np.geomspace(0.02, 16.0, 30)
_STEPS = 240


def scattered_once(
    depth: ArrayLike, angle: ArrayLike, phase: PhaseFunction, loss: float = 1.0, steps: int = _STEPS
) -> NDArray[np.float64]:
    """P₁: luminance scattered once about a point source, times R² over its intensity [-].

    The line of sight is walked by the angle at which it is seen from the source, which makes the integrand flat.

    Takes `angle` [rad].
    """
    sight = _lines_of_sight(depth, angle, steps)
    return _scattered(sight, phase(sight.scattering), loss)


@dataclass(frozen=True, slots=True)
class _LinesOfSight:
    """Steps along lines of sight, in the last axis; see `scattered_once`."""

    # (…, angles, steps): Scattering angle, which the depth of the source does not change [rad]
    scattering: NDArray[np.float64]
    way: NDArray[np.float64]  # (…, steps): Optical depth from the source to the step and from there to the eye [-]
    weight: NDArray[np.float64]  # (steps,): Of the steps [-]
    scale: NDArray[np.float64]  # (…): What the mean over steps is multiplied with [rad]


def _lines_of_sight(depth: ArrayLike, angle: ArrayLike, steps: int) -> _LinesOfSight:
    t, gamma = np.asarray(depth, dtype=np.float64)[..., None], np.asarray(angle, dtype=np.float64)[..., None]
    even = (np.arange(steps) + 0.5) / steps
    # The scattering angle runs from γ at the eye to π at infinity, in steps that are small where γ may be in the peak.
    scattering = gamma + (math.pi - gamma) * even**3
    sine = np.sin(gamma)
    way = t * sine / np.sin(scattering)
    to_eye = t * (np.cos(gamma) - sine * np.cos(scattering) / np.sin(scattering))
    return _LinesOfSight(scattering, way + to_eye, even**2, ((math.pi - gamma) * t / sine)[..., 0])


def _scattered(sight: _LinesOfSight, phase: NDArray[np.float64], loss: float) -> NDArray[np.float64]:
    """P₁, with the phase function at the steps' scattering angles [1/sr]."""
    lit = phase * np.exp(-loss * sight.way)
    return np.asarray((lit * 3.0 * sight.weight).mean(axis=-1) * sight.scale)


def glow(depth: ArrayLike, angle: ArrayLike, droplets: Droplets) -> NDArray[np.float64]:
    """P: luminance scattered about a lamp, times R² over its intensity [-]; see the module (`angle` [rad])."""
    phase, (first, last) = phase_function(droplets), _losses(droplets)
    sight = _lines_of_sight(depth, angle, _STEPS)
    total = _scattered(sight, phase(sight.scattering), first)
    for wide, loss in zip(_blurred_phases(droplets), (_LOSS_ONCE_SPREAD, last), strict=True):
        turned = wide(sight.scattering)
        more = _scattered(sight, turned, loss) - _scattered(sight, turned, first)
        total = total + np.maximum(more, 0.0)
        first = min(first, loss)
    return total


@cache
def _losses(droplets: Droplets) -> tuple[float, float]:
    """η₁ and η₃."""
    phase = phase_function(droplets)
    return 1.0 - forward_share(phase), _LOSS_OF_DIFFUSE_LIGHT * (1.0 - mean_cosine(phase))


@cache
def _blurred_phases(droplets: Droplets) -> tuple[PhaseFunction, ...]:
    return tuple(blurred(phase_function(droplets), spread) for spread in _SPREADS)


def mean_cosine(phase: PhaseFunction) -> float:
    """Mean cosine g of the scattering angle."""
    theta = np.linspace(0.0, math.pi, 20001)
    return float(2.0 * math.pi * np.trapezoid(phase(theta) * np.sin(theta) * np.cos(theta), theta))


def forward_share(phase: PhaseFunction, angle: float = _FORWARD) -> float:
    """Share of light that droplets scatter by less than an angle (`angle` [rad])."""
    theta = np.linspace(0.0, angle, 400)
    return float(2.0 * math.pi * np.trapezoid(phase(theta) * np.sin(theta), theta))


def narasimhan_nayar(depth: float, angle: ArrayLike, asymmetry: float = 0.9, terms: int = 200) -> NDArray[np.float64]:
    """Glow by the series of Narasimhan & Nayar (2003), "Shedding light on the weather", times T² (eqs. 5.25–5.28).

    For comparison: FogSim does not draw with it. It knows no single scattering and diverges for τ ≤ 1.

    Takes `angle` [rad].
    """
    if not depth > 1.0:
        raise ValueError(f"the series of Narasimhan and Nayar converges for optical depths above 1, got {depth!r}")
    m = np.arange(1, terms + 2, dtype=np.float64)
    powers = np.exp(-(2 * m + 1) / m * (1 - asymmetry ** (m - 1)) * depth - (m - 1) * math.log(depth))
    coefficients = np.concatenate(([powers[0]], powers[:-1] + powers[1:]))
    return np.asarray(np.polynomial.legendre.legval(np.cos(np.asarray(angle, dtype=np.float64)), coefficients))


@dataclass(frozen=True, slots=True)
class GlowTable:
    """Glow over optical depth and angle."""

    log_depth: NDArray[np.float64]  # (t,): ln τ of the rows, evenly spaced
    # (t, c): ln(P c / τ), over chords c = 2 sin(γ/2) that lie evenly over c / (c + FOLD_CHORD)
    log_glow: NDArray[np.float64]


@cache
def glow_table(droplets: Droplets) -> GlowTable:
    """Table of the glow in fog; computing it takes a fraction of a second."""
    folded = (np.arange(_CHORDS) / (_CHORDS - 1)) * (1.98 / (1.98 + FOLD_CHORD))
    chord = np.maximum(FOLD_CHORD * folded / (1.0 - folded), 1e-4)
    values = glow(_DEPTHS[:, None], 2.0 * np.arcsin(chord / 2.0), droplets)
    return GlowTable(np.log(_DEPTHS), np.log(np.maximum(values, 1e-12) * chord / _DEPTHS[:, None]))
