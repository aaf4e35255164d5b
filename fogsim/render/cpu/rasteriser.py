"""The rasteriser that needs no graphics system."""

import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import Bands, kernel
from fogsim.render.cpu.occlusion import depth_key, gather_copies
from fogsim.render.cpu.triangles import (
    Drawn,
    Index,
    Pinhole,
    Triangles,
    Wide,
    Work,
    cull_triangles,
    project,
    set_up_boxes,
)
from fogsim.render.drawing import NEAR, Drawing, MeshTable
from fogsim.render.projection import lens_of
from fogsim.values.camera import Camera, CameraPose

_SMALL = 64  # boxes of no more pixels are looked at before their triangle is drawn
_LANES = 8
_EMPTY = 0xFFFFFFFF  # nothing, infinitely far away

Point = tuple[float, float, float]
Edges = tuple[float, float, float, float, float, float, float, float, float, float, float, float]
"""Coefficients over column, row and 1 of the three eᵢ, positive inside, and of 1/z [1/m]."""


@kernel
def rasterise(
    triangles: Triangles,
    drawn: Drawn,
    pinhole: Pinhole,
    picture: Index,
    columns: int,
    top: int,
    bottom: int,
    work: Work,
) -> None:
    """Find the nearest triangle of each pixel of some rows.

    Takes `picture` (rows, columns + at least 7) int64, `columns` [px].
    """
    picture[top:bottom] = _EMPTY
    # Handing an array to a function costs as much as drawing a triangle, so the functions below take many copies each.
    size, begin = (top, bottom, columns), 0
    while begin < len(drawn.mesh):
        count, begin = gather_copies(triangles, drawn, begin, pinhole, picture, size, work)
        copies = work.copy[:count]
        project(triangles, drawn, copies, pinhole, work.corners)
        count = cull_triangles(triangles, drawn, copies, size, work)
        count = set_up_boxes(count, pinhole, size, work)
        _fill(work, count, pinhole.lens, pinhole.near, picture)


@kernel
def _edges(p: Point, q: Point, r: Point, focal: float, u0: float, v0: float) -> Edges:
    """Set up a triangle; of one that is seen edge on, nothing is inside.

    What two triangles that share an edge find for it is the same but for the sign, to the last bit, so that no pixel
    falls between them.
    """
    ax, ay, az = q[1] * r[2] - q[2] * r[1], q[2] * r[0] - q[0] * r[2], q[0] * r[1] - q[1] * r[0]
    bx, by, bz = r[1] * p[2] - r[2] * p[1], r[2] * p[0] - r[0] * p[2], r[0] * p[1] - r[1] * p[0]
    cx, cy, cz = p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]
    determinant = p[0] * ax + p[1] * ay + p[2] * az
    if determinant == 0.0:
        return (0.0, 0.0, -1.0, 0.0, 0.0, -1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0)
    sign = 1.0 if determinant > 0.0 else -1.0
    per_focal = sign / focal
    ax, ay, bx, by, cx, cy = (
        ax * per_focal,
        ay * per_focal,
        bx * per_focal,
        by * per_focal,
        cx * per_focal,
        cy * per_focal,
    )
    az, bz, cz = sign * az - ax * u0 - ay * v0, sign * bz - bx * u0 - by * v0, sign * cz - cx * u0 - cy * v0
    scale = 1.0 / abs(determinant)
    zx, zy, zz = (ax + bx + cx) * scale, (ay + by + cy) * scale, (az + bz + cz) * scale
    return (ax, ay, az, bx, by, bz, cx, cy, cz, zx, zy, zz)


@kernel
def _fill(work: Work, count: int, lens: Wide, near: float, picture: Index) -> None:
    """Draw the pixels of triangles, row by row between their edges."""
    points, box, triangle_ids, focal, u0, v0 = work.points, work.box, work.triangle_id, lens[0], lens[1], lens[2]
    for t in range(count):
        top, bottom, left, right = int(box[t, 0]), int(box[t, 1]), int(box[t, 2]), int(box[t, 3])
        least = min(points[t, 2], points[t, 5], points[t, 8])
        crossing = least <= near
        if not crossing and right - left < _LANES:
            # Most small triangles are hidden by what has been drawn already, and to see that is cheap.
            limit, hidden = depth_key(np.float32(1.0001) / least, 0), True
            beside, over = np.uint64(left), np.int64(right - left)
            for v in range(np.uint64(top), np.uint64(bottom + 1)):
                shown = 0
                for i in range(np.uint64(_LANES)):
                    shown |= (picture[v, beside + i] <= limit) & (np.int64(i) <= over)
                hidden = shown == 0
                if not hidden:
                    break
            if hidden:
                continue
        p = (np.float64(points[t, 0]), np.float64(points[t, 1]), np.float64(points[t, 2]))
        q = (np.float64(points[t, 3]), np.float64(points[t, 4]), np.float64(points[t, 5]))
        r = (np.float64(points[t, 6]), np.float64(points[t, 7]), np.float64(points[t, 8]))
        ax, ay, az, bx, by, bz, cx, cy, cz, zx, zy, zz = _edges(p, q, r, focal, u0, v0)
        # Of two triangles that share an edge, one begins where the other ends: both find the same place for it.
        a1, a0, a3, a2 = _bounds(ax, ay, az)
        b1, b0, b3, b2 = _bounds(bx, by, bz)
        c1, c0, c3, c2 = _bounds(cx, cy, cz)
        d1, d0, d3, d2 = _bounds(-zx, -zy, 1.0 / near - zz) if crossing else (0.0, -np.inf, 0.0, np.inf)
        if ax == 0.0 or bx == 0.0 or cx == 0.0:
            top, bottom = _rows(top, bottom, ax, ay, az)
            top, bottom = _rows(top, bottom, bx, by, bz)
            top, bottom = _rows(top, bottom, cx, cy, cz)
        first, last, number, step = float(left), float(right), triangle_ids[t], np.float32(zx)
        for v in range(np.uint64(top), np.uint64(bottom + 1)):
            row = float(v)
            low = max(a1 * row + a0, b1 * row + b0, c1 * row + c0, d1 * row + d0)
            high = min(a3 * row + a2, b3 * row + b2, c3 * row + c2, d3 * row + d2)
            low, high = np.ceil(max(low, first)), np.floor(min(high, last))
            # A row of few pixels is drawn as one of eight, some of them masked, and so is an empty one: to guess how
            # often a short loop turns costs the processor more. Comparisons are such that NaN makes a row empty.
            span = high - low if high >= low else -1.0
            low = low if low < last else last
            begin, end = np.uint64(low), np.int64(span)
            lanes: Any = max(end + 1, _LANES)
            start = np.float32(zx * low + zy * row + zz)
            # Unsigned numbers tell the compiler that no index counts from the end.
            for i in range(np.uint64(lanes)):
                found = depth_key(start + step * np.float32(np.int32(i)), number)
                found = found if np.int64(i) <= end else 0
                before = picture[v, begin + i]
                picture[v, begin + i] = found if found > before else before


