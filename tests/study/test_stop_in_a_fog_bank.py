"""The scene in which shipped studies compare policies."""

import numpy as np
import pytest

import fogsim
from fogsim.study import shipped_studies
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY

SCENE = shipped_studies()["message_sign"].parent / "motorway" / "stop_in_a_fog_bank.yaml"


def test_a_vehicle_stops_in_the_densest_fog_while_the_cohort_comes() -> None:
    for step in fogsim.run_traffic(fogsim.load_scenario(SCENE), seed=0):
        standing = np.flatnonzero(step.traffic.speed < 0.1)
        if len(standing):
            break
    assert step.traffic.ids[standing[0]] == "same_way.0.15"
    assert step.truth.vehicle_extinctions[standing[0]] == pytest.approx(OPTICAL_DEPTH_AT_VISIBILITY / 60.0)
    assert len(step.cohort.vehicles & {*step.traffic.ids}) > len(step.cohort.vehicles) / 2
