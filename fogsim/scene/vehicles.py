"""Vehicles as batches of the bodies' shapes."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

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
    shapes, rows = _grouped(state.ids, state.types, state.length.tobytes(), state.height.tobytes(), skip)
    # Sorted all at once, and taken apart by slices, which cost little.
    transforms, paint = _transforms(state)[rows], state.paint[rows].astype(np.float32)
    lamps, instance = state.lamps[rows].astype(np.int32), (FIRST_VEHICLE + rows).astype(np.int32)
    return tuple(Batch(name, transforms[own], paint[own], lamps[own], instance[own]) for name, own in shapes)


# Traffic changes slowly: from one picture to the next nearly all vehicles are the same, in the same order.
@lru_cache(maxsize=16)
def _grouped(
    ids: tuple[str, ...], types: tuple[str, ...], length: bytes, height: bytes, skip: int | None
) -> tuple[tuple[tuple[str, slice], ...], NDArray[np.int64]]:
    """Rows by shape: each shape with its slice of them, and the rows, which belong to all who asked."""
    groups: dict[str, list[int]] = {}
    for row, name in enumerate(_names(ids, types, length, height)):
        group = groups.setdefault(name, [])
        if row != skip:
            group.append(row)
    ends = np.cumsum([0, *map(len, groups.values())]).tolist()
    shapes = tuple((name, slice(*ends[n : n + 2])) for n, name in enumerate(groups) if groups[name])
    return shapes, np.array([row for group in groups.values() for row in group], np.int64)


def body_names(state: TrafficState) -> tuple[str, ...]:
    """Name of the shape of every vehicle."""
    return _names(state.ids, state.types, state.length.tobytes(), state.height.tobytes())


@lru_cache(maxsize=16)
def _names(ids: tuple[str, ...], types: tuple[str, ...], length: bytes, height: bytes) -> tuple[str, ...]:
    sizes = (np.frombuffer(length).tolist(), np.frombuffer(height).tolist())
    return tuple(body_of(*vehicle) for vehicle in zip(ids, types, *sizes, strict=True))


def _transforms(state: TrafficState) -> NDArray[np.float32]:
    transforms = np.zeros((len(state.ids), 4, 4), np.float32)
    cosine, sine = np.cos(state.heading), np.sin(state.heading)
    transforms[:, 0, 0], transforms[:, 0, 1] = cosine * state.length, -sine * state.width
    transforms[:, 1, 0], transforms[:, 1, 1] = sine * state.length, cosine * state.width
    transforms[:, 2, 2], transforms[:, 3, 3] = state.height, 1.0
    transforms[:, :3, 3] = state.position
    return transforms