@kernel
def _bounds(x: float, y: float, rest: float) -> tuple[float, float, float, float]:
    """Where x · u + y · v + rest is not negative: least u as slope over v and value at 0, and greatest u."""
    inverse = -1.0 / x
    if x > 0.0:
        return y * inverse, rest * inverse, 0.0, np.inf
    if x < 0.0:
        return 0.0, -np.inf, y * inverse, rest * inverse
    return 0.0, -np.inf, 0.0, np.inf


@kernel
def _rows(top: int, bottom: int, x: float, y: float, rest: float) -> tuple[int, int]:
    """Rows from top to bottom in which x · u + y · v + rest is not negative, if it does not depend on the column."""
    if x != 0.0:
        return top, bottom
    if y > 0.0:
        return int(min(max(top, np.ceil(-rest / y)), bottom + 1.0)), bottom
    if y < 0.0:
        return top, int(max(min(bottom, np.floor(-rest / y)), top - 1.0))
    return (top, bottom) if rest >= 0.0 else (top, top - 1)


_LOWER_HALF = 0 if sys.byteorder == "little" else 1  # which of the two halves of a number comes first in memory
_TOGETHER = 2048  # most triangles that are worked on at a time, if no mesh has more


class CPURasteriser:
    """Finds what pixels see to the bit the same every time, large pictures by two threads (see `Rasteriser`)."""

    def __init__(self, table: MeshTable) -> None:
        counts = np.diff(table.first_vertex)
        low, high = table.extremes()
        start = np.repeat(table.first_vertex[:-1], np.diff(table.first_face))
        self._triangles = Triangles(
            positions=np.ascontiguousarray(table.positions.T),
            faces=(table.faces - start[:, None]).astype(np.uint32),
            first_vertex=table.first_vertex,
            first_face=table.first_face,
            in_solid=table.in_solid,
            centre=0.5 * (low + high),
            half_extent=0.5 * (high - low),
        )
        self._most = (
            max(int(counts.max(initial=1)), 2 * _TOGETHER),
            max(int(np.diff(table.first_face).max(initial=1)), _TOGETHER),
        )
        # One for each band; the second is made when it is used.
        self._work = [_room(*self._most)]
        self._bands = Bands()
        self._picture = np.empty((0, 0), np.int64)

    def triangle_ids(self, drawing: Drawing, camera: Camera, pose: CameraPose) -> NDArray[np.int32]:
        """Find the nearest triangle of each pixel (see `Rasteriser.triangle_ids`)."""
        # Behind each row lies what vectors reach over its end, and so much that rows lie apart in the cache.
        size = (camera.height, camera.width // 16 * 16 + 24)
        if self._picture.shape != size:
            self._picture = np.empty(size, np.int64)
        lens = lens_of(camera, pose)
        drawn = Drawn(drawing.mesh, drawing.record.view(np.float32).reshape(-1, 17), drawing.first)
        pinhole = Pinhole(lens.axes, lens.lens, NEAR)

        def draw(band: int, top: int, bottom: int) -> None:
            if band == len(self._work):
                self._work.append(_room(*self._most))
            rasterise(
                self._triangles,
                drawn,
                pinhole,
                self._picture,
                camera.width,
                top,
                bottom,
                self._work[band],
            )

        self._bands.work(draw, camera.height, camera.width)
        return self._picture.view(np.int32)[:, _LOWER_HALF : 2 * camera.width : 2]

    def close(self) -> None:
        """Let go of its picture."""
        self._picture = np.empty((0, 0), np.int64)


def _room(vertices: int, faces: int) -> Work:
    """Memory for so many vertices and triangles at a time."""
    return Work(
        corners=np.empty((5, vertices), np.float32),
        points=np.empty((faces, 9), np.float32),
        box=np.empty((faces, 4), np.int32),
        # One more, since the last one is written down before it is left out.
        vertex=np.empty((faces + 1, 3), np.uint32),
        triangle_id=np.empty(faces + 1, np.int32),
        copy=np.empty(faces, np.int64),
    )
