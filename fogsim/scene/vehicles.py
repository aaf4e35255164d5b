"""Vehicles as batches of the bodies' shapes, and with them all else that moves or changes."""

import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib.resources import files
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.scene.solids import Material, box
from fogsim.scene.town import person_batches, signal_batches
from fogsim.values.scene import Batch, Instance, Mesh, Surface
from fogsim.values.traffic import BOX, NO_PERSONS, PEDESTRIAN, PersonState, TrafficState, with_pieces

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


def traffic_batches(state: TrafficState, skip: int | None) -> tuple[Batch, ...]:
    """Build one batch for each shape of a vehicle, a traffic light or a person."""
    standing = (*vehicle_batches(state, skip), *signal_batches(state.signals, state.time))
    return (*standing, *person_batches(state.persons), *person_batches(_on_foot(state)))


def _on_foot(state: TrafficState) -> PersonState:
    """Persons among the vehicles."""
    if PEDESTRIAN not in state.types:
        return NO_PERSONS
    rows = [row for row, kind in enumerate(state.types) if kind == PEDESTRIAN]
    ids, lane = (tuple(names[row] for row in rows) for names in (state.ids, state.lane))
    on_street = np.zeros(len(rows), np.bool_)
    return PersonState(ids, state.position[rows], state.heading[rows], state.speed[rows], lane, on_street)


def vehicle_batches(state: TrafficState, skip: int | None) -> tuple[Batch, ...]:
    """Build one batch for each shape that is on the road.

    Returns shapes fill a unit box, so the transforms scale them to length, width and height.
    """
    state, owner = with_pieces(state, skip)
    shapes, rows = _grouped(state.ids, state.types, state.length.tobytes(), state.height.tobytes(), skip)
    instance = (Instance.FIRST_VEHICLE + owner[rows]).astype(np.int32)
    # Sorted all at once, and taken apart by slices, which cost little.
    transforms, paint = np.zeros((len(rows), 4, 4), np.float32), np.empty((len(rows), 3), np.float32)
    copies = _Copies(transforms, paint, np.empty(len(rows), np.int32))
    # One vehicle's columns lie side by side, those of many may not: without this a kernel is compiled for either.
    position, heading, grade, length, width, height, painted = map(
        np.ascontiguousarray,
        (state.position, state.heading, state.grade, state.length, state.width, state.height, state.paint),
    )
    _place_copies(rows, _Vehicles(position, heading, grade, length, width, height, painted, state.lamps), copies)
    return tuple([Batch(name, transforms[own], paint[own], copies.lamps[own], instance[own]) for name, own in shapes])


class _Vehicles(NamedTuple):
    """Columns of a `TrafficState`."""

    position: NDArray[np.float64]
    heading: NDArray[np.float64]
    grade: NDArray[np.float64]
    length: NDArray[np.float64]
    width: NDArray[np.float64]
    height: NDArray[np.float64]
    paint: NDArray[np.float64]
    lamps: NDArray[np.int32]


class _Copies(NamedTuple):
    """Columns of a `Batch`."""

    transforms: NDArray[np.float32]
    paint: NDArray[np.float32]
    lamps: NDArray[np.int32]


@kernel
def _place_copies(rows: NDArray[np.int64], vehicles: _Vehicles, copies: _Copies) -> None:
    """Transforms from a unit box turned by heading and grade, paint and lamps of some rows."""
    for i in range(len(rows)):
        row, transform = rows[i], copies.transforms[i]
        cosine, sine = math.cos(vehicles.heading[row]), math.sin(vehicles.heading[row])
        level, rise = math.cos(vehicles.grade[row]), math.sin(vehicles.grade[row])
        length, width, height = vehicles.length[row], vehicles.width[row], vehicles.height[row]
        ahead, upward = level * length, rise * height
        transform[0, 0], transform[0, 1], transform[0, 2] = cosine * ahead, -sine * width, -cosine * upward
        transform[1, 0], transform[1, 1], transform[1, 2] = sine * ahead, cosine * width, -sine * upward
        transform[2, 0], transform[2, 2], transform[3, 3] = rise * length, level * height, 1.0
        for axis in range(3):
            transform[axis, 3], copies.paint[i, axis] = vehicles.position[row, axis], vehicles.paint[row, axis]
        copies.lamps[i] = vehicles.lamps[row]


# Traffic changes slowly: from one picture to the next nearly all vehicles are the same, in the same order.
@lru_cache(maxsize=16)
def _grouped(
    ids: tuple[str, ...], types: tuple[str, ...], length: bytes, height: bytes, skip: int | None
) -> tuple[tuple[tuple[str, slice], ...], NDArray[np.int64]]:
    """Rows by shape: each shape with its slice of them, and the rows; all who ask get the same."""
    groups: dict[str, list[int]] = {}
    for row, name in enumerate(_names(ids, types, length, height)):
        group = groups.setdefault(name, [])
        if row != skip and name != PEDESTRIAN:
            group.append(row)
    ends = np.cumsum([0, *map(len, groups.values())]).tolist()
    shapes = tuple((name, slice(*ends[n : n + 2])) for n, name in enumerate(groups) if groups[name])
    rows = np.array([row for group in groups.values() for row in group], np.int64)
    rows.flags.writeable = False
    return shapes, rows


def body_names(state: TrafficState) -> tuple[str, ...]:
    """Name of the shape of every vehicle."""
    return _names(state.ids, state.types, state.length.tobytes(), state.height.tobytes())


@lru_cache(maxsize=16)
def _names(ids: tuple[str, ...], types: tuple[str, ...], length: bytes, height: bytes) -> tuple[str, ...]:
    sizes = (np.frombuffer(length).tolist(), np.frombuffer(height).tolist())
    return tuple(body_of(*vehicle) for vehicle in zip(ids, types, *sizes, strict=True))
