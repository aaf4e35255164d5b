"""Vehicles as batches of the bodies' shapes."""

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
    groups: dict[str, list[int]] = {}
    for row, name in enumerate(body_names(state)):
        group = groups.setdefault(name, [])
        if row != skip:
            group.append(row)
    # Sorted all at once, and taken apart by slices, which cost little.
    rows = np.array([row for group in groups.values() for row in group], np.int64)
    transforms, paint = _transforms(state)[rows], state.paint[rows].astype(np.float32)
    lamps, instance = state.lamps[rows].astype(np.int32), (FIRST_VEHICLE + rows).astype(np.int32)
    batches, begin = list[Batch](), 0
    for name, group in groups.items():
        own = slice(begin, begin + len(group))
        if group:
            batches.append(Batch(name, transforms[own], paint[own], lamps[own], instance[own]))
        begin = own.stop
    return tuple(batches)


def body_names(state: TrafficState) -> list[str]:
    """Name of the shape of every vehicle."""
    sizes = zip(state.ids, state.types, state.length.tolist(), state.height.tolist(), strict=True)
    return [body_of(*vehicle) for vehicle in sizes]


def _transforms(state: TrafficState) -> NDArray[np.float32]:
    transforms = np.zeros((len(state.ids), 4, 4), np.float32)
    cosine, sine = np.cos(state.heading), np.sin(state.heading)
    transforms[:, 0, 0], transforms[:, 0, 1] = cosine * state.length, -sine * state.width
    transforms[:, 1, 0], transforms[:, 1, 1] = sine * state.length, cosine * state.width
    transforms[:, 2, 2], transforms[:, 3, 3] = state.height, 1.0
    transforms[:, :3, 3] = state.position
    return transforms
