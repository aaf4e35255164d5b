import math
from dataclasses import replace

import numpy as np
import pytest

from fogsim.camera import AutoExposure, CameraSensor, Metering, Sensor, expose
from fogsim.camera.exposure import followed, metered_luminance, response_table, sensor_at, wanted_saturation
from fogsim.values import Camera, Response
from fogsim.values.camera_response import respond
from fogsim.vision.light.luminance import linear_luminance

SENSOR = Sensor(saturation_luminance=5000.0, full_well=10_000.0, read_noise=5.0)
AUTO = AutoExposure(Metering.HIGHLIGHTS, 0.65, time_constant=0.5, brightest=1e5, ungained=100.0, darkest=4.0)
CAMERA = Camera(160, 120, 150.0, (80, 60), mount_height=1.4, response=Response.LINEAR)


def grey(luminance: float, size: int = 200) -> np.ndarray:
    return np.full((size, size, 3), luminance, dtype=np.float32)


def picture(luminance: float) -> np.ndarray:
    return np.full((120, 160, 3), luminance, dtype=np.float32)


def test_a_linear_camera_is_proportional_and_saturates() -> None:
    rng = np.random.default_rng(0)
    means = [expose(grey(v), SENSOR, Response.LINEAR, rng).mean() for v in (500.0, 1000.0, 2000.0)]
    assert means == pytest.approx([25.5, 51.0, 102.0], abs=0.1)
    assert expose(grey(1e6), SENSOR, Response.LINEAR, rng).min() == 255
    assert expose(grey(0.0), SENSOR, Response.LINEAR, rng).max() <= 1


def test_noise_is_uncorrelated_between_neighbours_channels_and_frames() -> None:
    rng = np.random.default_rng(2)
    a, b = (expose(grey(2500.0), SENSOR, Response.LINEAR, rng).astype(float) - 127.5 for _ in range(2))
    pairs = [(a[:, 1:, 0], a[:, :-1, 0]), (a[1:, :, 0], a[:-1, :, 0]), (a[..., 0], a[..., 1]), (a[..., 0], b[..., 0])]
    for one, other in pairs:
        assert abs(np.corrcoef(one.ravel(), other.ravel())[0, 1]) < 0.02  # 4 standard deviations of 200² samples


def test_noise_is_normal() -> None:
    """Moments of 480 000 samples and the shares beyond 1, 2 and 3 standard deviations."""
    sensor = Sensor(5000.0, full_well=1_000.0, read_noise=0.0, bits=12)
    values = expose(grey(2500.0, 400), sensor, Response.LINEAR, np.random.default_rng(5)).astype(float).ravel()
    normal = (values - 2047.5) / (4095.0 * (0.5 / 1_000.0) ** 0.5)
    assert normal.mean() == pytest.approx(0.0, abs=0.006)
    assert (normal**3).mean() == pytest.approx(0.0, abs=0.015)
    assert (normal**4).mean() == pytest.approx(3.0, abs=0.04)
    beyond = [float((np.abs(normal) > k).mean()) for k in (1, 2, 3)]
    assert beyond[:2] == pytest.approx([0.3173, 0.0455], rel=0.03)
    assert beyond[2] == pytest.approx(0.0027, rel=0.12)


def test_noise_of_one_frame_is_not_that_of_another_shifted() -> None:
    rng = np.random.default_rng(6)
    sensor = Sensor(5000.0, full_well=1_000.0, bits=12)
    frames = [expose(grey(2500.0, 64), sensor, Response.LINEAR, rng).astype(float).ravel() - 2047.5 for _ in range(12)]
    spectra = [np.fft.rfft(f / f.std(), 2 * f.size) for f in frames]
    for i in range(1, len(frames)):
        correlation = np.fft.irfft(spectra[0] * spectra[i].conj()) / frames[0].size
        assert np.abs(correlation).max() < 0.06  # 6 standard deviations of 12 288 samples


@pytest.mark.parametrize(("bits", "dtype"), [(8, np.uint8), (10, np.uint16), (12, np.uint16)])
def test_bit_depths_span_their_range(bits: int, dtype: type) -> None:
    silent = Sensor(5000.0, full_well=1e12, read_noise=0.0, bits=bits)
    for response in Response:
        ramp = np.repeat(np.linspace(0, 5000, 9000, dtype=np.float32)[None, :, None], 3, axis=2)
        image = expose(ramp, silent, response, np.random.default_rng(0))
        assert image.dtype == dtype
        assert np.all(np.diff(response_table(response).astype(int)) >= 0)
        assert (image[0, 0, 0], image[0, -1, 0]) == (0, 2**bits - 1)
        exact = (2**bits - 1) * respond(ramp[0, :, 0].astype(float) / 5000, response)
        # Half a level of rounding, and what the steps of the table add where the curve is steep.
        smooth = ramp[0, :, 0] > 50
        assert np.abs(image[0, smooth, 0] - exact[smooth]).max() < 0.75


def test_what_is_not_a_number_is_black_and_endless_light_is_white() -> None:
    odd = np.zeros((3, 40, 3), np.float32)
    odd[0], odd[1], odd[2] = np.nan, np.inf, -np.inf
    image = expose(odd, SENSOR, Response.LINEAR, np.random.default_rng(0))
    assert (image[0].max(), image[1].min(), image[2].max()) == (0, 255, 0)
    light = np.random.default_rng(0).uniform(0, 5000, (40, 60, 3)).astype(np.float32)
    one, again, other = (
        expose(v, SENSOR, Response.SRGB, np.random.default_rng(3)) for v in (light, light, np.asfortranarray(light))
    )
    assert np.array_equal(one, again)
    assert np.array_equal(one, other)


