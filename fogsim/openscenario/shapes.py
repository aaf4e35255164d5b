"""Shapes of trajectories as polylines: pieces of clothoids and NURBS are at most 1 mm from the curve."""

import itertools
import math
from collections.abc import Callable, Sequence

from fogsim.openscenario.xml_tree import Node, NodeError

Place = tuple[float, float, float | None, float | None]
"""x, y [m] and heading of a place, and the direction of its road [rad, None if not given]."""

Polyline = tuple[list[list[float]], list[float]]
"""x, y [m] and perhaps heading [deg] of points, and the time at each [s]."""

_OFF = 0.001  # Greatest distance of a piece from its curve [m]
_MOST = 5000  # Pieces of a trajectory
_HIGHEST, _LIGHTEST = 10, 1e-6  # Order of NURBS, and weight
_DEEPEST = 12  # Halvings of a piece
_FIRST = 4  # Pieces between two knots before any is halved
_NEAR = 1e-6  # Part of the way between two knots over which a tangent is measured
_POINTS = {"Polyline": "Vertex", "Nurbs": "ControlPoint"}


def shape_of(trajectory: Node) -> Node:
    """Shape of a ``Trajectory``; ValueError if it is closed or has none."""
    if trajectory.flag("closed"):
        raise ValueError("closed: write the first vertex again as the last one, and false")
    return trajectory.need("Shape").need(*_SAMPLED)


def positions_of(shape: Node) -> list[Node]:
    """The positions that a shape has, the first of them where it begins."""
    if shape.tag in _POINTS:
        return [one.need("Position") for one in shape.some(_POINTS[shape.tag])]
    if shape.tag == "Clothoid":
        return [shape.need("Position")]
    first, *others = shape.some("ClothoidSplineSegment")
    for one in others:
        if one.all("PositionStart"):
            raise NodeError(one, "PositionStart: a segment begins where the one before ends; give it for the first")
    return [first.need("PositionStart")]


def sampled(shape: Node, places: Sequence[Place], is_timed: bool) -> Polyline:
    """A shape whose positions are at some places as a polyline; ValueError if its times or curvatures fit none."""
    return _SAMPLED[shape.tag](shape, places, is_timed)


def _times(nodes: Sequence[Node], key: str, is_timed: bool) -> list[float]:
    return [one.number(key, None if is_timed else 0.0) for one in nodes]


def _polyline(shape: Node, places: Sequence[Place], is_timed: bool) -> Polyline:
    points = [[x, y] if heading is None else [x, y, math.degrees(heading)] for x, y, heading, _ in places]
    return points, _times(shape.all("Vertex"), "time", is_timed)


def _clothoid(shape: Node, places: Sequence[Place], is_timed: bool) -> Polyline:
    length, first, change = shape.number("length"), shape.number("curvature"), shape.number("curvaturePrime", 0.0)
    if shape.get("curvatureDot"):
        shape.remark("curvatureDot is read as curvaturePrime, a change per metre")
        change = shape.number("curvatureDot")
    if bool(shape.get("startTime")) != bool(shape.get("stopTime")):
        raise ValueError("expected startTime and stopTime, or neither")
    times = [shape.number(key, None if is_timed else 0.0) for key in ("startTime", "stopTime")]
    return _spiral(places[0], [(0.0, first, first + change * length, length)], times, is_timed)


def _clothoid_spline(shape: Node, places: Sequence[Place], is_timed: bool) -> Polyline:
    segments = shape.all("ClothoidSplineSegment")
    keys = "curvatureStart", "curvatureEnd", "length"
    parts = [[one.number("hOffset", 0.0), *(one.number(key) for key in keys)] for one in segments]
    if parts[0][0]:
        raise NodeError(segments[0], "hOffset: give the heading of the first segment by its PositionStart")
    times = [*_times(segments, "timeStart", is_timed), *_times([shape], "timeEnd", is_timed)]
    return _spiral(places[0], parts, times, is_timed)


def _spiral(begin: Place, parts: Sequence[Sequence[float]], times: Sequence[float], is_timed: bool) -> Polyline:
    """Clothoids one after another: turns before them [rad], curvatures [1/m], lengths [m]; times at their ends [s]."""
    x, y, given, along = begin
    heading = given if given is not None else along or 0.0
    points, reached = list[list[float]](), list[float]()
    for (turn, first, last, length), (begun, over) in zip(parts, itertools.pairwise(times), strict=True):
        if length <= 0.0:
            raise ValueError(f"length: expected more than 0, got {length:g}")
        if is_timed and over <= begun:
            raise ValueError(f"times: expected each later than the one before, got {over:g} s after {begun:g} s")
        heading += turn
        change = (last - first) / length
        pieces = length * math.sqrt(max(abs(first), abs(last)) / (8.0 * _OFF))
        count = math.ceil(min(pieces, _MOST + 1.0)) or 1
        if len(points) + count > _MOST:
            raise ValueError(f"a trajectory has at most {_MOST} pieces of 1 mm off its curve")

        def turned(s: float, heading: float = heading, first: float = first, change: float = change) -> float:
            return heading + s * (first + 0.5 * change * s)

        points += [] if points else [[x, y, math.degrees(heading)]]
        reached += [] if reached else [begun]
        step = length / count
        for s in (n * step for n in range(count)):
            # Simpson's rule, exact to a thousandth of the piece's distance from the curve.
            within = [(1.0, turned(s)), (4.0, turned(s + 0.5 * step)), (1.0, turned(s + step))]
            x += step / 6.0 * sum(weight * math.cos(angle) for weight, angle in within)
            y += step / 6.0 * sum(weight * math.sin(angle) for weight, angle in within)
            points.append([x, y, math.degrees(turned(s + step))])
            reached.append(begun + (over - begun) * (s + step) / length)
        heading = turned(length)
    return points, reached


