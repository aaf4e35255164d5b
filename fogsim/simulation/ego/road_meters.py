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
        self.reset()

    def reset(self) -> None:
        """Begin a run, in which no sensor has reported anything."""
        self._reported: dict[str, tuple[float, float]] = {}
        self._nearest: list[float | None] = [None] * len(self._stretches)

    def hear(self, reports: Iterable[FogReport]) -> None:
        """Let sensors next to the road report."""
        # Later ones come later: all are on their way for the same time.
        if new := {one.source: (one.place, one.extinction) for one in reports if is_of_sensor(one)}:
            self._reported.update(new)
            self._nearest = [self._reported_near(stretch.start) for stretch in self._stretches]

    def measure(self, fog: FogField) -> tuple[RoadSection, ...]:
        """What they measure, in the direction of travel."""
        if not self._stretches:
            return ()
        measured = extinction(fog, self._places).tolist()
        sections = zip(self._stretches, measured, self._limits, self._nearest, strict=True)
        return tuple(itertools.starmap(RoadSection, sections))

    def _reported_near(self, place: float) -> float:
        """What has been reported last by the sensor whose report is of the place nearest to one on the route [1/m]."""
        return min(self._reported.values(), key=lambda one: abs(one[0] - place))[1]
