"""Least squares of a picture by cells: amplitudes of veil, road and even light, and the misfit, for each reference."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel

Floats = NDArray[np.float64]

AMPLITUDES = 4
"""Veil, road, even light, and how far the picture is shifted [cells]."""

_ROUNDS = 6
_RELATIVE = 0.02
"""Deviation of what the model says, over what it says: texture of the road, and what the model leaves out [-]."""

_SOFT = 1.5
"""Deviations from which on a cell that is too bright counts less: light of others only adds."""

_HARD = 3.0
"""The same of a cell that is too dark, where something stands before the road."""


class Parts(NamedTuple):
    """What each reference has in the cells in use.

    Attributes
    ----------
    veil, road : (n, cells) float64
        Luminance of both [cd/m²].
    veil_slope, road_slope : (n, cells) float64
        How both grow when the picture is shifted downward by a cell [cd/m²].
    """

    veil: Floats
    road: Floats
    veil_slope: Floats
    road_slope: Floats


class VeilFit(NamedTuple):
    """Fits of all references.

    Attributes
    ----------
    misfit : (n,) float64
        Mean of the squared deviations of the cells by which each was fitted, over their variances [-].
    amplitude : (n, AMPLITUDES) float64
        Of veil and road [grey levels per cd/m²], even light [grey levels] and shift downward [cells].
    weight : (cells,) float64
        How much each cell counts, 0 … 1: little where it is brighter than lamps and road make it.
    explained : float
        Share of the cells' variance that the best fit explains [-].
    """

    misfit: Floats
    amplitude: Floats
    weight: Floats
    explained: float


@kernel
def fit_veil(seen: Floats, floor: float, parts: Parts, most_shift: float) -> VeilFit:
    """Fit every reference to the same cells, of which those count less that are brighter than the best one has them.

    Parameters
    ----------
    seen : (cells,) float64
        Luminance of the cells in use [grey levels].
    floor : float
        Deviation of dark cells [grey levels].
    parts : Parts
        The references.
    most_shift : float
        Standard deviation of the shift [cells].
    """
    veil, road, veil_slope, road_slope = parts
    number, cells = veil.shape
    misfit, amplitude = np.full(number, np.inf), np.zeros((number, AMPLITUDES))
    precision, weight = np.empty(cells), np.ones(cells)
    for cell in range(cells):
        precision[cell] = 1.0 / ((_RELATIVE * seen[cell]) ** 2 + floor**2)
    best = 0
    for _ in range(_ROUNDS):
        for i in range(number):
            misfit[i] = _fit_one(
                seen, precision * weight, veil[i], road[i], veil_slope[i], road_slope[i], most_shift, amplitude[i]
            )
        best = int(np.argmin(misfit))
        a, b, even, shift = amplitude[best]
        for cell in range(cells):
            model = a * (veil[best, cell] + shift * veil_slope[best, cell]) + even
            model += b * (road[best, cell] + shift * road_slope[best, cell])
            above = (seen[cell] - model) * np.sqrt(precision[cell])
            limit = _SOFT if above > 0.0 else _HARD
            weight[cell] = min(1.0, (limit / max(abs(above), 1e-9)) ** 2)
    left, whole, mean, total = 0.0, 0.0, 0.0, 0.0
    a, b, even, shift = amplitude[best]
    for cell in range(cells):
        mean += weight[cell] * seen[cell]
        total += weight[cell]
    mean /= total
    for cell in range(cells):
        model = a * (veil[best, cell] + shift * veil_slope[best, cell]) + even
        model += b * (road[best, cell] + shift * road_slope[best, cell])
        left += weight[cell] * (seen[cell] - model) ** 2
        whole += weight[cell] * (seen[cell] - mean) ** 2
    return VeilFit(misfit, amplitude, weight, 1.0 - left / max(whole, 1e-12))


@kernel
def _fit_one(
    seen: Floats,
    precision: Floats,
    veil: Floats,
    road: Floats,
    veil_slope: Floats,
    road_slope: Floats,
    most_shift: float,
    amplitude: Floats,
) -> float:
    """Amplitudes of one reference, in place, none of the light's below 0, and the misfit."""
    shift = amplitude[3]
    sums = np.zeros((3, 3))
    side = np.zeros(3)
    power = total = 0.0
    for cell in range(seen.size):
        p = precision[cell]
        a, b = veil[cell] + shift * veil_slope[cell], road[cell] + shift * road_slope[cell]
        y = seen[cell]
        sums[0, 0] += p * a * a
        sums[0, 1] += p * a * b
        sums[0, 2] += p * a
        sums[1, 1] += p * b * b
        sums[1, 2] += p * b
        sums[2, 2] += p
        side[0] += p * a * y
        side[1] += p * b * y
        side[2] += p * y
        power += p * y * y
        total += 1.0
    least = _least_positive(sums, side, power, amplitude)
    # One step towards the shift that fits better.
    gain, force = 1.0 / max(most_shift, 1e-9) ** 2, -shift / max(most_shift, 1e-9) ** 2
    for cell in range(seen.size):
        slope = amplitude[0] * veil_slope[cell] + amplitude[1] * road_slope[cell]
        model = amplitude[0] * veil[cell] + amplitude[1] * road[cell] + amplitude[2] + shift * slope
        gain += precision[cell] * slope * slope
        force += precision[cell] * slope * (seen[cell] - model)
    amplitude[3] = min(max(shift + force / gain, -3.0 * most_shift), 3.0 * most_shift)
    return max(least, 0.0) / total


@kernel
def _least_positive(sums: Floats, side: Floats, power: float, amplitude: Floats) -> float:
    """Least squares of three amplitudes, none below 0: the best of all choices of those that are not 0."""
    least = np.inf
    for choice in range(1, 8):
        found = np.zeros(3)
        if not _solve(sums, side, choice, found):
            continue
        rest = power
        for i in range(3):
            rest -= found[i] * side[i]
        if rest < least:
            least = rest
            amplitude[:3] = found
    return least


@kernel
def _solve(sums: Floats, side: Floats, choice: int, found: Floats) -> bool:
    """Solve the normal equations of some of the three by elimination; False if they have no positive solution."""
    rows = np.zeros((3, 4))
    for i in range(3):
        rows[i, i] = 1.0
        if (choice >> i) & 1:
            rows[i, 3] = side[i]
            for j in range(3):
                rows[i, j] = sums[min(i, j), max(i, j)] if (choice >> j) & 1 else 0.0
    for i in range(3):
        if rows[i, i] <= 1e-12 * max(sums[i, i], 1e-300):
            return False
        for k in range(i + 1, 3):
            rows[k] -= rows[k, i] / rows[i, i] * rows[i]
    for i in range(2, -1, -1):
        found[i] = rows[i, 3]
        for j in range(i + 1, 3):
            found[i] -= rows[i, j] * found[j]
        found[i] /= rows[i, i]
    return bool(found.min() >= 0.0)
