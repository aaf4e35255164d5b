"""Signals of OpenDRIVE files: traffic signs at s, t relative to a road's reference line (ASAM OpenDRIVE 1.x)."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from fogsim.core.files.readers import number_in_text, number_within
from fogsim.core.files.xml_reader import read_tree
from fogsim.core.linear_algebra import matrix_product
from fogsim.errors import InputError, shown
from fogsim.units import KMH_PER_MPS
from fogsim.values import Sign

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
class _CubicPiece:
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

    pieces: tuple["Piece | _CubicPiece | _UnknownPiece", ...]

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
        for piece in (one for one in self.pieces if not isinstance(one, _UnknownPiece)):
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
class _UnknownPiece:
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


def _piece(geometry: Element) -> Piece | _CubicPiece | _UnknownPiece:
    s, x, y, heading, length = _numbers(geometry, "s", "x", "y", "hdg", "length")
    shape = next(iter(geometry), None)
    tag = "geometry without a shape" if shape is None else shape.tag
    if shape is not None and tag == "paramPoly3" and length > 0:
        forward, left = (tuple(_numbers(shape, *(f"{c}{axis}" for c in "abcd"))) for axis in "UV")
        return _CubicPiece(s, length, x, y, heading, forward, left, shape.get("pRange") != "arcLength")
    if shape is None or tag not in ("line", "arc", "spiral") or length <= 0:
        return _UnknownPiece(s, length, tag)
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


_GERMAN_SPEED_LIMIT = "274"
"""Number of the maximum-speed sign in the German catalogue (VzKat), which OpenDRIVE files commonly use."""

_HEIGHT = 2.6
"""Default height of a sign's middle [m]."""
_DIAMETER = 0.9
"""Default diameter of a sign [m]."""
FASTEST = 300.0 / KMH_PER_MPS
"""Highest speed on a sign [m/s]."""

_LONGEST_ROAD = 50_000.0
"""Longest road that is read [m]: netconvert's time grows with the square of a curve's length."""

_SECTIONS = ("planView", "elevationProfile", "lateralProfile", "lanes")
_NUMBERS = frozenset(
    "s sOffset x y hdg a b c d aU bU cU dU aV bV cV dV curvature curvStart curvEnd width height".split()  # noqa: SIM905
)

_METRES_PER_SECOND = {"": 1 / KMH_PER_MPS, "km/h": 1 / KMH_PER_MPS, "mph": 0.44704, "m/s": 1.0}
"""Units of a signal's speed; without one it is km/h."""


@dataclass(frozen=True, slots=True)
class _Road:
    """What a signal's position depends on: the file for messages, the road's line and its elevation."""

    where: str
    line: PlanView
    elevation: tuple[tuple[float, float, float, float, float], ...]

    def height(self, s: float) -> float:
        """Elevation of the reference line [m], a cubic in s from the last record that begins before it."""
        begun = [record for record in self.elevation if record[0] <= s]
        if not begun:
            return 0.0
        start, a, b, c, d = begun[-1]
        u = s - start
        return a + u * (b + u * (c + u * d))


def is_opendrive(path: Path) -> bool:
    """Whether a file is OpenDRIVE, by its name."""
    return path.suffix.lower() == ".xodr"


def opendrive_signs(path: Path, net_offset: tuple[float, float] = (0.0, 0.0)) -> list[Sign]:
    """Signs of the static signals of an OpenDRIVE file; dynamic ones (traffic lights) are left out.

    Signals of type 274 or whose name begins with "speed" are speed limits (their value, by unit; for type 274 without a
    value the subtype in km/h, as the catalogue of 2017 numbers them). All others, and speed signs without a speed, are
    of kind ``xodr.TYPE`` with their plain value, 0 without one. `net_offset` [m] was added to x and y by the conversion
    to a SUMO network.
    """
    roads = read_opendrive(path).iter("road")
    return [sign for road in roads for sign in _road_signs(path, road, net_offset)]


