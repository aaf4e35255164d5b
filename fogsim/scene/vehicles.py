"""Vehicles as batches of the bodies' shapes."""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel
from fogsim.scene.bodies import body_of
from fogsim.values.scene import Batch
from fogsim.values.traffic import TrafficState

FIRST_VEHICLE = 16
"""Instance id of the vehicle in row 0 (see `View.instance`)."""


def vehicle_batches(state: TrafficState, skip: int | None) -> tuple[Batch, ...]:
    """Build one batch for each shape that is on the road.

    Parameters
    ----------
    state : TrafficState
        Every vehicle; a body kind without a shape is drawn as a car.
    skip : int or None
        Row that is left out, as a rule the vehicle that carries the camera.

    Returns
    -------
    tuple of Batch
        Shapes fill a unit box, so the transforms scale them to length, width and height.
    """
    shapes, rows, instance = _grouped(state.ids, state.types, state.length.tobytes(), state.height.tobytes(), skip)
    # Sorted all at once, and taken apart by slices, which cost little.
    transforms, paint = np.zeros((len(rows), 4, 4), np.float32), np.empty((len(rows), 3), np.float32)
    lamps, size = np.empty(len(rows), np.int32), (state.length, state.width, state.height)
    turned = (state.heading, state.grade)
    set_up(rows, state.position, turned, size, state.paint, state.lamps, transforms, paint, lamps)
    return tuple(Batch(name, transforms[own], paint[own], lamps[own], instance[own]) for name, own in shapes)


@kernel
def set_up(
    rows: NDArray[np.int64],
    position: NDArray[np.float64],
    turned: tuple[NDArray[np.float64], NDArray[np.float64]],
    size: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
    paint: NDArray[np.float64],
    lamps: NDArray[np.int32],
    transforms: NDArray[np.float32],
    paint_out: NDArray[np.float32],
    lamps_out: NDArray[np.int32],
) -> None:
    """Transforms from a unit box turned by heading and grade, paint and lamps of some rows of a `TrafficState`."""
    length, width, height = size
    heading, grade = turned
    for i in range(len(rows)):
        row = rows[i]
        cosine, sine = math.cos(heading[row]), math.sin(heading[row])
        level, rise = math.cos(grade[row]), math.sin(grade[row])
        ahead, upward = level * length[row], rise * height[row]
        transforms[i, 0, 0], transforms[i, 0, 1], transforms[i, 0, 2] = (
            cosine * ahead,
            -sine * width[row],
            -cosine * upward,
        )
        transforms[i, 1, 0], transforms[i, 1, 1], transforms[i, 1, 2] = (
            sine * ahead,
            cosine * width[row],
            -sine * upward,
        )
        transforms[i, 2, 0], transforms[i, 2, 2], transforms[i, 3, 3] = rise * length[row], level * height[row], 1.0
        for axis in range(3):
            transforms[i, axis, 3], paint_out[i, axis] = position[row, axis], paint[row, axis]
        lamps_out[i] = lamps[row]


# Traffic changes slowly: from one picture to the next nearly all vehicles are the same, in the same order.
@lru_cache(maxsize=16)
def _grouped(
    ids: tuple[str, ...], types: tuple[str, ...], length: bytes, height: bytes, skip: int | None
) -> tuple[tuple[tuple[str, slice], ...], NDArray[np.int64], NDArray[np.int32]]:
    """Rows by shape: each shape with its slice of them, the rows, and their instance ids; all who ask get the same."""
    groups: dict[str, list[int]] = {}
    for row, name in enumerate(_names(ids, types, length, height)):
        group = groups.setdefault(name, [])
        if row != skip:
            group.append(row)
    ends = np.cumsum([0, *map(len, groups.values())]).tolist()
    shapes = tuple((name, slice(*ends[n : n + 2])) for n, name in enumerate(groups) if groups[name])
    rows = np.array([row for group in groups.values() for row in group], np.int64)
    instance = (FIRST_VEHICLE + rows).astype(np.int32)
    rows.flags.writeable = instance.flags.writeable = False
    return shapes, rows, instance


def body_names(state: TrafficState) -> tuple[str, ...]:
    """Name of the shape of every vehicle."""
    return _names(state.ids, state.types, state.length.tobytes(), state.height.tobytes())


@lru_cache(maxsize=16)
def _names(ids: tuple[str, ...], types: tuple[str, ...], length: bytes, height: bytes) -> tuple[str, ...]:
    sizes = (np.frombuffer(length).tolist(), np.frombuffer(height).tolist())
    return tuple(body_of(*vehicle) for vehicle in zip(ids, types, *sizes, strict=True))
