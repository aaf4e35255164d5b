"""Painted lines as triangles, for renderers that cannot draw them on the road as shading does."""

import numpy as np
from numpy.typing import NDArray

from fogsim.render.shading.lines import DASH, LINE_WIDTH, PERIOD
from fogsim.render.shading.road import LINE_REFLECTANCE
from fogsim.values.scene import Mesh

Corners = NDArray[np.float64]

_REFLECTANCE, _ALONG, _ACROSS, _HALF_WIDTH, _LINES = slice(6, 9), 9, 10, 11, 12  # columns of a corner


def painted_road(road: Mesh) -> Mesh:
    """Cut painted lines out of a road, so that they are triangles with a reflectance of their own.

    Returns the same surface; no triangles share vertices.
    """
    columns = (road.positions, road.normals, road.reflectance, road.road)
    rest = np.concatenate(columns, axis=1).astype(np.float64)[road.faces]
    finished: list[Corners] = []
    for sign in (1.0, -1.0):
        codes = rest[:, 0, _LINES].astype(np.int64)
        code = codes // 3 if sign > 0.0 else codes % 3
        without, lined = rest[code == 0], rest[code > 0]
        beside = sign * lined[..., _ACROSS] - lined[..., _HALF_WIDTH]
        inner = _part_above(lined, -beside - 0.5 * LINE_WIDTH)
        strip = _part_above(lined, beside + 0.5 * LINE_WIDTH)
        beside = sign * strip[..., _ACROSS] - strip[..., _HALF_WIDTH]
        outer, strip = _part_above(strip, beside - 0.5 * LINE_WIDTH), _part_above(strip, 0.5 * LINE_WIDTH - beside)
        codes = strip[:, 0, _LINES].astype(np.int64)
        dashed = (codes // 3 if sign > 0.0 else codes % 3) == 2
        dashes, gaps = _dashes(strip[dashed])
        for paint in (strip[~dashed], dashes):
            paint[..., _REFLECTANCE] = LINE_REFLECTANCE
            finished.append(paint)
        rest = np.concatenate([without, inner, outer, gaps])
    corners = np.concatenate([rest, *finished]).reshape(-1, 13)
    count = len(corners)
    return Mesh(
        positions=corners[:, :3].astype(np.float32),
        normals=corners[:, 3:6].astype(np.float32),
        reflectance=corners[:, _REFLECTANCE].astype(np.float32),
        surface=np.full(count, road.surface[0] if len(road.surface) else 0, np.int32),
        road=corners[:, _ALONG:].astype(np.float32),
        instance=np.full(count, road.instance[0] if len(road.instance) else 0, np.int32),
        faces=np.arange(count, dtype=np.uint32).reshape(-1, 3),
    )


def _dashes(strip: Corners) -> tuple[Corners, Corners]:
    """Painted and unpainted parts of a dashed strip."""
    empty = strip[:0]
    if not len(strip):
        return empty, empty
    dashes, gaps = [empty], [empty]
    first = np.floor(strip[..., _ALONG].min(axis=1) / PERIOD)
    periods = np.floor(strip[..., _ALONG].max(axis=1) / PERIOD) - first
    for number in range(int(periods.max()) + 1):
        some, start = strip[periods >= number], PERIOD * (first + number)[periods >= number]
        for pieces, begin, end in ((dashes, 0.0, DASH), (gaps, DASH, PERIOD)):
            # Cut both ends at once: the place along the line stays a column of the pieces.
            kept, where = _part_above_with(some, some[..., _ALONG] - (start + begin)[:, None], start)
            pieces.append(_part_above(kept, (where + end)[:, None] - kept[..., _ALONG]))
    return np.concatenate(dashes), np.concatenate(gaps)


def _part_above(corners: Corners, value: NDArray[np.float64]) -> Corners:
    """The part of triangles (m, 3, k) where a value that is given at their corners (m, 3) is not negative."""
    return _part_above_with(corners, value, np.zeros(len(corners)))[0]


def _part_above_with(
    corners: Corners, value: NDArray[np.float64], mark: NDArray[np.float64]
) -> tuple[Corners, NDArray[np.float64]]:
    """As `_part_above`, and for each piece the mark (m,) of the triangle that it is part of."""
    inside = value >= 0.0
    count = inside.sum(axis=1)
    whole = count == 3
    parts, marks = [corners[whole]], [mark[whole]]
    for number in (1, 2):
        cut = count == number
        # The corner that is alone on its side comes first.
        alone = np.argmax(inside[cut] if number == 1 else ~inside[cut], axis=1)
        order = (alone[:, None] + np.arange(3)) % 3
        at = np.take_along_axis(value[cut], order, axis=1)
        a, b, c = np.take_along_axis(corners[cut], order[..., None], axis=1).transpose(1, 0, 2)
        ab = a + (at[:, 0] / (at[:, 0] - at[:, 1]))[:, None] * (b - a)
        ac = a + (at[:, 0] / (at[:, 0] - at[:, 2]))[:, None] * (c - a)
        pieces = [(a, ab, ac)] if number == 1 else [(ab, b, c), (ab, c, ac)]
        parts += [np.stack(piece, axis=1) for piece in pieces]
        marks += [mark[cut]] * len(pieces)
    return np.concatenate(parts), np.concatenate(marks)