def read_opendrive(path: Path) -> Element:
    """Root of an OpenDRIVE file; InputError unless lengths, coordinates and coefficients have a sane size."""
    root = read_tree(path, "OpenDRIVE")
    for road in root.iter("road"):
        where = f"{path}: road {shown(road.get('id', '?'))}"
        along = [number_in_text(where, "length", road.get("length", "0"), 0.0, _LONGEST_ROAD)]
        for element in (one for section in road if section.tag in _SECTIONS for one in section.iter()):
            inside = f"{where}: <{element.tag}>"
            for key, text in element.attrib.items():
                if key in _NUMBERS:
                    number_in_text(inside, key, text)
            if element.tag == "geometry":
                along.append(number_in_text(inside, "length", element.get("length", "0"), 0.0, _LONGEST_ROAD))
        if sum(along[1:]) > _LONGEST_ROAD:
            raise InputError(
                f"{where}: its geometry is {sum(along[1:]):g} m long; at most {_LONGEST_ROAD:g} m are read"
            )
    return root


def _road_signs(path: Path, element: Element, net_offset: tuple[float, float]) -> Iterator[Sign]:
    signals = [s for s in element.iterfind("signals/signal") if s.get("dynamic", "no") != "yes"]
    if not signals:
        return
    where = f"{path}: road {shown(element.get('id', '?'))}"
    records = element.iterfind("elevationProfile/elevation")
    elevation = tuple(tuple(float(e.get(key, "0")) for key in ("s", "a", "b", "c", "d")) for e in records)
    try:
        line = plan_view(element.iterfind("planView/geometry"))
    except ValueError as error:
        raise InputError(f"{where}: {error}") from None
    left_hand = element.get("rule", "RHT") == "LHT"
    road = _Road(where, line, elevation)  # type: ignore[arg-type]  # each record has its five numbers
    for signal in signals:
        yield _sign(road, signal, net_offset, left_hand)


def _sign(road: _Road, signal: Element, net_offset: tuple[float, float], left_hand: bool) -> Sign:
    where = f"{road.where}: signal {shown(signal.get('id', '?'))}"
    s, t = (number_in_text(where, key, signal.get(key, "")) for key in "st")
    try:
        x, y, along = road.line.at(s)
    except ValueError as error:
        raise InputError(f"{where}: {error}") from None
    # Some programs write -1 for an unknown size.
    size = max(0.0, *(_number(where, signal, key) for key in ("width", "height")))
    above = _number(where, signal, "zOffset") + 0.5 * size if "zOffset" in signal.attrib else _HEIGHT
    kind, value = _meaning(where, signal)
    position = (
        x - t * math.sin(along) + net_offset[0],
        y + t * math.cos(along) + net_offset[1],
        road.height(s) + above,
    )
    heading = along + _number(where, signal, "hOffset") + (0.0 if _faces_along(signal, t, left_hand) else math.pi)
    return Sign(f"xodr.{signal.get('id', '')}", kind, value, position, heading, size or _DIAMETER)


def _faces_along(signal: Element, t: float, left_hand: bool) -> bool:
    """Whether the signal applies along the reference line; for both directions, its side decides."""
    orientation = signal.get("orientation", "none")
    return orientation == "+" or (orientation != "-" and (t > 0 if left_hand else t <= 0))


def _meaning(where: str, signal: Element) -> tuple[str, float]:
    """Type and value of a signal."""
    code, name = signal.get("type", ""), signal.get("name", "").lower()
    value = _number(where, signal, "value")
    if code == _GERMAN_SPEED_LIMIT and value <= 0 and signal.get("subtype", "").isdecimal():
        value = _number(where, signal, "subtype")
    if (code == _GERMAN_SPEED_LIMIT or name.startswith("speed")) and value > 0:
        unit = signal.get("unit", "")
        if unit not in _METRES_PER_SECOND:
            allowed = ", ".join(filter(None, _METRES_PER_SECOND))
            raise InputError(f"{where}: expected the speed's unit to be one of {allowed}, got {unit!r}")
        return "speed_limit", number_within(where, "speed in m/s", value * _METRES_PER_SECOND[unit], 0.0, FASTEST)
    # Files write -1 for "no value".
    return f"xodr.{code or 'unknown'}", max(value, 0.0)


def _number(where: str, signal: Element, key: str) -> float:
    return number_in_text(where, key, signal.get(key, "").strip() or "0")
