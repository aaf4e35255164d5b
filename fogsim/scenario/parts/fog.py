"""From a scenario to its fog along the ego's way."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere import airlight_from_illuminance
from fogsim.obstruction import tunnels_of
from fogsim.scenario.fog import fog_along
from fogsim.scenario.schema import Scenario
from fogsim.scenario.timeline import scripted_fog
from fogsim.values import FogField, Structure


def fog_field(scenario: Scenario, route: NDArray[np.float64], structures: Sequence[Structure] = ()) -> FogField:
    """Fog of a scenario, laid along the ego's route.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    route : (n, 3) float64
        Polyline along the route [m].
    structures : sequence of Structure
        What stands beside the roads and over them; tunnels keep fog out.
    """
    airlight = airlight_from_illuminance(scenario.light.illuminance_lx)
    fog = fog_along(scenario.fog, airlight, route, tunnels_of(structures))
    return scripted_fog(scenario.timeline, fog)
