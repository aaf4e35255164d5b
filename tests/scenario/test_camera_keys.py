"""Camera keys of scenario files and what is built from them."""

import math

import pytest

from fogsim.camera import AutoExposure, Metering
from fogsim.errors import InputError
from fogsim.scenario import Scenario, build, load_scenario


def scenario(*overrides: str) -> Scenario:
    return load_scenario("motorway_fog_bank", overrides)


def test_exposure_is_automatic_unless_it_is_fixed() -> None:
    for overrides, automatic in [
        ([], True),
        (["camera.saturation_luminance_cdpm2=5000"], False),
        (["camera.exposure.mode=fixed"], False),
        (["camera.exposure.mode=fixed", "camera.saturation_luminance_cdpm2=5000"], False),
        (["camera.exposure.mode=auto"], True),
    ]:
        assert scenario(*overrides).camera.automatic is automatic


def test_a_fixed_exposure_needs_light_or_a_luminance() -> None:
    dark = ["camera.exposure.mode=fixed", "light.illuminance_lx=0"]
    with pytest.raises(InputError, match=r"camera\.saturation_luminance_cdpm2 is missing"):
        scenario(*dark)
    assert not scenario(*dark, "camera.saturation_luminance_cdpm2=5").camera.automatic


def test_a_fixed_exposure_puts_the_airlight_at_60_percent() -> None:
    """Airlight of 10 000 lx: 0.406 · 10 000 / π · 1.02 in the brightest channel."""
    fixed = ("camera.saturation_luminance_cdpm2=4000",)
    for overrides, white in [((), 0.406 * 1e4 / math.pi * 1.02 / 0.6), (fixed, 4000.0)]:
        assert build.camera_config(scenario(*overrides)).sensor.saturation_luminance == pytest.approx(white)


def exposure(*overrides: str) -> AutoExposure:
    return build.camera_config(scenario(*overrides)).exposure


def test_what_is_metered_has_a_target_of_its_own() -> None:
    assert exposure().target == 0.65
    average = exposure("camera.exposure.metering=log_average")
    assert (average.metering, average.target) == (Metering.LOG_AVERAGE, 0.18)
    assert exposure("camera.exposure.target_percent=40").target == 0.4


def test_told_errors_are_in_the_told_calibration_alone() -> None:
    errors = "pitch_error_deg: 1, roll_error_deg: -2, focal_length_error_percent: 10, mount_height_error_percent: -20"
    wrong = scenario("camera.bits=12", "camera.roll_deg=1", f"camera.told={{{errors}}}")
    true, told = build.camera_config(wrong).on(), build.camera_config(wrong).assumed_on()
    assert math.degrees(told.pitch - true.pitch) == pytest.approx(1.0)
    assert math.degrees(told.roll) == pytest.approx(-1.0)
    assert told.focal_length == pytest.approx(1.1 * true.focal_length)
    assert told.mount_height == pytest.approx(0.8 * true.mount_height)
    assert (true.bits, told.bits, build.camera_config(wrong).sensor.bits) == (12, 12, 12)


def test_mistakes_are_named() -> None:
    auto = "camera.exposure.mode=auto"
    for overrides, message in [
        (["camera.bits=9"], r"camera\.bits: .*8, 10 or 12; got 9"),
        (["camera.samples=3", "camera.width=8000"], r"camera: .*at most 16384, got 8000 × 480 px with 3 samples"),
        (["camera.exposure.mode=manual"], r"camera\.exposure\.mode: .*'auto' or 'fixed'; got 'manual'"),
        (["camera.exposure.darkest_cdpm2=500"], r"camera\.exposure: .*must not decrease .*got 500, 100 and 100000"),
        ([auto, "camera.saturation_luminance_cdpm2=5000"], r"camera: saturation_luminance_cdpm2 .*mode is auto"),
    ]:
        with pytest.raises(InputError, match=message):
            scenario(*overrides)
