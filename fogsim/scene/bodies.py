"""Bodies of vehicles with their levels of detail, each filling a unit box, and which vehicle has which.

They are data: ``tools/make_bodies.py`` writes ``data/bodies.npz`` from the models in ``tools/vehicle_bodies``.
"""

import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.solids import Material, box
from fogsim.values.scene import Instance, Mesh, Surface
from fogsim.values.traffic import BOX, PEDESTRIAN

LIT_AREAS = {
    Surface.LAMP_POSITION_REAR: 62e-4,
    Surface.LAMP_STOP: 59e-4,
    Surface.LAMP_REAR_FOG: 100e-4,
    Surface.LAMP_INDICATOR_LEFT: 133e-4,
    Surface.LAMP_INDICATOR_RIGHT: 133e-4,
    Surface.LAMP_HEAD: 200e-4,
}
"""Luminous area of each lamp [m²]: with its intensity, the luminance that its surface has when it is lit."""


LAMPLESS = (BOX, PEDESTRIAN)
"""Body kinds without lamps, which are none of `bodies`."""


@dataclass(frozen=True, slots=True)
class BodyLamp:
    """A lamp of a body."""

    surface: Surface  # Which lamp
    front: bool  # True if it shines forwards, else backwards
    centre: NDArray[np.float64]  # (3,): Its middle in the unit box
    area: float  # Area as seen from straight ahead or behind, in units of the box's width times its height


@dataclass(frozen=True, slots=True)
class Body:
    """What all vehicles of a shape have in common."""

    size: tuple[float, float, float]  # Length, width and height of the vehicle that it is modelled after [m]
    lamps: tuple[BodyLamp, ...]  # Its lamps


def body_shapes() -> dict[str, Mesh]:
    """Shapes of all bodies by name, each with its levels of detail."""
    return dict(_shapes())


def box_shapes() -> dict[str, Mesh]:
    """Shape of an obstacle."""
    return {BOX: box((-1.0, -0.5, 0.0), (0.0, 0.5, 1.0), Material((0.5, 0.5, 0.5), Surface.PAINT))}


@cache
def _packed() -> Mapping[str, NDArray[np.generic]]:
    with (files("fogsim.scene") / "data" / "bodies.npz").open("rb") as file, np.load(file) as packed:
        arrays = dict(packed)
    for array in arrays.values():
        array.flags.writeable = False
    return arrays


@cache
def _shapes() -> Mapping[str, Mesh]:
    packed = _packed()
    vertices, faces = np.cumsum(packed["vertices"])[:-1], np.cumsum(packed["triangles"])[:-1]
    count = len(packed["positions"])
    columns = {
        "positions": packed["positions"],
        "normals": packed["normals"],
        "reflectance": packed["reflectance"],
        "surface": packed["surface"].astype(np.int32),
        "road": np.zeros((count, 4), np.float32),
        "instance": np.full(count, Instance.ROADSIDE, np.int32),
        "faces": packed["faces"].astype(np.uint32),
    }
    for array in columns.values():
        array.flags.writeable = False
    parts = [np.split(array, faces if name == "faces" else vertices) for name, array in columns.items()]
    return {name: Mesh(*arrays) for name, *arrays in zip(packed["names"].tolist(), *parts, strict=True)}


@cache
def bodies() -> Mapping[str, Body]:
    """Bodies by the name of their shape."""
    packed = _packed()
    lamps = [
        BodyLamp(Surface(surface), front, centre, area)
        for surface, front, centre, area in zip(
            packed["lamp_surface"].tolist(),
            packed["lamp_front"].tolist(),
            packed["lamp_centre"],
            packed["lamp_area"].tolist(),
            strict=True,
        )
    ]
    ends = np.cumsum([0, *packed["lamps"]]).tolist()
    names = [name for name in packed["names"].tolist() if ":" not in name]
    return {
        name: Body(tuple(size), tuple(lamps[first:end]))
        for name, size, first, end in zip(names, packed["size"].tolist(), ends[:-1], ends[1:], strict=True)
    }


@lru_cache(maxsize=65536)
def body_of(vehicle_id: str, kind: str, length: float, height: float) -> str:
    """Name of the shape of a vehicle, the same whenever it is asked (`length`, `height` [m])."""
    chance = zlib.crc32(vehicle_id.encode()) / 2**32
    if kind == "trailer" or (kind == "truck" and length >= 11.0):
        name = "trailer" if kind == "trailer" else "semitrailer"
        return name if chance < 0.5 else f"{name}_curtain"
    if kind == "truck":
        return "rigid_truck" if height >= 2.9 else "flatbed_truck"
    if kind in {"van", "bus", "motorcycle", "tractor", "carriage", *LAMPLESS}:
        return kind
    if height > 1.6:
        return "suv"
    if length < 4.2:
        return "hatchback"
    return _LONG[int(chance * len(_LONG))] if length > 4.6 else _ANY[int(chance * len(_ANY))]


_ANY = ("hatchback", "hatchback", "hatchback", "saloon", "saloon", "estate", "estate", "suv", "suv")
_LONG = ("saloon", "saloon", "saloon", "estate", "estate", "suv")
