"""The threshold of halos, measured by command on staged scenes by night."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from fogsim.calibration.halo_calibration import measure_halo_threshold, parting
from fogsim.cli.app import app
from fogsim.errors import InputError
from fogsim.estimators.night.halos import HaloThreshold
from fogsim.values import Camera, Response
from tests.helpers.camera_files import camera_yaml

CAMERA = Camera(240, 160, 220.0, (119.5, 79.5), 1.4, pitch=0.02, response=Response.SRGB)


def test_the_command_measures_and_writes(tmp_path: Path) -> None:
    file, out = tmp_path / "camera.yaml", tmp_path / "halos.json"
    file.write_text(camera_yaml((240, 160), 220, None, 1.4, 1.0), encoding="utf-8")
    command = ["calibrate", "halos", "--camera", str(file), "--out", str(out), "--scenes", "5"]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 0, result.output
    measured = HaloThreshold.read(out)
    measured.checked_for(CAMERA)
    assert 3.0 < measured.steepness < 100.0
    assert max(measured.mean_errors, measured.largest_errors) < 0.35
    assert json.loads(out.read_text(encoding="utf-8"))["pictures"] >= 8
    again = CliRunner().invoke(app, command)
    assert again.exit_code != 0


def test_too_few_scenes_are_refused() -> None:
    with pytest.raises(InputError, match="scenes: expected at least 4, got 2"):
        measure_halo_threshold(CAMERA, 2)


def test_the_threshold_errs_as_seldom_either_way() -> None:
    threshold, wrong, missed = parting((10.0, 40.0, 50.0, 60.0), (1.0, 2.0, 3.0, 45.0))
    assert 10.0 < threshold <= 40.0
    assert (wrong, missed) == (0.25, 0.25)
    threshold, wrong, missed = parting((20.0, 30.0), (1.0, 2.0))
    assert 2.0 < threshold <= 20.0
    assert (wrong, missed) == (0.0, 0.0)
