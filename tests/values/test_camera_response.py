"""Response curves: published values, their inverses, and eight bits of more."""

import numpy as np
import pytest

from fogsim.values import Response
from fogsim.values.camera_response import eight_bit, exposure_of, respond


def test_srgb_check_values() -> None:
    """IEC 61966-2-1: 0.18 → 0.461356, 0.5 → 0.735357."""
    assert respond(np.array([0.18, 0.5]), Response.SRGB) == pytest.approx([0.461356, 0.735357], abs=1e-6)


@pytest.mark.parametrize("response", list(Response))
def test_the_exposure_behind_a_signal(response: Response) -> None:
    assert respond(np.array([0.0, 1.0]), response) == pytest.approx([0.0, 1.0], abs=1e-12)
    assert respond(np.zeros(1), response, 0.05) == pytest.approx(respond(np.array([0.05]), response))
    for black_level, darkest in ((0.0, 0.0), (0.05, -0.02)):  # noise about the dark is below it
        exposure = np.linspace(darkest, 1.0, 103)
        signal = respond(exposure, response, black_level)
        assert exposure_of(signal, response, black_level) == pytest.approx(exposure, abs=1e-6)


def test_eight_bits_are_the_highest_ones() -> None:
    assert eight_bit(np.array([0, 15, 16, 4095], np.uint16), 12).tolist() == [0, 0, 1, 255]
    shown = np.array([0, 255], np.uint8)
    assert eight_bit(shown, 8) is shown
