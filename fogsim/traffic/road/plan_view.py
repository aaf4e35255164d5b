"""Reference lines of OpenDRIVE roads: connected straight lines, arcs, spirals and cubic polynomials."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from xml.etree.ElementTree import Element

import numpy as np

from fogsim.core.files.readers import number_in_text
from fogsim.core.linear_algebra import matrix_product

_SPIRAL_NODES, _SPIRAL_WEIGHTS = np.polynomial.legendre.leggauss(24)
"""Gauss-Legendre rule on −1 … 1; on a spiral that turns by π its error is far below a millimetre."""

_STEP, _ROUNDS = 20.0, 6  # Distance of first guesses along a line [m], and corrections of the best one

Place = tuple[float, float, float]
"""x, y [m] and heading, counterclockwise from east [rad]."""


@dataclass(frozen=True, slots=True)
class Piece:
    """A stretch of a reference line with linear curvature: a line, an arc or a spiral.

    It begins at s [m], at x, y [m] in direction heading [rad], with curvature [1/m], positive to the left, and its rate
    of change [1/m²].
    """

    s: float
    length: float
    x: float
    y: float
    heading: float
    curvature: float
    curvature_rate: float

    def at(self, distance: float) -> Place:
        """Point at a distance from its start [m]."""
        turned = self._turned(distance)
        if self.curvature_rate:
            along = 0.5 * distance * (_SPIRAL_NODES + 1.0)
            angles = self.heading + self.curvature * along + 0.5 * self.curvature_rate * along**2
            dx = 0.5 * distance * float(matrix_product(_SPIRAL_WEIGHTS, np.cos(angles)))
            dy = 0.5 * distance * float(matrix_product(_SPIRAL_WEIGHTS, np.sin(angles)))
        else:
            # A chord of an arc: its length is that of the arc times sin(a) / a, its direction the middle one.
            half = 0.5 * turned
            chord = distance * (math.sin(half) / half if half else 1.0)
            dx, dy = chord * math.cos(self.heading + half), chord * math.sin(self.heading + half)
        return self.x + dx, self.y + dy, self.heading + turned

    def _turned(self, distance: float) -> float:
        return distance * (self.curvature + 0.5 * self.curvature_rate * distance)


@dataclass(frozen=True, slots=True)
class CubicPiece:
    """A stretch of a reference line whose coordinates are cubic polynomials (``paramPoly3``).

    `forward` and `left` are coefficients along and to the left of the first direction, constant term first; the
    parameter runs to 1 if `is_normalised`, otherwise to the length.
    """

    s: float
    length: float
    x: float
    y: float
    heading: float
    forward: tuple[float, ...]
    left: tuple[float, ...]
    is_normalised: bool

    def at(self, distance: float) -> Place:
        """Point at a distance from its start [m]; the parameter counts as length of the curve, as in the format."""
        p = distance / self.length if self.is_normalised else distance
        (u, du), (v, dv) = _cubic(self.forward, p), _cubic(self.left, p)
        cosine, sine = math.cos(self.heading), math.sin(self.heading)
        turned = math.atan2(dv, du)
        return self.x + u * cosine - v * sine, self.y + u * sine + v * cosine, self.heading + turned


def _cubic(coefficients: tuple[float, ...], p: float) -> tuple[float, float]:
    """Value of a cubic and of its derivative."""
    a, b, c, d = coefficients
    return a + p * (b + p * (c + p * d)), b + p * (2.0 * c + p * 3.0 * d)


@dataclass(frozen=True, slots=True)
class PlanView:
    """A road's reference line: its pieces in order of s."""

    pieces: tuple["Piece | CubicPiece | UnknownPiece", ...]

    def at(self, s: float) -> Place:
        """Point at s [m]; ValueError if it is not on the road, or the shape there is unknown."""
        end = self.pieces[-1].s + self.pieces[-1].length
        # Files round s; up to a centimetre beyond an end counts as that end.
        if not -0.01 <= s <= end + 0.01:
            raise ValueError(f"expected s on the road, 0 … {end:g} m, got {s:g}")
        piece = next((p for p in reversed(self.pieces) if p.s <= s), self.pieces[0])
        return piece.at(s - piece.s)

    def nearest(self, x: float, y: float) -> float:
        """Where the line is nearest to a point, s [m], as far as its shape is known; ValueError if nothing is."""
        found = []
        for piece in (one for one in self.pieces if not isinstance(one, UnknownPiece)):
            steps = np.linspace(0.0, piece.length, int(piece.length / _STEP) + 2)
            _, along = min((math.dist(piece.at(float(d))[:2], (x, y)), float(d)) for d in steps)
            for _ in range(_ROUNDS):
                near_x, near_y, heading = piece.at(along)
                along += (x - near_x) * math.cos(heading) + (y - near_y) * math.sin(heading)
                along = min(max(along, 0.0), piece.length)
            found.append((math.dist(piece.at(along)[:2], (x, y)), piece.s + along))
        if not found:
            raise ValueError("places on line, arc, spiral and paramPoly3 are known, and the road has none")
        return min(found)[1]


@dataclass(frozen=True, slots=True)
class UnknownPiece:
    """A stretch of another shape, on which nothing can be placed."""

    s: float
    length: float
    shape: str

    def at(self, distance: float) -> Place:
        """Raise a ValueError that names the shape."""
        where = self.s + distance
        raise ValueError(f"s = {where:g} m is on a {self.shape}; places on line, arc, spiral and paramPoly3 are known")


def plan_view(geometries: Iterable[Element]) -> PlanView:
    """Reference line from ``<geometry>`` elements; ValueError if there are none or a number is missing."""
    pieces = tuple(sorted((_piece(g) for g in geometries), key=lambda p: p.s))
    if not pieces:
        raise ValueError("the road has no geometry")
    return PlanView(pieces)


def _piece(geometry: Element) -> Piece | CubicPiece | UnknownPiece:
    s, x, y, heading, length = _numbers(geometry, "s", "x", "y", "hdg", "length")
    shape = next(iter(geometry), None)
    tag = "geometry without a shape" if shape is None else shape.tag
    if shape is not None and tag == "paramPoly3" and length > 0:
        forward, left = (tuple(_numbers(shape, *(f"{c}{axis}" for c in "abcd"))) for axis in "UV")
        return CubicPiece(s, length, x, y, heading, forward, left, shape.get("pRange") != "arcLength")
    if shape is None or tag not in ("line", "arc", "spiral") or length <= 0:
        return UnknownPiece(s, length, tag)
    start = end = 0.0
    if tag == "arc":
        start = end = _numbers(shape, "curvature")[0]
    elif tag == "spiral":
        start, end = _numbers(shape, "curvStart", "curvEnd")
    return Piece(s, length, x, y, heading, start, (end - start) / length)


def _numbers(element: Element, *keys: str) -> list[float]:
    missing = [key for key in keys if key not in element.attrib]
    if missing:
        raise ValueError(f"<{element.tag}> needs the attribute {missing[0]!r}")
    return [number_in_text(f"<{element.tag}>", key, element.attrib[key]) for key in keys]
