import math
from dataclasses import replace

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.estimators import make
from fogsim.estimators.huang2015 import Measurement, decay, mixture
from fogsim.values import Camera, Frame, Observation
from fogsim.vision.day.confirmation import Confirmation

METHODS = ("huang2015", "huang2015_rough")


def estimate(name, image, camera, **options):
    return make(name, camera, **options).update(Observation(image))


@pytest.mark.parametrize("visibility", [30.0, 50.0, 100.0, 200.0, 400.0, 800.0])
@pytest.mark.parametrize("name", METHODS)
def test_corrected_recovers_visibility(render, road, name, visibility):
    found = [estimate(name, render(road.but(visibility=visibility), seed), road.camera) for seed in range(2)]
    assert np.mean([f.visibility for f in found]) == pytest.approx(visibility, rel=0.10)


def test_as_published_sees_dense_fog_only(render, road):
    found = estimate("huang2015_rough", render(road.but(visibility=50.0)), road.camera, as_published=True)
    assert found.visibility == pytest.approx(50.0, rel=0.4)
    thin = estimate("huang2015_rough", render(road.but(visibility=400.0)), road.camera, as_published=True)
    assert not thin.valid


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


def test_as_published_averages_visibilities(render, road):
    estimator = make("huang2015", road.camera, as_published=True, time_scale=1e9)
    for seed, visibility in enumerate((40.0, 60.0)):
        found = estimator.update(Observation(Frame(0.0, render(road.but(visibility=visibility), seed), road.camera)))
    alone = [
        estimate("huang2015_rough", render(road.but(visibility=v), s), road.camera, as_published=True).visibility
        for s, v in enumerate((40.0, 60.0))
    ]
    assert found.visibility == pytest.approx(np.mean(alone))


@pytest.mark.parametrize("name", METHODS)
def test_mirroring_changes_nothing(render, road, name):
    image = render(road)
    found = estimate(name, image, road.camera)
    assert estimate(name, image[:, ::-1], road.camera).extinction == pytest.approx(found.extinction, rel=0.01)


BAD = {
    "black": np.zeros((480, 640), np.uint8),
    "white": np.full((480, 640), 255, np.uint8),
    "grey": np.full((480, 640), 128, np.uint8),
    "noise": np.random.default_rng(6).integers(0, 256, (480, 640), dtype=np.uint8),
}


@pytest.mark.parametrize("as_published", [False, True])
@pytest.mark.parametrize("image", BAD)
@pytest.mark.parametrize("name", METHODS)
def test_an_image_without_a_foggy_road_is_refused_with_a_reason(road, name, image, as_published):
    found = estimate(name, BAD[image], road.camera, as_published=as_published)
    assert not found.valid
    assert found.diagnostics["reason"]


@pytest.mark.parametrize("as_published", [False, True])
def test_upside_down_and_outside_are_refused(render, road, as_published):
    image = render(road)
    assert not estimate("huang2015_rough", image[::-1], road.camera, as_published=as_published).valid
    outside = replace(road.camera, pitch=np.radians(40.0))
    assert not estimate("huang2015_rough", image, outside, as_published=as_published).valid


@pytest.mark.parametrize("seed", range(1, 13, 2))
def test_nothing_odd_gets_out_of_random_pictures(seed):
    rng = np.random.default_rng(seed)
    camera = Camera(96, 72, rng.uniform(30, 300), (48.0, rng.uniform(0, 72)), 1.4, rng.uniform(-0.3, 0.3))
    rows = np.interp(np.arange(72), np.sort(rng.uniform(0, 72, 5)), rng.uniform(0, 300, 5))
    image = np.clip(rows[:, None] + rng.normal(0, rng.choice([0, 1, 20]), (72, 96)), 0, 255).astype(np.uint8)
    for name in METHODS:
        found = estimate(name, image, camera, as_published=True)
        assert np.isfinite(found.extinction)
        assert found.extinction >= 0
        assert found.valid == np.isfinite(found.standard_deviation)


@pytest.mark.parametrize("option", ["time_scale", "way_scale"])
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
def test_odd_scales_are_errors(road, option, value):
    with pytest.raises(InputError, match=option):
        make("huang2015", road.camera, **{option: value})