def _knots(shape: Node, points: int, order: int) -> list[float]:
    """Knots of NURBS that begin at their first control point; ValueError if they do not, or have corners."""
    knots = [one.number("value") for one in shape.all("Knot")]
    if not 2 <= order <= min(points, _HIGHEST) or len(knots) != points + order:
        message = f"an order of 2 … {_HIGHEST}, as many points or more, and as many knots as points and order together"
        raise ValueError(f"expected {message}; got order {order}, {points} points and {len(knots)} knots")
    first, inner, last = knots[:order], knots[order:-order], knots[-order:]
    if knots != sorted(knots) or len({*first}) > 1 or len({*last}) > 1 or first == last:
        raise ValueError(f"Knot: expected rising values, the first and the last {order} times, so that it begins there")
    if any(one in first + last or inner.count(one) > max(order - 2, 1) for one in inner):
        raise ValueError("Knot: a value so often is a corner, or a gap; write two trajectories")
    return knots


def _nurbs(shape: Node, places: Sequence[Place], is_timed: bool) -> Polyline:
    """NURBS, whose times are a third coordinate of the control points."""
    controls, order = shape.all("ControlPoint"), round(shape.number("order"))
    knots, weights = _knots(shape, len(controls), order), [one.number("weight", 1.0) for one in controls]
    times = _times(controls, "time", is_timed)
    if min(weights) < _LIGHTEST or max(weights) > 1.0 / _LIGHTEST or (is_timed and times != sorted({*times})):
        message = f"weights of {_LIGHTEST:g} … {1.0 / _LIGHTEST:g}, and each time later than the one before"
        raise ValueError(f"ControlPoint: expected {message}")
    rows = [[w * x, w * y, w * t, w] for (x, y, *_), t, w in zip(places, times, weights, strict=True)]

    def at(u: float) -> list[float]:
        return _on_nurbs(u, rows, knots)

    ends = sorted({*knots})
    cuts = [knots[0]]
    for low, high in itertools.pairwise(ends):
        for n in range(_FIRST):
            a, b = (low + part / _FIRST * (high - low) for part in (n, n + 1))
            cuts += _halved(at, a, b, is_timed)
            if len(cuts) > _MOST:
                raise ValueError(f"a trajectory has at most {_MOST} pieces of 1 mm off its curve")
    points, near = [at(u) for u in cuts], _NEAR * (ends[-1] - ends[0])
    tangents = [(at(max(u - near, ends[0])), at(min(u + near, ends[-1]))) for u in cuts]
    turns = [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in tangents]
    headings = [[math.degrees(turn)] if order > 2 else [] for turn in turns]
    return [[x, y, *h] for (x, y, _), h in zip(points, headings, strict=True)], [t for *_, t in points]


def _on_nurbs(u: float, rows: Sequence[Sequence[float]], knots: Sequence[float]) -> list[float]:
    """x, y [m] and time [s], by de Boor's algorithm; rows are those of the control points, weighted, and weights."""
    order = len(knots) - len(rows)
    span = max(n for n in range(order - 1, len(rows)) if knots[n] <= u or n == order - 1)
    local = [list(rows[span - order + 1 + n]) for n in range(order)]
    for level in range(1, order):
        for n in range(order - 1, level - 1, -1):
            low, high = knots[span - order + 1 + n], knots[span + 1 + n - level]
            share = (u - low) / (high - low)
            local[n] = [a + share * (b - a) for a, b in zip(local[n - 1], local[n], strict=True)]
    return [one / local[-1][3] for one in local[-1][:3]]


def _halved(at: Callable[[float], list[float]], low: float, high: float, is_timed: bool, depth: int = 0) -> list[float]:
    """Where pieces of a curve end so that each is on it, also in time."""
    (x, y, begun), (to_x, to_y, over) = at(low), at(high)
    chord = max(math.dist((x, y), (to_x, to_y)), _OFF)
    for u in (low + part * (high - low) for part in (0.25, 0.5, 0.75)):
        on_x, on_y, time = at(u)
        along = ((on_x - x) * (to_x - x) + (on_y - y) * (to_y - y)) / (chord * chord)
        share = (time - begun) / ((over - begun) or 1.0) if is_timed else along
        off = math.dist((on_x, on_y), (x + share * (to_x - x), y + share * (to_y - y)))
        if off > _OFF and depth < _DEEPEST:
            middle = 0.5 * (low + high)
            return [
                *_halved(at, low, middle, is_timed, depth + 1),
                *_halved(at, middle, high, is_timed, depth + 1),
            ]
    return [high]


_SAMPLED: dict[str, Callable[[Node, Sequence[Place], bool], Polyline]] = {
    "Polyline": _polyline,
    "Clothoid": _clothoid,
    "ClothoidSpline": _clothoid_spline,
    "Nurbs": _nurbs,
}
