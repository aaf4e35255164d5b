"""Extinction along a line of sight: the one optical depth that camera, drivers, lamps and metrics share."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogsim.atmosphere.fog.extinction import field_at, medium_of
from fogsim.atmosphere.fog.optical_depth_kernels import MOST_PIECES, depths_along, depths_between, extinctions
from fogsim.values import FogField


def extinction(field: FogField, points: ArrayLike, time: float = 0.0) -> NDArray[np.float64]:
    """Extinction coefficient at points [1/m].

    Parameters
    ----------
    field : FogField
        The fog.
    points : (..., 3) array_like
        Places (x, y, z) [m].
    time : float
        Time since the run began [s].

    Returns
    -------
    (...) float64
        k ≥ 0; 0 above the top of the fog.
    """
    places = np.asarray(points, dtype=np.float64)
    values = np.empty(places.shape[:-1])
    extinctions(np.ascontiguousarray(places.reshape(-1, 3)), medium_of(field_at(field, time)), values.reshape(-1))
    return values


def optical_depth(field: FogField, start: ArrayLike, end: ArrayLike, time: float = 0.0) -> NDArray[np.float64]:
    """Optical depth between points, τ = ∫ k ds [-].

    Exact for banks and layers; through scale heights to 10⁻⁶, through patches to a thousandth.

    Parameters
    ----------
    field : FogField
        The fog.
    start, end : (..., 3) array_like
        Ends of the straight lines of sight [m]; they broadcast.
    time : float
        Time since the run began [s].

    Returns
    -------
    (...) float64
        τ ≥ 0; the transmission is exp(−τ).
    """
    from_, to = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    shape = np.broadcast_shapes(from_.shape, to.shape)
    depths = np.empty(shape[:-1])
    depths_between(
        _rows(from_, shape),
        _rows(to, shape),
        medium_of(field_at(field, time)),
        depths.reshape(-1),
        np.empty((2, 4 * MOST_PIECES)),
    )
    return depths


def _rows(points: NDArray[np.float64], shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Points broadcast to a shape, one a row; memory of their own, as compiled kernels take no read-only views."""
    if points.shape != shape:
        points = np.array(np.broadcast_to(points, shape))
    return np.ascontiguousarray(points.reshape(-1, 3))


def optical_depth_along(
    field: FogField, start: ArrayLike, direction: ArrayLike, distances: ArrayLike, time: float = 0.0
) -> NDArray[np.float64]:
    """Optical depth from one point to places along one direction [-]: `optical_depth`, walked through once.

    Parameters
    ----------
    field : FogField
        The fog.
    start : (3,) array_like
        Where the line begins [m].
    direction : (3,) array_like
        Unit vector.
    distances : (n,) array_like
        Ascending distances [m].
    time : float
        Time since the run began [s].

    Returns
    -------
    (n,) float64
        τ ≥ 0, ascending.
    """
    at = np.ascontiguousarray(distances, dtype=np.float64)
    depths = np.empty_like(at)
    depths_along(
        np.asarray(start, dtype=np.float64),
        np.asarray(direction, dtype=np.float64),
        at,
        medium_of(field_at(field, time)),
        depths,
        np.empty((2, 4 * MOST_PIECES)),
    )
    return depths
