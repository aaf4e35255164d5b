"""The rasteriser that needs no graphics system."""

import sys

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import Bands
from fogsim.render.cpu.rasteriser_kernels import rasterise
from fogsim.render.cpu.triangles import Drawn, Pinhole, Triangles, Work
from fogsim.render.drawing import NEAR, Drawing, MeshTable
from fogsim.render.lens import lens_of
from fogsim.values.camera import Camera, CameraPose

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
