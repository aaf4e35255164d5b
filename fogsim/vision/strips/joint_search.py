"""Compiled searches for the extinctions from which the joint fit starts."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel
from fogsim.vision.strips.albedo_filter import wandering, whiten
from fogsim.vision.strips.road_curve import near_road, transmission

GRAINY = 0.01
"""Deviation of bins by the road's texture in the simple search, relative to the airlight [-]."""


@kernel
def search(
    luminance: NDArray[np.float64],
    noise: NDArray[np.float64],
    below: NDArray[np.float64],
    half: NDArray[np.float64],
    path: NDArray[np.float64],
    distance: NDArray[np.float64],
    extent: NDArray[np.float64],
    albedo: NDArray[np.float64],
    extinctions: NDArray[np.float64],
    airlight: float,
    shift: float,
) -> NDArray[np.float64]:
    """Minus twice the log likelihood of each of several extinctions, the rest at their first guesses; inf for none."""
    strips, count = luminance.shape
    cost, changes = np.empty(extinctions.size), wandering(distance, extent, albedo)
    columns, scale = np.empty((strips, count, 1)), np.empty((strips, count))
    out, constant, used = np.empty((strips, count, 1)), np.empty((strips, 1)), np.zeros((strips, count), np.uint8)
    for j in range(extinctions.size):
        k, possible = extinctions[j], True
        for strip in range(strips):
            road = near_road(luminance[strip], noise[strip], below, half, path[strip], k, airlight, shift, 12)
            possible = possible and 0.0 < road < 1.5 * airlight
            for i in range(count):
                value, _, _ = transmission(below[i] - shift, half[i], path[strip, i], k)
                columns[strip, i, 0] = luminance[strip, i] - airlight - (road - airlight) * value
                scale[strip, i] = road * value
        cost[j] = np.inf
        if possible:
            cost[j] = whiten(columns, scale, noise, changes, albedo, airlight, True, used, out, constant)
            cost[j] += (out**2).sum()
    return cost


@kernel
def simple_search(
    luminance: NDArray[np.float64],
    noise: NDArray[np.float64],
    below: NDArray[np.float64],
    half: NDArray[np.float64],
    path: NDArray[np.float64],
    extinctions: NDArray[np.float64],
    prior: NDArray[np.float64],
) -> tuple[float, float]:
    """Extinction and airlight that best fit all strips as one road of constant albedo, in Cauchy's norm.

    A smooth broad search, where `search` has narrow minima: what does not fit weighs little, and nothing is explained
    by an albedo that wanders.
    """
    strips, count = luminance.shape
    best, best_k, best_airlight = np.inf, extinctions[0], prior[0]
    scale = (GRAINY * prior[0]) ** 2
    stride = max(count // 36, 1)
    value = np.empty((count + stride - 1) // stride)
    for k in extinctions:
        for j in range(value.size):
            i = j * stride
            value[j], _, _ = transmission(below[i] - prior[3], half[i], path[0, i], k)
        airlight, drop, total = prior[0], 0.0, 0.0
        for iteration in range(4):
            s0, s1, s2, r0, r1 = 0.0, 0.0, 0.0, 0.0, 0.0
            total = 0.0
            for strip in range(strips):
                for j in range(value.size):
                    i = j * stride
                    if noise[strip, i] <= 0.0:
                        continue
                    t, spread = value[j], noise[strip, i] + scale * (value[j] ** 2 + 0.02)
                    rest = luminance[strip, i] - airlight - drop * t
                    weight = 1.0 / (spread + rest * rest) if iteration else 1.0 / spread
                    if iteration == 3:
                        total += math.log1p(rest * rest / spread)
                    y = luminance[strip, i] - prior[0]
                    s0, s1, s2 = s0 + weight, s1 + weight * t, s2 + weight * t * t
                    r0, r1 = r0 + weight * y, r1 + weight * t * y
            off = airlight - prior[0]
            known = 1.0 / (prior[1] if off < 0.0 else prior[2]) ** 2
            total += known * off * off
            s0 += known
            determinant = max(s0 * s2 - s1 * s1, 1e-12)
            airlight = prior[0] + (s2 * r0 - s1 * r1) / determinant
            drop = min((s0 * r1 - s1 * r0) / determinant, 0.0)
            drop = max(drop, -airlight)
        if total < best:
            best, best_k, best_airlight = total, k, airlight
    return best_k, best_airlight
