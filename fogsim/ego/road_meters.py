"""Visibility meters beside the ego's route, one for each section of it that is advised by itself."""

import itertools

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere import extinction
from fogsim.scenario import Scenario
from fogsim.scenario.road_sections import meter_places, road_sections, section_limits, stations
from fogsim.values import FogField, RoadSection


class RoadMeters:
    """The meters of a scenario along a route.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    route : (n, 3) float64
        Polyline along the ego's route [m].
    limits : (n,) float64
        Speed limit of the road that leads to each of its points [m/s]; empty where it is not known.
    """

    def __init__(self, scenario: Scenario, route: NDArray[np.float64], limits: NDArray[np.float64]) -> None:
        self._stretches = road_sections(scenario, float(stations(route)[-1]))
        self._places = meter_places(scenario, self._stretches, route)
        self._limits = section_limits(self._stretches, route, limits)

    def measure(self, fog: FogField) -> tuple[RoadSection, ...]:
        """What they measure, in the direction of travel.

        Parameters
        ----------
        fog : FogField
            The fog now.
        """
        if not self._stretches:
            return ()
        measured = extinction(fog, self._places).tolist()
        return tuple(itertools.starmap(RoadSection, zip(self._stretches, measured, self._limits, strict=True)))
