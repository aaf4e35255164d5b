import numpy as np
import pytest

from fogsim.camera import Sensor, expose
from fogsim.camera.exposure import response_table
from fogsim.response import exposure_of, respond
from fogsim.values import Response

SENSOR = Sensor(saturation_luminance=5000.0, full_well=10_000.0, read_noise=5.0)


def grey(luminance: float, size: int = 200) -> np.ndarray:
    return np.full((size, size, 3), luminance, dtype=np.float32)


def test_srgb_check_values() -> None:
    """IEC 61966-2-1: 0.18 → 0.461356, 0.5 → 0.735357."""
    assert respond(np.array([0.18, 0.5]), Response.SRGB) == pytest.approx([0.461356, 0.735357], abs=1e-6)


@pytest.mark.parametrize("response", list(Response))
def test_the_exposure_behind_a_signal(response: Response) -> None:
    exposure = np.linspace(0.0, 1.0, 101)
    assert exposure_of(respond(exposure, response), response) == pytest.approx(exposure, abs=1e-6)


@pytest.mark.parametrize("response", list(Response))
def test_responses_rise_from_black_to_white(response: Response) -> None:
    table = response_table(response).astype(int)
    assert (table[0], table[-1]) == (0, 255)
    assert np.all(np.diff(table) >= 0)


def test_a_linear_camera_is_proportional() -> None:
    rng = np.random.default_rng(0)
    means = [expose(grey(v), SENSOR, Response.LINEAR, rng).mean() for v in (500.0, 1000.0, 2000.0)]
    assert means == pytest.approx([25.5, 51.0, 102.0], abs=0.1)


def test_noise_has_photon_and_read_variance() -> None:
    """σ² = electrons + σ_read², in units of the full well (EMVA 1288), plus 1/12 for quantisation."""
    image = expose(grey(2500.0, 400), SENSOR, Response.LINEAR, np.random.default_rng(1))
    expected = 255.0**2 * (0.5 / 10_000.0 + (5.0 / 10_000.0) ** 2) + 1 / 12
    assert image.astype(float).var() == pytest.approx(expected, rel=0.03)


def test_noise_is_uncorrelated_between_neighbours_channels_and_frames() -> None:
    rng = np.random.default_rng(2)
    a, b = (expose(grey(2500.0), SENSOR, Response.LINEAR, rng).astype(float) - 127.5 for _ in range(2))
    pairs = [
        (a[:, 1:, 0], a[:, :-1, 0]),
        (a[1:, :, 0], a[:-1, :, 0]),
        (a[..., 0], a[..., 1]),
        (a[..., 0], b[..., 0]),
    ]
    for one, other in pairs:
        assert abs(np.corrcoef(one.ravel(), other.ravel())[0, 1]) < 0.02  # 4 standard deviations of 200² samples


def test_the_same_generator_state_gives_the_same_image() -> None:
    images = [expose(grey(900.0), SENSOR, Response.SRGB, np.random.default_rng(3)) for _ in range(2)]
    assert np.array_equal(*images)


def test_too_bright_saturates_and_black_stays_black() -> None:
    rng = np.random.default_rng(4)
    assert expose(grey(1e6), SENSOR, Response.LINEAR, rng).min() == 255
    assert expose(grey(0.0), SENSOR, Response.LINEAR, rng).max() <= 1
