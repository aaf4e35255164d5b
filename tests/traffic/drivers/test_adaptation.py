"""Thresholds between night and day: what is known of both ends, and Adrian's equations between them."""

import math

import numpy as np
import pytest

from fogsim.atmosphere.visibility.visibility_level import angular_size, threshold
from fogsim.traffic.drivers.adaptation import (
    DAY_EYE_THRESHOLD,
    HEAD_LAMP_LUMINANCE,
    NIGHT_EYE_THRESHOLD,
    VEHICLE_SIZE,
    adaptation,
    contrast_ratio,
)


def test_lamps_are_noticed_at_known_illuminances_at_both_ends() -> None:
    assert pytest.approx(1e-5, rel=0.05) == NIGHT_EYE_THRESHOLD
    assert adaptation(2500.0).eye_threshold == DAY_EYE_THRESHOLD == adaptation(1e5).eye_threshold
    assert adaptation(1000.0, share=0.95).eye_threshold == DAY_EYE_THRESHOLD > adaptation(1000.0).eye_threshold


def test_contrast_follows_adrians_threshold() -> None:
    """ΔL_th / L over that by day, as `visibility_level.threshold` has it, within the jump of its branches."""
    for illuminance in [0.1, 3.0, 30.0, 300.0]:
        for distance in [10.0, 100.0]:
            luminance, day = adaptation(illuminance).luminance, 0.406 * 1000.0 / math.pi
            size = 2.0 * math.tan(0.5 * VEHICLE_SIZE / distance)  # the small angle, as an angle's own size
            small, large = (threshold(x, angular_size(size, 1.0), exposure_time=2.0) / x for x in (luminance, day))
            assert contrast_ratio(adaptation(illuminance), distance) == pytest.approx(float(small / large), rel=0.02)


@pytest.mark.parametrize("distance", [0.0, 50.0, 1e5])
def test_thresholds_rise_into_the_night_and_are_those_of_the_day_from_1000_lx_on(distance: float) -> None:
    light = np.geomspace(1e-3, 1e5, 200)
    ratios = np.array([contrast_ratio(adaptation(lux), distance) for lux in light])
    assert np.all(np.diff(ratios) <= 0.0)
    assert np.all(ratios[light >= 1000.0] == 1.0)
    lamps = np.array([adaptation(lux).eye_threshold for lux in light])
    assert np.all(np.diff(lamps) >= 0.0)
    join = (0.6 - HEAD_LAMP_LUMINANCE) * math.pi / 0.406  # of Adrian's branches
    below, above = (adaptation(join * share).eye_threshold for share in (0.9999, 1.0001))
    assert above / below == pytest.approx(1.0, abs=1e-3)
