"""Extinction along a line of sight: the one optical depth that camera, drivers, lamps and metrics share.

A bank's extra extinction depends only on the distance s along the bank's axis, and s is linear along a straight line
of sight. So the integral of k over the line is the difference of an antiderivative F of the bank's profile, divided by
how fast s changes: exact, at any length, without steps. The soft edges are smoothsteps, whose antiderivative is a
polynomial.
"""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogsim.values import FogBank, FogField


def extinction(field: FogField, points: ArrayLike) -> NDArray[np.float64]:
    """Extinction coefficient at points [1/m].

    Parameters
    ----------
    field : FogField
        The fog.
    points : (..., 3) array_like
        Places (x, y, z) [m].

    Returns
    -------
    (...) float64
        k ≥ 0; 0 above the top of the fog.
    """
    places = np.asarray(points, dtype=np.float64)
    k = np.full(places.shape[:-1], field.extinction)
    for bank in field.banks:
        k += bank.extra_extinction * _profile(bank, _station(bank, places))
    return np.where(places[..., 2] <= field.top, k, 0.0)


def optical_depth(field: FogField, start: ArrayLike, end: ArrayLike) -> NDArray[np.float64]:
    """Optical depth between points, τ = ∫ k ds [-].

    Parameters
    ----------
    field : FogField
        The fog.
    start, end : (..., 3) array_like
        Ends of the straight lines of sight [m]; they broadcast.

    Returns
    -------
    (...) float64
        τ ≥ 0; the transmission is exp(−τ).
    """
    from_, to = _below_top(field, np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64))
    length = np.linalg.norm(to - from_, axis=-1)
    depth = field.extinction * length
    for bank in field.banks:
        depth = depth + bank.extra_extinction * length * _mean_profile(bank, _station(bank, from_), _station(bank, to))
    return np.asarray(depth)


def _below_top(
    field: FogField, start: NDArray[np.float64], end: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Cut away the part of each line that lies above the fog."""
    start, end = np.broadcast_arrays(start, end)
    if math.isinf(field.top):
        return start, end
    rise = end[..., 2] - start[..., 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(rise != 0, (field.top - start[..., 2]) / rise, 0.0)
    crossing = start + np.clip(share, 0.0, 1.0)[..., None] * (end - start)
    start_above, end_above = start[..., 2] > field.top, end[..., 2] > field.top
    return (
        np.where(start_above[..., None], np.where(end_above[..., None], start, crossing), start),
        np.where(end_above[..., None], np.where(start_above[..., None], start, crossing), end),
    )


def _station(bank: FogBank, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance along the bank's axis [m]."""
    return np.asarray(
        (points[..., 0] - bank.origin[0]) * bank.axis[0] + (points[..., 1] - bank.origin[1]) * bank.axis[1]
    )


def _smoothstep(station: NDArray[np.float64], middle: float, edge: float) -> NDArray[np.float64]:
    t = np.clip((station - middle) / edge + 0.5, 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))


def _smoothstep_integral(station: NDArray[np.float64], middle: float, edge: float) -> NDArray[np.float64]:
    """∫ smoothstep from −∞ [m]."""
    t = np.clip((station - middle) / edge + 0.5, 0.0, 1.0)
    beyond = np.maximum(station - (middle + 0.5 * edge), 0.0)
    return np.asarray(edge * t**3 * (1.0 - 0.5 * t) + beyond)


def _profile(bank: FogBank, station: NDArray[np.float64]) -> NDArray[np.float64]:
    """Share of the bank's extra extinction, 0 … 1."""
    return _smoothstep(station, bank.start, bank.edge) - _smoothstep(station, bank.end, bank.edge)


def _profile_integral(bank: FogBank, station: NDArray[np.float64]) -> NDArray[np.float64]:
    return _smoothstep_integral(station, bank.start, bank.edge) - _smoothstep_integral(station, bank.end, bank.edge)


def _mean_profile(bank: FogBank, start: NDArray[np.float64], end: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean of the profile over a line from one station to another, 0 … 1."""
    span = end - start
    # Across the axis the station hardly changes: there the profile itself is the mean, to the order of the span.
    across = np.abs(span) < 1e-3
    safe = np.where(across, 1.0, span)
    difference = _profile_integral(bank, end) - _profile_integral(bank, start)
    return np.where(across, _profile(bank, 0.5 * (start + end)), difference / safe)
