"""Which copies are worth drawing, a handful at a time: those of many triangles only where their boxes may be seen."""

from typing import Any

import numpy as np

from fogsim.core.jit import kernel
from fogsim.render.cpu.triangles import Array, Drawn, Index, Pinhole, Triangles, Wide, Work

_MANY = 40  # triangles from which looking at a copy's box costs less than looking at all of them
_SLACK = 1e-3  # by which boxes are widened, over their extents and in metres, for the sake of rounding


@kernel
def gather_copies(
    triangles: Triangles,
    drawn: Drawn,
    begin: int,
    pinhole: Pinhole,
    picture: Index,
    size: tuple[int, int, int],
    work: Work,
) -> tuple[int, int]:
    """Gather as many copies as there is memory for, but none that lies between pixels or is hidden by what is drawn.

    Returns number of copies gathered, and the first copy that has not been looked at.
    """
    mesh, record, axes, lens, near = drawn.mesh, drawn.record, pinhole.axes, pinhole.lens, pinhole.near
    first_vertex, first_face, copies = triangles.first_vertex, triangles.first_face, work.copy
    centre, half = triangles.centre, triangles.half_extent
    count, vertices, faces = 0, 0, 0
    for copy in range(begin, len(mesh)):
        shape = mesh[copy]
        own = first_face[shape + 1] - first_face[shape]
        if own >= _MANY:
            z, deep = _along(record, copy, axes, 2, centre, half, shape)
            if z - deep > near:
                x, wide = _along(record, copy, axes, 0, centre, half, shape)
                y, high = _along(record, copy, axes, 1, centre, half, shape)
                per_nearest, per_farthest = lens[0] / (z - deep), lens[0] / (z + deep)
                left, right = _pixels(x - wide, x + wide, per_nearest, per_farthest, lens[1], 0, size[2])
                top, bottom = _pixels(y - high, y + high, per_nearest, per_farthest, lens[2], size[0], size[1])
                limit, hidden = depth_key(np.float32(1.0001 / (z - deep)), 0), True
                for v in range(np.uint64(top), np.uint64(bottom)):
                    for u in range(np.uint64(left), np.uint64(right)):
                        hidden &= picture[v, u] > limit
                    if not hidden:
                        break
                if hidden:
                    continue
        vertices += first_vertex[shape + 1] - first_vertex[shape]
        faces += own
        if vertices > work.corners.shape[1] or faces > len(work.points) or count == len(copies):
            return count, copy
        copies[count] = copy
        count += 1
    return count, len(mesh)


@kernel
def depth_key(inverse_depth: float | np.float32, triangle_id: int) -> Any:
    """What a pixel sees as one number: the greater, the nearer (`inverse_depth` [1/m])."""
    return np.int64(np.float32(inverse_depth).view(np.int32)) << 32 | np.int64(triangle_id)


@kernel
def _along(
    record: Array, copy: int, axes: Wide, axis: int, centre: Wide, half: Wide, shape: int
) -> tuple[float, float]:
    """Where the middle of a copy's bounding box lies along an axis of the camera [m], and how far the box reaches."""
    x, y, z = axes[axis, 0], axes[axis, 1], axes[axis, 2]
    middle, reach = x * record[copy, 3] + y * record[copy, 7] + z * record[copy, 11], _SLACK
    for side in range(3):
        turned = x * record[copy, side] + y * record[copy, 4 + side] + z * record[copy, 8 + side]
        middle += turned * centre[shape, side]
        reach += abs(turned) * half[shape, side]
    return middle, reach * (1.0 + _SLACK)


@kernel
def _pixels(
    low: float, high: float, per_nearest: float, per_farthest: float, principal: float, first: int, after: int
) -> tuple[int, int]:
    """First of the columns or rows whose pixels' centres a box may cover, and the one after the last."""
    begin = np.ceil(low * (per_nearest if low < 0.0 else per_farthest) + principal)
    end = np.floor(high * (per_nearest if high > 0.0 else per_farthest) + principal) + 1.0
    begin, end = min(float(after), max(float(first), begin)), min(float(after), max(float(first), end))
    return int(begin), int(end)
