"""A forward-scatter sensor on board: its average, its noise and its calibration."""

import math

import numpy as np
import pytest

from fogsim.core.randomness import spawn_streams
from fogsim.sensors import Scatterometer, faulty_scattering
from fogsim.values import Fault, RunningFault
from fogsim.values.fault import Blackout, Fouled, NoSignal


def test_an_exact_one_tells_the_average_over_its_time_constant() -> None:
    sensor = Scatterometer(0.0, 0.0, 5.0)
    assert sensor.measure(0.01, 0.0) == 0.01
    told = [sensor.measure(0.05, 0.1 * i) for i in range(1, 51)]
    assert told[-1] == pytest.approx(0.05 - 0.04 * math.exp(-1.0))
    assert Scatterometer(0.0, 0.0, 0.0).measure(0.05, 1.0) == 0.05


@pytest.mark.parametrize("period", [0.1, 2.0])
def test_the_deviation_of_values_is_that_told_however_often_it_is_asked(period: float) -> None:
    sensor = Scatterometer(0.05, 0.0, 1.0)
    sensor.reset(np.random.default_rng(3))
    told = np.log([sensor.measure(0.02, period * i) / 0.02 for i in range(20_000)])
    assert told.std() == pytest.approx(0.05, rel=0.1)
    assert told.mean() == pytest.approx(0.0, abs=0.01)


def test_the_calibration_is_one_for_a_run_and_another_for_the_next() -> None:
    sensor, factors = Scatterometer(0.0, 0.1, 1.0), []
    for seed in range(400):
        sensor.reset(np.random.default_rng(seed))
        told = [sensor.measure(0.02, float(i)) for i in range(3)]
        assert told == pytest.approx([told[0]] * 3)
        factors.append(math.log(told[0] / 0.02))
    assert np.std(factors) == pytest.approx(0.1, rel=0.1)


def test_faults() -> None:
    def running(kind) -> RunningFault:
        return RunningFault(Fault(kind), 0.0, math.inf, np.random.default_rng(0))

    assert faulty_scattering(0.02, []) == 0.02
    assert faulty_scattering(0.02, [running(Blackout())]) == 0.02
    assert faulty_scattering(0.02, [running(Fouled(3.0))]) == pytest.approx(0.06)
    assert faulty_scattering(0.02, [running(Fouled(3.0)), running(NoSignal())]) is None


def test_its_stream_moves_no_other() -> None:
    """The first numbers of the other streams with seed 1, as they were before there was one."""
    children = np.random.SeedSequence(1).spawn(8)
    streams = spawn_streams(1)
    names = ("camera", "sensors", "driver", "faults", "gps", "reports")
    for name, child in zip(names, children[2:], strict=True):
        assert getattr(streams, name).random() == np.random.default_rng(child).random()
