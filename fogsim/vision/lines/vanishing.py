"""The vanishing point of the lines that run along the road: Hough's transform and random sample consensus."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.linear_algebra import matrix_product
from fogsim.vision.lines import line_kernels
from fogsim.vision.lines.edges import Gradient

Floats = NDArray[np.float64]

SAMPLES = 48
"""Pairs of lines that are drawn: with 30 % good lines one pair is good with a probability of 0.99 (negru2013)."""

PEAKS, VOTES = 16, 30
"""Most lines that are taken from the accumulator, and fewest votes of one."""

CONSENSUS = 5.0
"""Distance at which a line passes through a point in the choice of lines [px]."""

SMALLEST_ANGLE = 0.15
"""Angle between two lines below which their crossing says little [rad]."""


@dataclass(frozen=True, slots=True)
class VanishingPoint:
    """Where the lines along the road meet.

    Attributes
    ----------
    col, row : float
        In the image [px].
    deviation : float
        Standard deviation of the row [px].
    score : float
        Votes of the lines that agree.
    lines : int
        How many they are.
    """

    col: float
    row: float
    deviation: float
    score: float
    lines: int


def vanishing_point(
    gradient: Gradient, edges: NDArray[np.uint8], guess: tuple[float, float], reach: float
) -> VanishingPoint | None:
    """Find the vanishing point of the edges below a first guess (negru2013 section IV.B.a).

    Edges vote along their gradient for lines that pass within `reach` of the guess; the highest peaks are lines; of
    random pairs of lines that one is kept through whose crossing the most votes pass, and the centre of mass of the
    crossings of all that pass there is the answer. It is several pixels off; see `fogsim.vision.lines.road_lines`.

    Parameters
    ----------
    gradient : Gradient
        Derivatives of the image.
    edges : (rows, cols) uint8
        Non-zero on edges.
    guess : tuple of float
        Column and row of the first guess, in rows of `edges` [px].
    reach : float
        How far from it lines may pass [px].

    Returns
    -------
    VanishingPoint or None
        None if no two lines agree.
    """
    points = line_kernels.edge_points(gradient.across, gradient.down, edges, guess[0], guess[1])
    lines, votes = line_kernels.hough_lines(points, reach, PEAKS, VOTES)
    chosen = _consensus(lines, votes)
    if chosen is None:
        return None
    score = float(votes[chosen].sum())
    found = _centre_of_mass(lines[chosen])
    if found is None:
        return None
    place, deviation = found
    return VanishingPoint(guess[0] + float(place[0]), guess[1] + float(place[1]), deviation, score, int(chosen.sum()))


def _crossing(first: Floats, second: Floats) -> Floats | None:
    """Point common to two lines u cos θ + v sin θ = ρ, or None if they are nearly parallel."""
    (a, b), (c, d) = ((math.cos(line[0]), math.sin(line[0])) for line in (first, second))
    turn = a * d - b * c
    if abs(turn) < math.sin(SMALLEST_ANGLE):
        return None
    return np.array([d * first[1] - b * second[1], a * second[1] - c * first[1]]) / turn


def _consensus(lines: Floats, votes: Floats) -> NDArray[np.bool_] | None:
    if len(lines) < 2:
        return None
    # The same pairs for the same number of lines: an estimate is a function of the image.
    draws = np.random.default_rng(len(lines)).integers(0, len(lines), (SAMPLES, 2))
    cosine, sine = np.cos(lines[:, 0]), np.sin(lines[:, 0])
    turn = np.sin(lines[draws[:, 1], 0] - lines[draws[:, 0], 0])
    usable = np.abs(turn) > math.sin(SMALLEST_ANGLE)
    if not usable.any():
        return None
    a, b, turn = draws[usable, 0], draws[usable, 1], turn[usable]
    u = (lines[a, 1] * sine[b] - lines[b, 1] * sine[a]) / turn
    v = (lines[b, 1] * cosine[a] - lines[a, 1] * cosine[b]) / turn
    passing = np.abs(u[:, None] * cosine + v[:, None] * sine - lines[:, 1]) < CONSENSUS
    return np.asarray(passing[int(np.argmax(matrix_product(passing, votes)))])


def _centre_of_mass(lines: Floats) -> tuple[Floats, float] | None:
    pairs = [(i, j) for i in range(len(lines)) for j in range(i)]
    crossings = [c for i, j in pairs if (c := _crossing(lines[i], lines[j])) is not None]
    if not crossings:
        return None
    spread = float(np.std([c[1] for c in crossings])) if len(crossings) > 1 else CONSENSUS
    return np.mean(crossings, axis=0), max(spread, 1.0)
