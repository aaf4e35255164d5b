"""Extinction along a line of sight: the one optical depth that camera, drivers, lamps and metrics share."""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogsim.atmosphere.fog.medium import Medium, field_at, is_uniform_below, medium_of
from fogsim.atmosphere.fog.optical_depth_kernels import MOST_PIECES, depths_along, depths_between, extinctions
from fogsim.values import FogField

_HIGHEST_EYES = 4.0
"""No driver's eyes are higher above the road than this [m]."""


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
    now, places = field_at(field, time), np.asarray(points, dtype=np.float64)
    if places.size and is_uniform_below(now, float(places[..., 2].max())):
        return np.full(places.shape[:-1], float(now.extinction))
    return _extinctions(medium_of(now), places)


def _extinctions(medium: Medium, points: ArrayLike) -> NDArray[np.float64]:
    places = np.asarray(points, dtype=np.float64)
    values = np.empty(places.shape[:-1])
    extinctions(np.ascontiguousarray(places.reshape(-1, 3)), medium, values.reshape(-1))
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
        τ ≥ 0; the transmittance is exp(−τ).
    """
    return _optical_depths(medium_of(field_at(field, time)), start, end)


def _optical_depths(medium: Medium, start: ArrayLike, end: ArrayLike) -> NDArray[np.float64]:
    from_, to = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    shape = from_.shape if from_.shape == to.shape else np.broadcast_shapes(from_.shape, to.shape)
    depths = np.empty(shape[:-1])
    scratch = np.empty((2, 4 * MOST_PIECES))
    depths_between(_rows(from_, shape), _rows(to, shape), medium, depths.reshape(-1), scratch)
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
        math.inf,
    )
    return depths


def distance_at_depth(
    field: FogField, start: ArrayLike, direction: ArrayLike, distances: NDArray[np.float64], depth: float
) -> float:
    """Distance along one direction at which an optical depth is reached [m], between places by interpolation.

    Parameters
    ----------
    field : FogField
        The fog now.
    start, direction
        See `optical_depth_along`.
    distances : (n,) float64
        Ascending distances of places [m].
    depth : float
        The optical depth [-], more than 0.

    Returns
    -------
    float
        ``inf`` if it is not reached up to the last place.
    """
    depths = np.empty_like(distances)
    # Distances are many where fog is thin; no place behind the one that is looked for is needed.
    count = depths_along(
        np.asarray(start, dtype=np.float64),
        np.asarray(direction, dtype=np.float64),
        distances,
        medium_of(field_at(field, 0.0)),
        depths,
        np.empty((2, 4 * MOST_PIECES)),
        depth,
    )
    last = count - 1
    if depths[last] < depth:
        return math.inf
    if last == 0 or depths[last] == depth:
        return float(distances[last])
    near, far = distances[last - 1 : count].tolist()
    low, high = depths[last - 1 : count].tolist()
    return float((far - near) / (high - low) * (depth - low) + near)


@dataclass(frozen=True, slots=True)
class FieldAccess:
    """Extinction and optical depth of one field.

    Attributes
    ----------
    field : FogField
        The fog.
    time : float
        The time that is meant where a question names none [s].
    """

    field: FogField
    time: float = 0.0

    def at(self, time: float) -> "FieldAccess":
        """The same fog at another time; its bounds still hold for all times.

        Parameters
        ----------
        time : float
            Time since the run began [s].
        """
        return dataclasses.replace(self, time=time)

    @property
    def maximum_extinction(self) -> float:
        """Extinction coefficient that is exceeded nowhere and never [1/m]; banks do not overlap."""
        field = self.field
        densest = field.extinction + max((0.0, *(bank.extra_extinction for bank in field.banks)))
        return densest * max(self._densities) * float(self._factors.max())

    @property
    def minimum_extinction(self) -> float:
        """Extinction coefficient that is reached always and everywhere below the fog's top [1/m].

        0 for fog that thins with height or has lifted, since a road may lead out of it, where there are tunnels, and
        for a layer so shallow that drivers look over it. Banks do not overlap.
        """
        field = self.field
        bases = (field.base, *(change.base for change in field.changes))
        lowest_top = min((field.top, *(change.top for change in field.changes))) - 0.5 * field.top_edge
        is_shallow = lowest_top < field.ground + _HIGHEST_EYES
        if field.shelters or math.isfinite(field.scale_height) or max(bases) > -math.inf or is_shallow:
            return 0.0
        thinnest = field.extinction + min((0.0, *(bank.extra_extinction for bank in field.banks)))
        return thinnest * min(self._densities) * float(self._factors.min())

    @property
    def _densities(self) -> tuple[float, ...]:
        """Factors of the extinction coefficient that the fog comes to, or may."""
        written = tuple(change.density for change in self.field.changes) or (1.0,)
        return written + self.field.reachable_densities

    @property
    def _factors(self) -> NDArray[np.float32]:
        return medium_of(field_at(self.field, 0.0)).factors

    def extinction(self, points: ArrayLike, time: float | None = None) -> NDArray[np.float64]:
        """Extinction coefficient at points [1/m]; see `fogsim.atmosphere.extinction`.

        Parameters
        ----------
        points : (..., 3) array_like
            Places [m].
        time : float or None
            Time since the run began [s]; None for `time` of the access.
        """
        return extinction(self.field, points, self.time if time is None else time)

    def optical_depth(self, start: ArrayLike, end: ArrayLike, time: float | None = None) -> NDArray[np.float64]:
        """Optical depth between points [-]; see `fogsim.atmosphere.optical_depth`.

        Parameters
        ----------
        start, end : (..., 3) array_like
            Ends of the lines of sight [m].
        time : float or None
            Time since the run began [s]; None for `time` of the access.
        """
        return optical_depth(self.field, start, end, self.time if time is None else time)


class FogNow:
    """A field as it is now, for those who ask about the fog and keep no time; whoever keeps the time sets it.

    Parameters
    ----------
    field : FogField
        The fog over time.
    """

    def __init__(self, field: FogField) -> None:
        self._always = FieldAccess(field)
        self._now = field_at(field, 0.0)
        self._medium = medium_of(self._now)

    def change(self, field: FogField) -> None:
        """Let the fog be another one over time, of the same bounds.

        Parameters
        ----------
        field : FogField
            The fog over time.
        """
        self._always = FieldAccess(field)

    def set_time(self, time: float) -> None:
        """Let it be a time from here on.

        Parameters
        ----------
        time : float
            Time since the run began [s].
        """
        now = field_at(self._always.field, time)
        if now is not self._now:
            self._now, self._medium = now, medium_of(now)

    @property
    def maximum_extinction(self) -> float:
        """Extinction coefficient that is exceeded nowhere and never [1/m]."""
        return self._always.maximum_extinction

    @property
    def minimum_extinction(self) -> float:
        """Extinction coefficient that is reached always and everywhere [1/m]; see `FieldAccess`."""
        return self._always.minimum_extinction

    def extinction(self, points: ArrayLike) -> NDArray[np.float64]:
        """Extinction coefficient at points now [1/m].

        Parameters
        ----------
        points : (..., 3) array_like
            Places [m].
        """
        return _extinctions(self._medium, points)

    def optical_depth(self, start: ArrayLike, end: ArrayLike) -> NDArray[np.float64]:
        """Optical depth between points now [-].

        Parameters
        ----------
        start, end : (..., 3) array_like
            Ends of the lines of sight [m].
        """
        return _optical_depths(self._medium, start, end)
