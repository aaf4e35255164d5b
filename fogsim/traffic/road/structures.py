"""Structures next to a road or over it: polygons of SUMO additional files."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from fogsim.errors import InputError, suggest
from fogsim.traffic.road.marked_shapes import MarkedShape, marked_shapes
from fogsim.traffic.road.opendrive import is_opendrive
from fogsim.values import Structure, StructureKind

STRUCTURE_TYPE = "fogsim.structure."
"""Polygons of type ``fogsim.structure.KIND`` in an additional file are structures; their shape is their middle line."""

_WIDEST, _HEIGHTS = 10_000.0, (-1000.0, 10_000.0)
"""Greatest width of a structure, and heights of its bottom and top [m]."""


def structures(additional: Iterable[Path]) -> tuple[Structure, ...]:
    """Structures of SUMO additional files; InputError if a type or a dimension is invalid."""
    files = (path for path in additional if not is_opendrive(path))
    return tuple(
        _structure(shape) for path in files for shape in marked_shapes(path, STRUCTURE_TYPE) if shape.tag == "poly"
    )


def _structure(shape: MarkedShape) -> Structure:
    kinds = [str(one) for one in StructureKind]
    if shape.kind not in kinds:
        raise InputError(f"{shape.where}: unknown kind of structure {shape.kind!r}; {suggest(shape.kind, kinds)}")
    line = np.array([[*corner, 0.0][:3] for corner in shape.corners()], np.float64)
    width = shape.parameter("width", 0.0, _WIDEST)
    bottom, top = shape.parameter("bottom", *_HEIGHTS, 0.0), shape.parameter("top", *_HEIGHTS)
    line = line[[True, *np.any(line[1:] != line[:-1], axis=1)]]  # a repeated corner has no direction
    if len(line) < 2 or width <= 0.0 or top <= bottom:
        raise InputError(
            f"{shape.where}: a structure needs a line of two points or more, a width, and a top over its bottom"
        )
    return Structure(shape.name, StructureKind(shape.kind), line, width, bottom, top)
