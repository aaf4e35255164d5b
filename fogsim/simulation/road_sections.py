"""Where along the ego's route advice is given to sections of road, each by itself."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.simulation.run_config import SectionsConfig
from fogsim.values import Display, Stretch

_SHORTEST = 10.0
"""No section begins nearer to the end of the route than this [m], which two ways of measuring it agree about."""

EYES = (0.0, 0.0, 1.2)
"""Where a meter next to the road measures, above it [m]: at drivers' eyes."""


def road_sections(config: SectionsConfig | None, length: float) -> tuple[Stretch, ...]:
    """Sections of the ego's route that are advised each by itself, in the direction of travel (`length` [m]).

    InputError if there is none, or if a sign is not on the route.
    """
    if config is None:
        return ()
    end = min(config.end, length)
    starts = list(config.at) or np.arange(config.first, end, config.spacing).tolist()
    lost = [start for start in config.at if start > length - _SHORTEST] or ([] if starts else [config.first])
    if lost:
        raise InputError(
            f"drivers.signs: {lost[0]:g} m is beyond the route, which is {length:.0f} m long and has its last sign at "
            f"least {_SHORTEST:g} m before its end"
        )
    starts = [start for start in starts if start < end and start <= length - _SHORTEST]
    # What ends with the route has no end of its own: whoever is there has not left it.
    last = math.inf if end >= length else end
    return tuple(Stretch(start, stop, config.along) for start, stop in zip(starts, [*starts[1:], last], strict=True))


def meter_places(
    config: SectionsConfig | None, sections: tuple[Stretch, ...], route: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Where the visibility of each section is measured: at its sign; in the middle where there are none.

    Returns places at the height of drivers' eyes [m] (m, 3). Takes `route` (n, 3) [m].
    """
    if config is None or not sections:
        return np.empty((0, 3))
    station = stations(route)
    aside = 0.0 if config.display == Display.MESSAGE_SIGN else 0.5
    at = [s.start + aside * (min(s.end, float(station[-1])) - s.start) for s in sections]
    return np.stack([np.interp(at, station, route[:, axis]) for axis in range(3)], axis=-1) + EYES


def section_limits(
    sections: tuple[Stretch, ...], route: NDArray[np.float64], limits: NDArray[np.float64]
) -> tuple[float, ...]:
    """Speed limit where each section begins [m/s]; ``inf`` where no limits are known.

    Takes `route` (n, 3) [m], `limits` (n,) [m/s].
    """
    if not len(limits):
        return (math.inf,) * len(sections)
    behind = np.searchsorted(stations(route), [section.start for section in sections], side="right")
    return tuple(limits[np.minimum(behind, len(limits) - 1)].tolist())


def stations(route: NDArray[np.float64]) -> NDArray[np.float64]:
    """Positions of a route's points along it (n,) [m] (`route` (n, 3) [m])."""
    return np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(route, axis=0), axis=1))))
