"""The estimator that takes over what a forward-scatter sensor tells."""

import math

import numpy as np
import pytest
from early_motorway import EARLY

import fogsim
from fogsim.errors import InputError
from fogsim.estimators import make
from fogsim.values import Camera, Frame, Observation

CAMERA = Camera(64, 48, 60.0, (31.5, 23.5), 1.4)
IMAGE = np.zeros((48, 64), np.uint8)


def seen(scattering, time: float = 0.0) -> Observation:
    return Observation(Frame(time, IMAGE, CAMERA), scattering=scattering)


def test_without_the_sensor_the_reason_names_its_key() -> None:
    found = make("scatterometer", CAMERA).update(seen(None))
    assert not found.valid
    assert "sensors.scatterometer" in found.diagnostics["reason"]


def test_it_speaks_of_the_fog_here_with_the_sensor_s_deviation() -> None:
    found = make("scatterometer", CAMERA).update(seen(0.03))
    assert found.valid
    assert found.extinction == 0.03
    assert found.reach == 10.0
    assert found.standard_deviation == pytest.approx(0.03 * math.hypot(0.05, 0.1), rel=0.01)
    assert found.common_deviation == 0.1


def test_a_value_that_changes_lags_and_is_unsure() -> None:
    estimator = make("scatterometer", CAMERA)
    estimator.update(seen(0.01, 0.0))
    assert estimator.update(seen(0.03, 2.0)).standard_deviation > 0.02
    estimator.update(seen(0.03, 6.0))
    assert estimator.update(seen(0.03, 12.0)).standard_deviation < 0.004


def test_clear_air_has_a_deviation_too() -> None:
    found = make("scatterometer", CAMERA).update(seen(0.0))
    assert found.valid
    assert 0.0 < found.standard_deviation < 0.001


@pytest.mark.parametrize("value", [math.nan, math.inf, -0.01])
def test_what_no_sensor_tells_is_refused(value) -> None:
    with pytest.raises(InputError, match=r"scattering must be a finite extinction.*got"):
        make("scatterometer", CAMERA).update(seen(value))


SMALL = (EARLY, "camera.width=96", "camera.height=72", "duration_s=2", "estimators=[scatterometer]", "advice=none")


def test_in_the_loop_it_tells_the_fog_and_changes_nothing_else() -> None:
    without = list(fogsim.run(fogsim.load_scenario("motorway_fog_bank", [*SMALL, "fog.visibility_m=80"]), seed=4))
    keys = [*SMALL, "fog.visibility_m=80", "sensors.scatterometer={}"]
    steps = list(fogsim.run(fogsim.load_scenario("motorway_fog_bank", keys), seed=4))
    for one, other in zip(without, steps, strict=True):
        assert one.observation.scattering is None
        assert not one.estimates[0].valid
        assert np.array_equal(one.observation.image, other.observation.image)
        assert one.observation.lead == other.observation.lead
        assert abs(math.log(other.estimates[0].extinction / other.truth.extinction)) < 0.5


def test_faults_of_it_reach_the_observation() -> None:
    faults = "sensors.faults=[{fault: fouled, factor: 0.5, at_s: 0.5}, {fault: no_signal, at_s: 1.5}]"
    exact = "sensors.scatterometer={relative_deviation: 0, calibration_deviation: 0}"
    keys = [*SMALL, "fog.visibility_m=80", exact, faults]
    steps = list(fogsim.run(fogsim.load_scenario("motorway_fog_bank", keys), seed=4))
    told = {round(step.time, 1): step.observation.scattering for step in steps}
    truth = steps[0].truth.extinction
    assert told[0.0] == pytest.approx(truth)
    assert told[1.0] == pytest.approx(0.5 * truth)
    assert told[1.8] is None
