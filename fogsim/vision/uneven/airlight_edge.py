"""Where the ground ahead ends in airlight, nearer than even fog has it: the front of a bank that hides all beyond it.

Far away lanes are a few pixels wide, and a vehicle ahead hides them; ground next to the road, vehicles and trees vanish
in a bank as the road does. So whole rows are looked at: how much of each is as bright as the sky. In even fog that
share grows slowly towards the horizon, up to which ground is to be seen; before a bank it steps up some rows below it.
"""

import math

import numpy as np

from fogsim.values.camera import Camera
from fogsim.vision.light.pixel_kernels import LinearPixels
from fogsim.vision.strips.sky import Sky
from fogsim.vision.strips.strip_curves import airlight_shares
from fogsim.vision.strips.strip_geometry import StripGeometry
from fogsim.vision.uneven.uneven_fit import UnevenFit

_ASIDE = 0.3
"""How far to either side rows are looked at [rad]."""

_ALIKE, _NOISE = 0.07, 3.0
"""Difference to the sky's luminance up to which nothing else is seen, relative to it and in its pixels' deviations."""

_LEAST_SHARE, _KEPT, STEP = 0.25, 0.7, 0.35
"""Least share of a row that is airlight beyond the front, least of that which all rows above keep, and most of it that
the ground two rows below has [-]: trees and vehicles that stand nearer hide the rest."""

_NEAREST = 40.0
"""Up to where fog counts as near, and fronts are the joint fit's [m]."""

_MOST_DEPTH = 1.5
"""Most optical depth of the fog before the front [-]: denser fog hides much of the ground itself."""

_LEAST_ROWS, _UNSURE = 1.0, 0.15
"""Least rows of a front below the horizon [px], and most of the horizon's standard deviation over them [-]."""

_DENSER = 2.5
"""Least extinction at the front over that of the near fog [-]."""


def airlight_edge(
    image: LinearPixels, geometry: StripGeometry, camera: Camera, sky: Sky, uneven: UnevenFit, horizon_deviation: float
) -> tuple[float, float, float] | None:
    """Find the front of a bank as the row from which on ground is airlight.

    A crest whose far side falls away looks the same where nothing stands out beyond it; one that the lane marks show is
    in `geometry`.

    Returns where it begins [m], the standard deviation of that [m], and the least extinction there [1/m]. Takes
    `horizon_deviation` [px].
    """
    if sky.is_clipped:
        return None
    below = geometry.below - uneven.fit.shift
    whole = (geometry.first == geometry.last) & (below > max(_LEAST_ROWS, horizon_deviation / _UNSURE))
    # Behind a crest no row is farther than the one below it.
    farther = np.diff(below, prepend=math.inf) < 0.0
    far = np.flatnonzero(whole & farther & (geometry.distance > _NEAREST))
    reach = _ASIDE * camera.focal_length
    columns = (
        max(round(camera.principal_point[0] - reach), 0),
        min(round(camera.principal_point[0] + reach), camera.width),
    )
    alike = max(_ALIKE, _NOISE * sky.noise / sky.luminance)
    shares = airlight_shares(image, geometry.first[far], columns, sky.luminance, alike)
    front = _front(shares)
    if front is None:
        return None
    distance = camera.row_distance / below[far]
    before, behind = float(distance[front - 2]), float(distance[front])
    depth, near = _depth(uneven, before), _depth(uneven, _NEAREST)
    if depth > _MOST_DEPTH:
        return None
    # What is left of the ground's contrast two rows below it is gone.
    contrast = max(1.0 - uneven.fit.road / uneven.fit.airlight, alike) * math.exp(-depth)
    extinction = math.log(max(contrast / alike, 1.0)) / (behind - before)
    if extinction < _DENSER * near / _NEAREST:
        return None
    edge = float(below[far[front]]) + 0.5
    place = camera.row_distance / edge
    return place, place / edge * math.hypot(0.5, horizon_deviation), extinction


def _depth(uneven: UnevenFit, distance: float) -> float:
    """Optical depth up to a distance, beyond the road that was seen with the mean extinction up to its end [-]."""
    beyond = max(distance / float(uneven.distance[-1]), 1.0)
    return max(float(np.interp(distance, uneven.distance, uneven.depth)), 0.0) * beyond


def _front(shares: np.ndarray) -> int | None:
    """Nearest row, of those from near to far, from which on airlight is seen; None if there is no such step."""
    for row in range(2, shares.size):
        if shares[row] >= _LEAST_SHARE:
            step = shares[row - 2] <= STEP * shares[row]
            return row if step and shares[row:].min() >= _KEPT * shares[row] else None
    return None
