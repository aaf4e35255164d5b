"""What the uncertainty of a calibration does to intervals."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from fogsim.offline import Calibration, CalibrationDeviations, estimate_images, load_calibration
from fogsim.values import Estimate
from fogsim.values.estimate import OpticalDepths

DEVIATIONS = CalibrationDeviations(focal_length=0.03, mount_height=0.04)


def test_relative_deviations_add_in_quadrature_to_those_of_methods_on_the_road() -> None:
    depths = OpticalDepths((50.0,), (1.0,), (0.1,))
    estimate = Estimate("night_road", 0.02, 0.001, optical_depths=depths)
    widened = DEVIATIONS.widened(estimate)
    assert widened.extinction == 0.02
    # 5 % of k, next to its own 5 %, which counts a little more on an uncertain scale.
    assert widened.standard_deviation == pytest.approx(0.001 * math.sqrt(2.0), rel=0.002)
    assert widened.optical_depths.standard_deviation == pytest.approx((math.hypot(0.1, 0.05),), rel=0.002)


@pytest.mark.parametrize(
    "estimate", [Estimate("sign_contrast", 0.02, 0.001), Estimate.invalid("joint_road", "the road is hidden")]
)
def test_other_distances_and_refusals_stay(estimate: Estimate) -> None:
    assert DEVIATIONS.widened(estimate) is estimate


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
        found = [one.estimates[0] for one in estimate_images(images, calibration, "joint_road")]
        intervals = [one.visibility_interval for one in found if one.valid]
        assert intervals
        held.append(sum(low < 120.0 < high for low, high in intervals) / len(intervals))
    assert held[0] < held[1] == 1.0
