import math

import numpy as np
import pytest

from fogsim.estimators import make
from fogsim.estimators.huang2015 import Measurement, decay, mixture
from fogsim.estimators.huang2015_medians import Huang2015Repair, optimised_extinctions
from fogsim.values import Frame, Observation
from fogsim.vision.day.confirmation import Confirmation
from fogsim.vision.region.profile import RoadCurve

METHODS = ("huang2015", "huang2015_rough")


def estimate(name, image, camera, **options):
    return make(name, camera, **options).update(Observation(image))


@pytest.mark.parametrize("visibility", [30.0, 200.0, 800.0])
def test_corrected_recovers_visibility(render, road, visibility):
    images = [render(road.but(visibility=visibility), seed) for seed in range(2)]
    for name in METHODS:
        found = [estimate(name, image, road.camera).visibility for image in images]
        assert np.mean(found) == pytest.approx(visibility, rel=0.10), name


def test_as_published_sees_dense_fog_only(render, road):
    found = estimate("huang2015_rough", render(road.but(visibility=50.0)), road.camera, as_published=True)
    assert found.visibility == pytest.approx(50.0, rel=0.4)
    thin = estimate("huang2015_rough", render(road.but(visibility=400.0)), road.camera, as_published=True)
    assert not thin.valid


def test_of_a_black_region_the_law_makes_no_airlight():
    below = np.arange(1.0, 41.0)
    curve = RoadCurve(below, np.zeros(40), 400.0 / below, np.ones(40), 400.0)
    found = optimised_extinctions(curve, np.zeros((40, 1)), np.array([0.03]), frozenset(Huang2015Repair))
    assert np.isfinite(found).all()


def test_decay_is_that_of_section_5_2():
    then = Measurement(0.03, 0.001, time=2.0, way=100.0, track=0)
    assert decay(then, 2.0, 100.0, 10.0, 200.0) == 1.0
    assert decay(then, 12.0, 300.0, 10.0, 200.0) == pytest.approx(math.exp(-2.0))


def test_mixture_has_the_square_that_eq_5_2_lacks():
    mean, deviation = mixture([1.0, 3.0], [1.0, 1.0], [0.0, 0.0])
    assert (mean, deviation) == (2.0, 1.0)
    mean, deviation = mixture([1.0, 3.0], [3.0, 1.0], [0.0, 2.0])
    assert mean == 1.5
    assert deviation == pytest.approx(math.sqrt(0.75 * 0.25 + 0.25 * (2.25 + 4.0)))


def test_old_and_distant_measurements_fade(render, road, monkeypatch):
    # Weights by the road's own deviations; what the day model adds to them differs between the two images.
    monkeypatch.setattr(Confirmation, "of", lambda _, own, *_rest: own)
    estimator = make("huang2015", road.camera)
    frame = Frame(0.0, render(road.but(visibility=60.0)), road.camera)
    first = estimator.update(Observation(frame, speed=25.0))
    later = Frame(8.0, render(road.but(visibility=240.0)), road.camera)
    second = estimator.update(Observation(later, speed=25.0))
    assert first.visibility == pytest.approx(60.0, rel=0.1)
    assert 150.0 < second.visibility < 240.0
    assert second.standard_deviation > second.diagnostics["rough"].standard_deviation
    assert second.diagnostics["measurements"] == 2
    blind = estimator.update(Observation(Frame(9.0, np.zeros((480, 640), np.uint8), road.camera), speed=25.0))
    assert blind.valid
    assert blind.visibility == pytest.approx(second.visibility, rel=0.05)
    long_after = estimator.update(Observation(Frame(99.0, np.zeros((480, 640), np.uint8), road.camera), speed=25.0))
    assert not long_after.valid
    estimator.reset()
    assert estimator.update(Observation(frame)).diagnostics["measurements"] == 1


def test_what_is_remembered_becomes_unsure(render, road):
    estimator = make("huang2015", road.camera)
    fog, dark = render(road.but(visibility=60.0)), np.zeros((480, 640), np.uint8)
    first = estimator.update(Observation(Frame(0.0, fog, road.camera)))
    later = [estimator.update(Observation(Frame(time, dark, road.camera))) for time in (10.0, 40.0)]
    # But for the rounding of the logarithm, which is what is averaged.
    assert later[0].extinction == pytest.approx(first.extinction, rel=1e-12)
    assert later[0].standard_deviation == pytest.approx(math.sqrt(math.e) * first.standard_deviation)
    assert later[1].visibility_interval[1] == math.inf


def test_as_published_averages_visibilities(render, road):
    estimator = make("huang2015", road.camera, as_published=True, time_scale=1e9)
    for seed, visibility in enumerate((40.0, 60.0)):
        found = estimator.update(Observation(Frame(0.0, render(road.but(visibility=visibility), seed), road.camera)))
    alone = [
        estimate("huang2015_rough", render(road.but(visibility=v), s), road.camera, as_published=True).visibility
        for s, v in enumerate((40.0, 60.0))
    ]
    assert found.visibility == pytest.approx(np.mean(alone))
