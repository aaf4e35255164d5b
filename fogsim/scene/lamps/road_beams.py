"""Head lamps of other vehicles as what lights the road."""

from collections.abc import Mapping, Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.bodies import bodies
from fogsim.scene.vehicles import body_names
from fogsim.values.light import Beam, Lamp, RoadBeams, Side, burning
from fogsim.values.scene import Surface
from fogsim.values.traffic import TrafficState, with_pieces

FARTHEST, _MOST = 150.0, 4
"""Distance beyond which beams on the road are left out [m], and how many vehicles' are drawn, the nearest."""

_HEIGHT_STEP = 0.05
"""Heights of lamps are rounded to this [m], so that few patterns are computed."""

_FOG_HEIGHT = 0.55
"""Height of front fog lamps over that of the head lamps [-]."""


def road_beams(
    state: TrafficState,
    skip: int | None,
    eye: Sequence[float] | NDArray[np.float64],
    beams: Mapping[Lamp, Beam],
    sky_illuminance: float,
) -> RoadBeams | None:
    """Lit head lamps and front fog lamps near a camera, whichever way they shine; None if there are none.

    Takes `eye` (3,) [m], `sky_illuminance` [lx].
    """
    state, _ = with_pieces(state, skip)
    shining = int(sum(beams))
    away = np.hypot(*(state.position[:, :2] - np.asarray(eye, np.float64)[:2]).T)
    lit = np.flatnonzero(((state.lamps & shining) != 0) & (away < FARTHEST))
    nearest = [row for row in lit[np.argsort(away[lit], kind="stable")].tolist() if row != skip][:_MOST]
    names, kinds = body_names(state), tuple(beams)
    found: list[tuple[int, float, int, float]] = []
    for row in nearest:
        for kind, lamp in enumerate(kinds):
            count = sum(bool(burning(int(state.lamps[row]), side) & lamp) for side in (Side.LEFT, Side.RIGHT))
            if count:
                height = _head_lamp_height(names[row]) * float(state.height[row])
                height *= _FOG_HEIGHT if lamp is Lamp.FRONT_FOG else 1.0
                found.append((row, max(round(height / _HEIGHT_STEP), 1) * _HEIGHT_STEP, kind, float(count)))
    if not found:
        return None
    rows, heights, numbers, scales = (np.array(column) for column in zip(*found, strict=True))
    up = np.stack((np.zeros(len(rows)), np.zeros(len(rows)), heights), axis=1)
    return RoadBeams(
        position=state.position[rows] + up,
        heading=state.heading[rows],
        height=heights,
        kinds=tuple(beams.values()),
        kind=numbers.astype(np.int64),
        scale=scales,
        sky_illuminance=sky_illuminance,
    )


@cache
def _head_lamp_height(body: str) -> float:
    """Height of a body's head lamps over its own [-]."""
    heights = [
        float(lamp.centre[2]) for lamp in bodies()[body].lamps if lamp.front and lamp.surface is Surface.LAMP_HEAD
    ]
    return sum(heights) / len(heights) if heights else 0.4
