import itertools
import math

import numpy as np
import pytest

from fogsim.camera import AutoExposure, CameraSensor, Metering, Sensor
from fogsim.camera.exposure import followed, metered_luminance, sensor_at, wanted_saturation
from fogsim.values import Camera, Response

SENSOR = Sensor(saturation_luminance=5000.0, full_well=10_000.0, read_noise=5.0)
AUTO = AutoExposure(Metering.HIGHLIGHTS, 0.65, time_constant=0.5, brightest=1e5, ungained=100.0, darkest=4.0)
CAMERA = Camera(160, 120, 150.0, (80, 60), mount_height=1.4, response=Response.LINEAR)


def picture(luminance: float) -> np.ndarray:
    return np.full((120, 160, 3), luminance, dtype=np.float32)


def levels(sensor: CameraSensor, *luminances: float) -> list[float]:
    rng = np.random.default_rng(0)
    return [float(sensor.take(picture(v), rng).mean()) for v in luminances]


def test_the_log_average_is_the_geometric_mean() -> None:
    halves = picture(10.0)[:40, :60]  # so small that every pixel counts
    halves[:, 30:] = 1000.0
    assert metered_luminance(halves, Metering.LOG_AVERAGE) == pytest.approx(100.0, rel=1e-5)


def test_highlights_are_the_sky_and_not_the_few_lamps_in_it() -> None:
    scene = picture(300.0)
    scene[:50] = 3000.0
    scene[60:62, 70:74] = 1e6
    assert metered_luminance(scene, Metering.HIGHLIGHTS) == pytest.approx(3000.0)


def test_luminance_weighs_the_colours() -> None:
    red = picture(0.0)
    red[..., 0] = 1000.0
    assert metered_luminance(red, Metering.HIGHLIGHTS) == pytest.approx(212.6)


def test_every_size_is_metered() -> None:
    for metering in list(Metering):
        for shape in [(16, 16), (120, 160), (480, 640), (515, 688)]:
            assert metered_luminance(np.full((*shape, 3), 7.0, np.float32), metering) == pytest.approx(7.0, rel=1e-5)


def test_black_is_metered_as_the_camera_s_darkest() -> None:
    for metering in Metering:
        assert wanted_saturation(metered_luminance(picture(0.0), metering), AUTO) == AUTO.darkest


def test_the_first_picture_is_well_exposed_and_so_is_every_steady_one() -> None:
    for luminance in (50.0, 3000.0, 40_000.0):
        found = levels(CameraSensor(CAMERA, SENSOR, AUTO, 0.0, 0.1), luminance, luminance, luminance)
        assert found == pytest.approx([0.65 * 255] * 3, abs=0.3)


def test_exposure_follows_a_change_of_light_in_its_logarithm() -> None:
    """After n frames e^(−n Δt / τ) of the change in stops is left; the frame of the change itself comes too early."""
    found = levels(CameraSensor(CAMERA, SENSOR, AUTO, 0.0, 0.1), *[3000.0] * 3, *[1500.0] * 20)
    left = [2.0 ** -math.exp(-0.1 * n / 0.5) for n in range(20)]
    assert found[3:] == pytest.approx([0.65 * 255 * share for share in left], abs=0.3)


def test_sudden_light_saturates_until_the_exposure_has_followed() -> None:
    found = levels(CameraSensor(CAMERA, SENSOR, AUTO, 0.0, 0.1), 300.0, *[3000.0] * 40)
    assert found[1] == 255
    assert found[-1] == pytest.approx(0.65 * 255, abs=0.3)


def test_no_time_constant_follows_by_the_next_frame() -> None:
    at_once = AutoExposure(Metering.HIGHLIGHTS, 0.5, 0.0, 1e5, 100.0, 4.0)
    found = levels(CameraSensor(CAMERA, SENSOR, at_once, 0.0, 0.1), 1000.0, 500.0, 500.0)
    assert found == pytest.approx([127.5, 63.75, 127.5], abs=0.3)


def test_halved_periods_arrive_at_the_same_exposure() -> None:
    once = followed(100.0, 900.0, AUTO, 0.2)
    assert followed(followed(100.0, 900.0, AUTO, 0.1), 900.0, AUTO, 0.1) == pytest.approx(once)


def test_limits_hold() -> None:
    assert wanted_saturation(1e9, AUTO) == AUTO.brightest
    assert wanted_saturation(1e-3, AUTO) == AUTO.darkest


def test_gain_makes_noise_and_exposure_time_does_not() -> None:
    assert sensor_at(SENSOR, 3000.0, AUTO).full_well == SENSOR.full_well
    gained = sensor_at(SENSOR, 5.0, AUTO)
    assert gained.full_well == pytest.approx(0.05 * SENSOR.full_well)
    rng = np.random.default_rng(1)
    day, night = (
        CameraSensor(CAMERA, SENSOR, AUTO, 0.0, 0.1).take(picture(v), rng).astype(float) for v in (2000.0, 3.25)
    )
    assert night.mean() == pytest.approx(day.mean(), abs=0.3)
    # σ² of the exposure 0.65 with 10 000 and with 500 electrons (EMVA 1288), plus 1/12 for quantisation.
    for image, electrons in ((day, 10_000.0), (night, 500.0)):
        expected = 255.0**2 * (0.65 / electrons + (5.0 / electrons) ** 2) + 1 / 12
        assert image.var() == pytest.approx(expected, rel=0.04)


def test_a_run_forgets_the_one_before() -> None:
    sensor = CameraSensor(CAMERA, SENSOR, AUTO, 0.0, 0.1)
    first = levels(sensor, 100.0, 5000.0)
    sensor.reset()
    assert levels(sensor, 100.0, 5000.0) == first


def test_a_fixed_exposure_does_not_follow() -> None:
    found = levels(CameraSensor(CAMERA, SENSOR, None, 0.0, 0.1), 1000.0, 2000.0, 1000.0)
    assert found == pytest.approx([51.0, 102.0, 51.0], abs=0.3)


def test_lens_shading_is_the_fourth_power_of_the_cosine() -> None:
    """tan θ = 80 / 150 at the left border of the middle row, so cos⁴ θ = (1 + (80 / 150)²)⁻²."""
    fourth = (1 + (80 / 150) ** 2) ** -2
    middles, borders = [], []
    for strength in (0.0, 0.5, 1.0):
        sensor = CameraSensor(CAMERA, Sensor(5000.0, 1e9, 0.0), None, strength, 0.1)
        row = sensor.take(picture(4000.0), np.random.default_rng(0))[60, :, 0].astype(float)
        middles.append(row[80])
        borders.append(row[0])
    assert middles == pytest.approx([204.0] * 3, abs=0.6)
    assert borders == pytest.approx([204.0 * (1 - s * (1 - fourth)) for s in (0.0, 0.5, 1.0)], abs=0.6)
    assert all(one > other for one, other in itertools.pairwise(borders))
