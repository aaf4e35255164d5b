"""The vehicle ahead of one picture found in another one, before a road that fades differently."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.vision.vehicle.lead_patch import INDEPENDENT, LeadPicture, cell_of, grid, resampled
from fogsim.vision.vehicle.match_kernels import correlations

Floats = NDArray[np.float64]

ASIDE, ABOVE, BELOW = 0.25, 0.15, 0.4
"""What is placed reaches so far beyond that part, or beyond the vehicle's sides [m]: its outline tells the place."""


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What is known of the road behind a vehicle: the higher it is seen, the farther it is, and the faster it fades.

    Attributes
    ----------
    eye : float
        Height of the camera above the road [m].
    faded : float
        Contrast of the vehicle that is expected, over that of the reference [-].
    """

    eye: float
    faded: float

    def fading(self, height: Floats) -> Floats:
        """Fading of a level road seen at heights [m] over that of the vehicle: t^(h / (H − h)).

        A line of sight at height h over a vehicle's foot at range d ends on the road at d H / (H − h).
        """
        farther = np.where(height < 0.9 * self.eye, height / np.maximum(self.eye - height, 0.1 * self.eye), 9.0)
        return np.asarray(min(max(self.faded, 1e-3), 1.0) ** farther)


def placed(
    reference: LeadPicture, picture: LeadPicture, aside: float, pitch: float, around: Surroundings
) -> tuple[LeadPicture, float] | None:
    """Find the vehicle of a reference in a picture.

    Parameters
    ----------
    reference : LeadPicture
        The vehicle as it was seen.
    picture : LeadPicture
        Where it is expected.
    aside, pitch : float
        Standard deviations of its place sideways and upward [m].
    around : Surroundings
        The road beside the vehicle, which is placed by its outline, too.

    Returns
    -------
    (LeadPicture, float) or None
        The picture with the place of greatest posterior, and the correlation there [-]; None if it is too small.
    """
    cell = cell_of(reference, picture)
    side = 0.5 * reference.width + ASIDE
    low, high = reference.heights
    lateral, height = grid(-side, side, cell, 5), grid(low - BELOW, high + ABOVE, cell, 4)
    across, up = (max(math.ceil(2.5 * deviation / cell), 1) for deviation in (aside, pitch))
    template, _ = resampled(reference, lateral, height, cell)
    beside = (np.abs(lateral) > 0.5 * reference.width) | (height[:, None] < 0.0)
    template = _before_road(np.where(beside, template * around.fading(height)[:, None], template), lateral, reference)
    wide = cell * np.arange(-across, across + 1), cell * np.arange(-up, up + 1)
    lateral = np.concatenate([lateral[0] + wide[0][:across], lateral, lateral[-1] + wide[0][across + 1 :]])
    height = np.concatenate([height[0] + wide[1][:up], height, height[-1] + wide[1][up + 1 :]])
    seen, _ = resampled(picture, lateral, height, cell)
    seen = _before_road(seen, lateral, reference)
    if float(template.std()) < 1e-4:
        return None
    found = np.clip(correlations(np.ascontiguousarray(seen), np.ascontiguousarray(template)), 0.0, 0.9999)
    known = 0.5 * (wide[1][:, None] / pitch) ** 2 + 0.5 * (wide[0] / aside) ** 2
    cost = 0.5 * template.size / INDEPENDENT * np.log1p(-(found**2)) + known
    row, col = np.unravel_index(int(np.argmin(cost)), cost.shape)
    right = (float(col) - across + _vertex(cost[row], int(col))) * cell
    high = (float(row) - up + _vertex(cost[:, col], int(row))) * cell
    return picture.moved(right, high), float(found[row, col])


def _before_road(contrast: Floats, lateral: Floats, reference: LeadPicture) -> Floats:
    """Contrast less that of the road beside the vehicle at the same height: near road fades into far road upwards."""
    beside = np.abs(lateral) > 0.5 * reference.width + 0.3 * ASIDE
    outer = contrast[:, beside] if beside.any() else contrast[:, [0, -1]]
    return np.asarray(contrast - np.median(outer, axis=1)[:, None], np.float64)


def _vertex(cost: Floats, at: int) -> float:
    """Place of a minimum between cells, by a parabola."""
    if not 0 < at < cost.size - 1:
        return 0.0
    left, here, right = (float(value) for value in cost[at - 1 : at + 2])
    bend = left - 2.0 * here + right
    return min(max(0.5 * (left - right) / bend, -0.5), 0.5) if bend > 0 else 0.0
