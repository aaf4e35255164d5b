"""What the uncertainty of a calibration does to intervals."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from fogsim.offline import Calibration, CalibrationDeviations, estimate_images, load_calibration
from fogsim.offline.calibration_deviations import on_any_scale, scale_left
from fogsim.values import Estimate
from fogsim.values.estimate import NORMAL_90_PERCENT, OpticalDepths


def test_an_unknown_scale_is_a_factor_of_an_interval() -> None:
    depths = OpticalDepths((50.0,), (1.0,), (0.1,))
    estimate = Estimate("joint_road", 0.02, 0.001, optical_depths=depths)
    widened = on_any_scale(estimate, 0.5)
    assert (widened.visibility, widened.common_deviation) == (estimate.visibility, 0.5)
    assert widened.optical_depths.standard_deviation == (math.hypot(0.1, 0.5),)
    for end, before in zip(widened.visibility_interval, estimate.visibility_interval, strict=True):
        off = math.hypot(math.log(before / estimate.visibility), 0.5 * NORMAL_90_PERCENT)
        assert abs(math.log(end / estimate.visibility)) == pytest.approx(off)
    # Clear air is clear on any scale, but from another distance on.
    clear = Estimate("joint_road", 0.0, 0.001)
    low, high = on_any_scale(clear, 0.5).visibility_interval
    assert low == pytest.approx(clear.visibility_interval[0] * math.exp(-0.5 * NORMAL_90_PERCENT))
    assert high == math.inf


def test_other_distances_and_refusals_stay() -> None:
    deviations = CalibrationDeviations(focal_length=0.3, mount_height=0.4)
    assert [scale_left(deviations, one) for one in ("sign_contrast", "night_road")] == [0.0, 0.5]
    left, given = scale_left(deviations, "joint_road"), deviations.parameters["scale_deviation"]
    assert math.hypot(left, given) == pytest.approx(0.5)
    refused = Estimate.invalid("joint_road", "the road is hidden")
    assert on_any_scale(refused, 0.5) is refused


def test_a_camera_file_states_deviations_or_has_the_usual_ones(drive, tmp_path: Path) -> None:
    path = tmp_path / "camera.yaml"
    path.write_text(drive.camera_yaml, encoding="utf-8")
    assert load_calibration(path).deviations.scale == pytest.approx(math.hypot(0.03, 0.05))
    stated = "mount_height_sd_m: 0.138\nfocal_length_sd_px: 0\npitch_sd_deg: 0.3\n"
    path.write_text(drive.camera_yaml + stated, encoding="utf-8")
    deviations = load_calibration(path).deviations
    assert deviations.scale == pytest.approx(0.138 / drive.camera.mount_height)
    assert deviations.pitch == pytest.approx(math.radians(0.3))


@pytest.mark.parametrize("factor", [0.87, 1.15])
def test_intervals_of_a_wrong_height_contain_the_truth(drive, factor: float) -> None:
    camera = replace(drive.camera, mount_height=factor * drive.camera.mount_height)
    images, held = sorted((drive.folder / "images").iterdir())[:4], []
    for deviations in (CalibrationDeviations(), CalibrationDeviations(mount_height=0.1)):
        calibration = Calibration(camera, deviations=deviations)
        found = [one.estimates[0] for one in estimate_images(images, calibration, "joint_road", rate=10)]
        intervals = [one.visibility_interval for one in found if one.valid]
        assert intervals
        held.append(sum(low < 120.0 < high for low, high in intervals) / len(intervals))
    assert held[0] < held[1] == 1.0