@pytest.mark.parametrize("response", [Response.LINEAR, Response.SRGB])
def test_faint_luminances_stay_apart_above_a_black_level(response: Response) -> None:
    """Without one, noise that is cut off at black adds as much as 0.02 cd/m² does."""
    dark = Sensor(saturation_luminance=5.0, full_well=1000.0, read_noise=5.0)

    def read(luminance: float, sensor: Sensor) -> float:
        image = expose(grey(luminance, 400), sensor, response, np.random.default_rng(3))
        return 5.0 / 255.0 * float(linear_luminance(image, response, 8, sensor.black_level).mean(dtype=np.float64))

    assert read(0.0, dark) > 0.008
    above = replace(dark, black_level=0.05)
    assert [read(light, above) for light in (0.0, 0.01, 0.02)] == pytest.approx([0.0, 0.01, 0.02], abs=0.003)
    assert read(2.0, above) == pytest.approx(2.0, rel=0.01)
    assert expose(grey(6.0, 4), above, response, np.random.default_rng(0)).min() >= 254


def test_read_noise_falls_with_gain() -> None:
    auto = replace(AUTO, darkest=1.0)
    falling = Sensor(1.0, full_well=10_000.0, read_noise=5.0, gained_read_noise=1.5)
    assert sensor_at(falling, 500.0, auto).read_noise == 5.0
    assert sensor_at(falling, 1.0, auto).read_noise == pytest.approx(1.5, abs=0.01)
    assert sensor_at(SENSOR, 1.0, auto).read_noise == 5.0


def levels(sensor: CameraSensor, *luminances: float) -> list[float]:
    rng = np.random.default_rng(0)
    return [float(sensor.take(picture(v), rng).mean()) for v in luminances]


def test_the_log_average_is_the_geometric_mean_and_highlights_the_sky_without_its_lamps() -> None:
    halves = picture(10.0)[:40, :60]  # so small that every pixel counts
    halves[:, 30:] = 1000.0
    assert metered_luminance(halves, Metering.LOG_AVERAGE) == pytest.approx(100.0, rel=1e-5)
    scene = picture(300.0)
    scene[:50] = 3000.0
    scene[60:62, 70:74] = 1e6
    assert metered_luminance(scene, Metering.HIGHLIGHTS) == pytest.approx(3000.0)
    red = picture(0.0)
    red[..., 0] = 1000.0
    assert metered_luminance(red, Metering.HIGHLIGHTS) == pytest.approx(212.6)


def test_every_size_is_metered_and_exposure_keeps_within_its_limits() -> None:
    for metering in Metering:
        for shape in [(16, 16), (120, 160), (480, 640), (515, 688)]:
            assert metered_luminance(np.full((*shape, 3), 7.0, np.float32), metering) == pytest.approx(7.0, rel=1e-5)
        assert wanted_saturation(metered_luminance(picture(0.0), metering), AUTO) == AUTO.darkest
    assert wanted_saturation(1e9, AUTO) == AUTO.brightest
    assert wanted_saturation(1e-3, AUTO) == AUTO.darkest


def test_exposure_follows_a_change_of_light_in_its_logarithm() -> None:
    """After n frames e^(−n Δt / τ) of the change in stops is left; the frame of the change itself comes too early."""
    found = levels(CameraSensor(CAMERA, SENSOR, AUTO, 0.0, 0.1), *[3000.0] * 3, *[1500.0] * 20)
    left = [2.0 ** -math.exp(-0.1 * n / 0.5) for n in range(20)]
    assert found[3:] == pytest.approx([0.65 * 255 * share for share in left], abs=0.3)
    # Sudden light saturates until the exposure has followed.
    found = levels(CameraSensor(CAMERA, SENSOR, AUTO, 0.0, 0.1), 300.0, *[3000.0] * 40)
    assert found[1] == 255
    assert found[-1] == pytest.approx(0.65 * 255, abs=0.3)
    sensor = CameraSensor(CAMERA, SENSOR, AUTO, 0.0, 0.1)
    first = levels(sensor, 100.0, 5000.0)
    sensor.reset()
    assert levels(sensor, 100.0, 5000.0) == first
    for luminance in (50.0, 3000.0, 40_000.0):
        found = levels(CameraSensor(CAMERA, SENSOR, AUTO, 0.0, 0.1), luminance, luminance, luminance)
        assert found == pytest.approx([0.65 * 255] * 3, abs=0.3)


def test_no_time_constant_follows_by_the_next_frame_and_a_fixed_exposure_never() -> None:
    at_once = AutoExposure(Metering.HIGHLIGHTS, 0.5, 0.0, 1e5, 100.0, 4.0)
    found = levels(CameraSensor(CAMERA, SENSOR, at_once, 0.0, 0.1), 1000.0, 500.0, 500.0)
    assert found == pytest.approx([127.5, 63.75, 127.5], abs=0.3)
    once = followed(100.0, 900.0, AUTO, 0.2)
    assert followed(followed(100.0, 900.0, AUTO, 0.1), 900.0, AUTO, 0.1) == pytest.approx(once)
    found = levels(CameraSensor(CAMERA, SENSOR, None, 0.0, 0.1), 1000.0, 2000.0, 1000.0)
    assert found == pytest.approx([51.0, 102.0, 51.0], abs=0.3)


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
