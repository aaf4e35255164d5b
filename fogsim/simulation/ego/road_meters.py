"""Visibility meters next to the ego's route, one for each section of it that is advised by itself."""

import itertools
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere import extinction
from fogsim.simulation.ego.fog_reports import is_of_sensor
from fogsim.simulation.road_sections import meter_places, road_sections, section_limits, stations
from fogsim.simulation.run_config import SectionsConfig
from fogsim.values import FogField, FogReport, RoadSection


class RoadMeters:
    """Meters along a route (`route` (n, 3) [m], `limits` (n,) [m/s])."""

    def __init__(
        self, sections: SectionsConfig | None, route: NDArray[np.float64], limits: NDArray[np.float64]
    ) -> None:
        self._stretches = road_sections(sections, float(stations(route)[-1]))
        self._places = meter_places(sections, self._stretches, route)
        self._limits = section_limits(self._stretches, route, limits)
        self._along = [stretch.start for stretch in self._stretches]
        self._reported: dict[str, tuple[float, float]] = {}

    def reset(self) -> None:
        """Begin a run, in which no sensor has reported anything."""
        self._reported = {}

    def hear(self, reports: Iterable[FogReport]) -> None:
        """Let sensors next to the road report."""
        # Later ones come later: all are on their way for the same time.
        self._reported.update((one.source, (one.place, one.extinction)) for one in reports if is_of_sensor(one))

    def measure(self, fog: FogField) -> tuple[RoadSection, ...]:
        """What they measure, in the direction of travel."""
        if not self._stretches:
            return ()
        measured, reported = extinction(fog, self._places).tolist(), [self._nearest(at) for at in self._along]
        sections = zip(self._stretches, measured, self._limits, reported, strict=True)
        return tuple(itertools.starmap(RoadSection, sections))

    def _nearest(self, place: float) -> float | None:
        """What has been reported last by the sensor whose report is of the place nearest to one on the route [1/m]."""
        if not self._reported:
            return None
        return min(self._reported.values(), key=lambda one: abs(one[0] - place))[1]
