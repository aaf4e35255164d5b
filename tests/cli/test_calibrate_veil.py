"""``fogsim calibrate veil``."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from fogsim.cli.app import app
from fogsim.errors import InputError
from fogsim.estimators.night.reference_file import read_references
from fogsim.offline.lamp_file import load_lamps
from fogsim.values import Lamp

CAMERA = """
width: 80
height: 60
focal_length_px: 72
principal_point_px: [40, 30]
mount_height_m: 1.4
pitch_deg: 2
response: srgb
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "camera.yaml").write_text(CAMERA, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def calibrate(*arguments: str) -> tuple[int, str]:
    done = CliRunner().invoke(app, ["calibrate", "veil", "--camera", "camera.yaml", *arguments])
    return done.exit_code, " ".join((done.output + str(done.exception or "")).split())


def test_references_are_written_for_each_set_of_lamps(folder: Path) -> None:
    (folder / "lamps.yaml").write_text("height_m: 0.8\nlow_beam: mine.csv\n", encoding="utf-8")
    (folder / "mine.csv").write_text(",-10,10\n-10,100,100\n0,9000,9000\n5,10,10\n", encoding="utf-8")
    code, told = calibrate("--lamps", "lamps.yaml", "--lit", "low_beam", "--published", "--out", "veil.npz")
    assert code == 0
    assert "5 visibilities from 15 to 500 m and a clear night, for 1 sets of lamps" in told
    read = read_references(folder / "veil.npz")
    assert {one.lamps for one in read} == {Lamp.LOW_BEAM}
    assert all(one.veil[0].max() > one.veil[-1].max() == 0.0 for one in read)
    code, told = calibrate("--out", "veil.npz")
    assert "replace it with --overwrite" in told
    assert code != 0


def test_mistakes_are_told(folder: Path) -> None:
    for arguments, why in (
        (("--lit", "low_bean"), "unknown head lamp 'low_bean'; did you mean 'low_beam'?"),
        (("--out", "none/veil.npz"), "there is no folder none"),
        (("--lamps", "none.yaml"), "none.yaml"),
    ):
        code, told = calibrate(*arguments)
        assert code != 0
        assert why in told
    (folder / "lamps.yaml").write_text("heigth_m: 0.8\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"lamps.yaml:1: heigth_m: unknown key; did you mean 'height_m'"):
        load_lamps(folder / "lamps.yaml")
    (folder / "lamps.yaml").write_text("low_beam: none.csv\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"none.csv: cannot be read: No such file"):
        load_lamps(folder / "lamps.yaml")
