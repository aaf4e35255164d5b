"""Time between two vehicles on the area where their ways cross."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.metrics.crossing.tracks import UNKNOWN, Floats, Numbers, Tracks
from fogsim.metrics.crossing.way_kernels import crossing_pieces

LEAST_ANGLE = math.radians(20.0)
"""Angle between two ways from which on they cross, instead of going side by side or ahead of one another [rad]."""

_CORNERS = np.array([(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)])


class Encroachments(NamedTuple):
    """Pairs of vehicles that have driven over the same area one after the other."""

    # first, second (k,) int: vehicles, in the order of their fronts
    first: Numbers
    second: Numbers
    junction: Numbers  # (k,) int: Where
    time: Floats  # (k,): Post-encroachment time [s]; 0 where the second came before the first had left


def find_encroachments(tracks: Tracks) -> Encroachments:
    """Post-encroachment times of all pairs whose ways cross, at each place where they do.

    Bodies of widths w₁, w₂ on straight ways that cross at the angle θ both sweep a parallelogram, whose corners lie at
    ± w₂ / (2 sin θ) along the first way and ± w₁ / (2 sin θ) along the second one. At each of its points

        PET = (time at which the second one's front comes) − (time at which the first one's rear has left),

    and the least of these is at a corner: that is said, and 0 where it is negative [1, 2]. Times are interpolated from
    where the fronts were at the steps; a rear passes where its front has driven the vehicle's length beyond, and is
    gone with its vehicle. Ways that come from the same lane or lead to the same one do not cross.
    """
    piece = np.flatnonzero(tracks.junction >= 0)
    piece = piece[np.argsort(tracks.junction[piece], kind="stable")]
    fronts = tracks.fronts
    places = np.stack((fronts.x, fronts.y), axis=1)
    begin, way = places[piece - 1], places[piece] - places[piece - 1]
    least_sine = math.sin(LEAST_ANGLE)
    found = crossing_pieces(begin, way, tracks.junction[piece], fronts.vehicle[piece], least_sine)
    numbers, parts = found[:, :2].astype(np.intp), found[:, 2:]
    row = piece[numbers]
    apart = ~(_alike(tracks.origin[row]) | _alike(tracks.target[row]))
    numbers, parts, row = numbers[apart], parts[apart], row[apart]
    time = fronts.time[row - 1] + parts * (fronts.time[row] - fronts.time[row - 1])
    # Who comes first stands first.
    order = np.argsort(time, axis=1, kind="stable")
    numbers, row = np.take_along_axis(numbers, order, axis=1), np.take_along_axis(row, order, axis=1)
    parts = np.take_along_axis(parts, order, axis=1)
    place = tracks.travelled[row - 1] + parts * (tracks.travelled[row] - tracks.travelled[row - 1])
    left, came = _least_apart(tracks, row, place, way[numbers])
    between = np.maximum((came - left).min(axis=0, initial=np.inf), 0.0)
    return Encroachments(fronts.vehicle[row[:, 0]], fronts.vehicle[row[:, 1]], tracks.junction[row[:, 0]], between)


def _least_apart(tracks: Tracks, row: Numbers, place: Floats, way: Floats) -> tuple[Floats, Floats]:
    """When the first has left each corner of the area, and when the second comes there (4, k) [s]."""
    direction = way / np.hypot(way[..., 0], way[..., 1])[..., None]
    (ax, ay), (bx, by) = direction[:, 0].T, direction[:, 1].T
    cosine, sine = ax * bx + ay * by, np.abs(ax * by - ay * bx)
    along_first = _CORNERS[:, :1] * tracks.fronts.width[row[:, 1]] / (2.0 * sine)
    along_second = _CORNERS[:, 1:] * tracks.fronts.width[row[:, 0]] / (2.0 * sine)
    gone = place[:, 0] + tracks.fronts.length[row[:, 0]] + along_first + cosine * along_second
    there = place[:, 1] + along_second + cosine * along_first
    first, second = (np.broadcast_to(rows, gone.shape) for rows in row.T)
    return tracks.time_at(first, gone), tracks.time_at(second, there)


def _alike(lanes: NDArray[np.intp]) -> NDArray[np.bool_]:
    alike: NDArray[np.bool_] = (lanes[:, 0] == lanes[:, 1]) & (lanes[:, 0] != UNKNOWN)
    return alike
