"""Pictures of what moves while the shutter is open: the mean of the light of several instants."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fogsim.camera import Shutter
from fogsim.values import CameraPose, TrafficState, View

_LEAST_WAY = 0.01
"""Way [m] below which nothing is drawn smeared: of the road 4 m ahead it is half a pixel of a picture 640 wide."""

Drawn = tuple[View, NDArray[np.float32] | None]


def moved(state: TrafficState, seconds: float) -> TrafficState:
    """Traffic a little later or earlier: every vehicle goes straight on (`seconds` [s])."""
    pieces = state.pieces
    if pieces.kind:
        along = seconds * state.speed[pieces.row]
        way = along * np.array([np.cos(pieces.heading), np.sin(pieces.heading), np.sin(pieces.grade)])
        pieces = replace(pieces, position=pieces.position + way.T)
    return replace(state, position=state.position + seconds * _velocities(state), pieces=pieces)


def exposed(
    draw: Callable[[TrafficState, CameraPose], Drawn], shutter: Shutter, state: TrafficState, ego: int, pose: CameraPose
) -> Drawn:
    """Draw what a camera gets while its shutter is open.

    Vehicles, the camera's own among them, go straight on for the time; what they turn and speed up in it is left out.
    """
    if shutter.open_time * float(state.speed.max()) < _LEAST_WAY:
        return draw(state, pose)
    own, total = _velocities(state)[ego], np.zeros(())
    for seconds in shutter.offsets():
        x, y, z = (np.array(pose.position) + seconds * own).tolist()
        view, radiance = draw(moved(state, seconds), replace(pose, position=(x, y, z)))
        if radiance is None:
            return view, None
        total = total + radiance.astype(np.float64)
    return view, (total / shutter.instants).astype(np.float32)


def _velocities(state: TrafficState) -> NDArray[np.float64]:
    flat = state.speed * np.cos(state.grade)
    return np.stack(
        (flat * np.cos(state.heading), flat * np.sin(state.heading), state.speed * np.sin(state.grade)), axis=1
    )
