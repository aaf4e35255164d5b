"""What stands beside a road or over it: polygons of SUMO additional files."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import sumolib

from fogsim.errors import InputError, suggest
from fogsim.traffic.road.opendrive import is_opendrive
from fogsim.traffic.road.xml_stream import open_unpacked
from fogsim.values import Structure, StructureKind

STRUCTURE_TYPE = "fogsim.structure."
"""Polygons of type ``fogsim.structure.KIND`` in an additional file are structures; their shape is their middle line."""


def structures(additional: Iterable[Path]) -> tuple[Structure, ...]:
    """Structures of additional files.

    Parameters
    ----------
    additional : iterable of Path
        SUMO additional files; OpenDRIVE files among them have none.

    Raises
    ------
    InputError
        If a file is none, or a structure's kind or measures are not known.
    """
    return tuple(one for path in additional if not is_opendrive(path) for one in _marked(path))


def mentions_structures(path: Path) -> bool:
    """Whether a file may have structures; quicker than reading those of a large one.

    Parameters
    ----------
    path : Path
        The file, packed by gzip or not; a missing one has none.
    """
    if not path.is_file():
        return False
    with open_unpacked(path) as source:
        return STRUCTURE_TYPE.encode() in source.read()


def _marked(path: Path) -> list[Structure]:
    try:
        shapes = list(sumolib.xml.parse(str(path), ["poly"]))
    except Exception as error:  # whatever its parser makes of a file that is none
        raise InputError(f"{path}: not a SUMO additional file: {error}") from error
    marked = [shape for shape in shapes if str(shape.getAttributeSecure("type", "")).startswith(STRUCTURE_TYPE)]
    return [_structure(path, shape) for shape in marked]


def _structure(path: Path, shape: Any) -> Structure:
    where, kind = f"{path}: poly {shape.id!r}", str(shape.type).removeprefix(STRUCTURE_TYPE)
    kinds = [str(one) for one in StructureKind]
    if kind not in kinds:
        raise InputError(f"{where}: unknown kind of structure {kind!r}; {suggest(kind, kinds)}")
    given = {parameter.key: parameter.value for parameter in (shape.param or [])}
    try:
        points = [[float(number) for number in corner.split(",")] for corner in str(shape.shape).split()]
        line = np.array([[*point, 0.0][:3] for point in points], np.float64)
        width, bottom, top = float(given["width"]), float(given.get("bottom", 0.0)), float(given["top"])
    except KeyError as error:
        raise InputError(f"{where}: a structure needs <param key={error} value='…'/>") from None
    except ValueError as error:
        raise InputError(f"{where}: a structure needs numbers for its shape, width, bottom and top: {error}") from None
    line = line[[True, *np.any(line[1:] != line[:-1], axis=1)]]  # a corner that is told twice has no direction
    if len(line) < 2 or width <= 0.0 or top <= bottom:
        raise InputError(f"{where}: a structure needs a line of two points or more, a width, and a top over its bottom")
    return Structure(str(shape.id), StructureKind(kind), line, width, bottom, top)
