"""States of traffic of which only what matters is written."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fogsim.values import TrafficState


def vehicles(
    position: ArrayLike,
    *,
    kinds: str | Sequence[str] = "car",
    size: ArrayLike = (4.6, 1.8, 1.5),
    lane: str | Sequence[str] = "",
    lamps: ArrayLike = 0,
    paint: ArrayLike = 0.3,
    **further: Any,
) -> TrafficState:
    """Vehicles whose front bumpers are at positions (n, 3) or, along x, (n,) [m]; one value is that of all."""
    place = np.asarray(position, np.float64)
    if place.ndim == 1:
        place = np.column_stack((place, np.zeros((len(place), 2))))
    place = place.reshape(-1, 3)
    count = len(place)
    length, width, height = np.broadcast_to(np.asarray(size, np.float64), (count, 3)).T.copy()
    ids = further.pop("ids", tuple(f"v{row}" for row in range(count)))
    motion = {
        name: np.broadcast_to(np.asarray(further.pop(name, 0.0), np.float64), count).copy()
        for name in ("heading", "speed", "acceleration")
    }
    return TrafficState(
        time=further.pop("time", 0.0),
        ids=tuple(ids),
        types=(kinds,) * count if isinstance(kinds, str) else tuple(kinds),
        position=place,
        **motion,
        length=length,
        width=width,
        height=height,
        lane=(lane,) * count if isinstance(lane, str) else tuple(lane),
        lamps=np.broadcast_to(np.asarray(lamps, np.int32), count).copy(),
        paint=np.broadcast_to(np.asarray(paint, np.float64), (count, 3)).copy(),
        **further,
    )
