"""From a scenario to its fog along the ego's way."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere import airlight_from_illuminance, layer_thickness
from fogsim.errors import InputError
from fogsim.obstruction import tunnels_of
from fogsim.scenario.fog import fog_along
from fogsim.scenario.schema import Scenario
from fogsim.scenario.timeline import scripted_fog
from fogsim.values import FogField, Structure


def fog_field(scenario: Scenario, route: NDArray[np.float64], structures: Sequence[Structure] = ()) -> FogField:
    """Fog of a scenario, laid along the ego's route; `fog_of_run` draws its patches (`route` (n, 3) [m])."""
    airlight = airlight_from_illuminance(scenario.light.illuminance_lx, scenario.fog.airlight_share)
    fog = scripted_fog(scenario.timeline, fog_along(scenario.fog, airlight, route, tunnels_of(structures)))
    if fog.ground_albedo is not None:
        _check_layer(fog, float(route[:, 2].max()) + (scenario.camera.mount_height_m or 0.0))
    return fog


def fog_of_run(scenario: Scenario, fog: FogField, patch_seed: int) -> FogField:
    """Fog of a scenario with the patches of one run, unless the scenario gives their seed."""
    written = scenario.fog.patches
    if fog.patches is None or written is None or written.seed is not None:
        return fog
    return replace(fog, patches=replace(fog.patches, seed=patch_seed))


def _check_layer(fog: FogField, eye: float) -> None:
    """Refuse a layer that may become denser than is known, or lower than an eye."""
    tops = [fog.top, *(change.top for change in fog.changes)]
    density = max([1.0, *fog.reachable_densities, *(change.density for change in fog.changes)])
    layer_thickness(fog.extinction * density, max(tops) - fog.ground)
    if eye > min(tops):
        raise InputError(
            "fog.airlight: photons is known for eyes within the layer: fog.top_m must be above the highest point of "
            f"the road and the camera, {eye - fog.ground:.4g} m, got {min(tops) - fog.ground:.4g} m"
        )
