"""Benefit and cost of the ego's lamps, over steps by night and by day."""

import dataclasses

import numpy as np
import pytest

from fogsim.metrics.lighting import Lighting
from fogsim.metrics.metric import Sample
from fogsim.values import Lamp, LampEffects
from tests.recorders.synthetic import make_step

HIGH, LOW = int(Lamp.HIGH_BEAM), int(Lamp.LOW_BEAM)


def sample(elapsed: float, effects: LampEffects | None, lamps: int = LOW) -> Sample:
    step = make_step(0, time=0.0)
    traffic = dataclasses.replace(step.traffic, lamps=np.full(len(step.traffic.ids), lamps, np.int32))
    truth = dataclasses.replace(step.truth, lamp_effects=effects)
    return Sample(dataclasses.replace(step, traffic=traffic, truth=truth), elapsed, {})


def test_seconds_of_glare_add_up_over_drivers_and_shares_over_the_night() -> None:
    lighting = Lighting()
    lighting.update(sample(0.0, LampEffects(30.0)))
    lighting.update(sample(1.0, LampEffects(20.0, (0.9, 1.0, 4.0)), HIGH))
    lighting.update(sample(3.0, LampEffects(40.0, (0.5,))))
    lighting.update(sample(9.0, None, HIGH))
    assert lighting.result() == {
        "mean_own_sight_m": 35.0,
        "minimum_own_sight_m": 20.0,
        "high_beam_time_share": 0.25,
        "glare_dealt_time_share": 0.25,
        "glare_dealt_s": pytest.approx(2.0),
        "max_glare_dealt_cdpm2": 4.0,
    }


def test_by_day_there_is_nothing_to_tell() -> None:
    lighting = Lighting()
    lighting.update(sample(1.0, None))
    assert set(lighting.result()) == set(Lighting.definitions)
    assert all(value is None for value in lighting.result().values())
