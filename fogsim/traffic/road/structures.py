"""Structures next to a road or over it: polygons of SUMO additional files."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fogsim.core.files.readers import number_in_text
from fogsim.core.files.xml_reader import XmlFile
from fogsim.errors import InputError, shown, suggest
from fogsim.traffic.road.configuration import is_true
from fogsim.traffic.road.opendrive import is_opendrive
from fogsim.values import Structure, StructureKind

_MOST_BYTES, _MOST_ELEMENTS = 2_000_000_000, 20_000_000


@dataclass(frozen=True, slots=True)
class MarkedShape:
    """A POI or polygon; `kind` is its type after the prefix, and `where` names it in messages."""

    where: str
    tag: str
    kind: str
    attributes: dict[str, str]
    parameters: dict[str, str] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Its id."""
        return self.attributes.get("id", "")

    def parameter(self, key: str, least: float, most: float, default: float | None = None) -> float:
        """Number in a ``<param>``; InputError if missing without a default, or not from `least` to `most`."""
        if default is not None and key not in self.parameters:
            return default
        if key not in self.parameters:
            raise InputError(f'{self.where}: <param key="{key}" value="…"/> is missing')
        return number_in_text(self.where, key, self.parameters[key], least, most)

    def corners(self) -> list[list[float]]:
        """Coordinates of its corners [m], two or three each; InputError if it has none, or they are geographic."""
        if is_true(self.attributes.get("geo", "false")):
            raise InputError(f"{self.where}: geo: expected corners x,y of the network [m], not longitude and latitude")
        shape = self.attributes.get("shape", "")
        corners = [
            [number_in_text(self.where, "shape", number) for number in corner.split(",")] for corner in shape.split()
        ]
        if not corners or not all(2 <= len(corner) <= 3 for corner in corners):
            raise InputError(f"{self.where}: expected a shape of corners x,y or x,y,z, got {shown(shape)}")
        return corners


def marked_shapes(path: Path, prefix: str) -> list[MarkedShape]:
    """POIs and polygons of an additional file whose type begins with a prefix."""
    reader = _ShapeReader(path, prefix)
    reader.file.read_all(reader, _MOST_BYTES, _MOST_ELEMENTS)
    return reader.found


class _ShapeReader:
    is_done = False

    def __init__(self, path: Path, prefix: str) -> None:
        self.file = XmlFile(path)
        self.found: list[MarkedShape] = []
        self._path = path
        self._prefix = prefix
        self._inside: MarkedShape | None = None

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        if tag in {"poi", "poly"} and attributes.get("type", "").startswith(self._prefix):
            where = f"{self._path}:{self.file.line}: {tag} {shown(attributes.get('id', ''))}"
            self._inside = MarkedShape(where, tag, attributes["type"].removeprefix(self._prefix), attributes)
            self.found.append(self._inside)
        elif tag == "param" and self._inside is not None:
            self._inside.parameters[attributes.get("key", "")] = attributes.get("value", "")

    def end(self, tag: str) -> None:
        if tag in {"poi", "poly"}:
            self._inside = None


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
