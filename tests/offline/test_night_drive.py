"""A person's own drive by night."""

from pathlib import Path

import pytest
from PIL import Image
from typer.testing import CliRunner

from fogsim.cli.app import app
from fogsim.cli.images.estimate import _night_drive
from fogsim.errors import InputError
from fogsim.offline import NightDrive, estimate_images
from fogsim.values import Lamp
from tests.estimators.night.pictures import CAMERA, SETBACK, night_picture
from tests.helpers.camera_files import camera_yaml

FILE = camera_yaml((160, 120), 144, None, 1.38, 2.0053522829578814)


@pytest.fixture
def drive(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for number in range(2):
        Image.fromarray(night_picture(60.0, seed=number)).save(tmp_path / f"{number}.png")
    (tmp_path / "camera.yaml").write_text(FILE, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_drive_by_night_is_read_by_the_own_lamps_that_are_told(drive: Path) -> None:
    told = NightDrive(Lamp.LOW_BEAM, SETBACK)
    for result in estimate_images([drive / "0.png", drive / "1.png"], CAMERA, "night_road", rate=10, night=told):
        assert result.estimates[0].visibility == pytest.approx(60.0, rel=0.2)
    dark = estimate_images(drive / "0.png", CAMERA, "night_road", night=NightDrive(Lamp.NONE))
    assert "no head lamp" in str(next(dark).estimates[0].diagnostics["reason"])
    with pytest.raises(InputError, match="fogsim calibrate halos"):
        list(estimate_images(drive / "0.png", CAMERA, "gallen2014", night=NightDrive(halos=Path("none.json"))))


def test_a_lens_at_the_bumper_is_no_unknown_one() -> None:
    assert 0.0 < _night_drive(True, None, 0.0, None, None).setback < 0.01
    assert _night_drive(True, None, None, None, None).setback == 0.0


@pytest.mark.usefixtures("drive")
def test_by_the_command_line() -> None:
    def run(*arguments: str) -> tuple[int, str]:
        done = CliRunner().invoke(app, ["estimate", "0.png", "1.png", "--camera", "camera.yaml", *arguments])
        return done.exit_code, " ".join((done.output + str(done.exception or "")).split())

    code, told = run("--night", "--setback", f"{SETBACK}", "--method", "night_road")
    assert code == 0
    assert "night_road" in told
    assert "dense" in told
    for arguments, why in (
        (("--lamps", "low_beam"), "--lamps goes with --night"),
        (("--night", "--lamps", "low_bean"), "did you mean 'low_beam'?"),
        (("--night", "--head-lamps", "none.yaml"), "--head-lamps none.yaml: there is no such file"),
    ):
        code, told = run(*arguments)
        assert code != 0
        assert why in told
