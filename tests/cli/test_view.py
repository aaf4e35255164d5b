"""``fogsim view``: the picture that the viewer would show first, and what is said where there is no display."""

from pathlib import Path

import numpy as np
import pytest
from early_motorway import EARLY
from PIL import Image

from fogsim.cli.view import view_command
from fogsim.errors import InputError, MissingDependencyError
from fogsim.scenario import load_scenario
from fogsim.simulation.loop import ClosedLoop


def test_the_picture_is_that_of_the_ego_in_clear_air(tmp_path: Path) -> None:
    out = tmp_path / "view.png"
    settings = [EARLY, "camera.width=160", "camera.height=120", "fog.visibility_m=30"]
    view_command("motorway_fog_bank", at=0.2, out=out, settings=settings)
    picture = np.asarray(Image.open(out)).astype(float)
    assert picture.shape == (120, 160, 3)
    # Sky above, asphalt below, grass (more green than red than blue) between them, which fog of 30 m would hide.
    assert np.median(picture[:20]) > 150
    assert np.ptp(picture[-10:, 60:100], axis=2).max() < 10
    assert (picture[50:70, :, 1] > picture[50:70, :, 2] + 15).any()


def test_mistakes_are_told_before_the_display_and_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    with pytest.raises(InputError, match=r"^[^\n]*no display here .*--out FILE\.png[^\n]*$"):
        view_command("motorway_fog_bank")
    with pytest.raises(InputError, match="did you mean 'motorway_fog_bank'"):
        view_command("motorway_fog_bnk")
    out = tmp_path / "view.png"
    out.write_bytes(b"mine")
    with pytest.raises(InputError, match="--overwrite"):
        view_command("motorway_fog_bank", out=out)
    assert out.read_bytes() == b"mine"


def test_missing_opengl_is_reported_before_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def lacking() -> str:
        raise MissingDependencyError("no OpenGL")

    monkeypatch.setattr("fogsim.render.gl_report", lacking)
    monkeypatch.setattr("fogsim.cli.view._surrounding", lambda *_: pytest.fail("the run has begun"))
    with pytest.raises(MissingDependencyError, match="no OpenGL"):
        view_command("motorway_fog_bank", out=tmp_path / "view.png")


def test_an_instant_after_the_end_is_refused(tmp_path: Path) -> None:
    settings = [EARLY, "camera.width=32", "camera.height=24", "duration_s=0.2"]
    with pytest.raises(InputError, match=r"--at 60: the run ends after 0\.2 s \(time\)"):
        view_command("motorway_fog_bank", at=60.0, out=tmp_path / "view.png", settings=settings)


def test_what_is_around_the_ego_is_what_its_camera_sees() -> None:
    scenario = load_scenario("motorway_fog_bank", [EARLY, "renderer=cpu", "camera.width=64", "camera.height=48"])
    with ClosedLoop(scenario) as loop:
        step = loop.start(0)
        around = loop.surrounding()
    assert around.camera == step.truth.camera
    assert around.pose.heading == step.truth.pose.heading
    assert sum(len(batch.instance) for batch in around.vehicles) == len(step.traffic.ids) - 1
    assert 16 + step.ego not in np.concatenate([batch.instance for batch in around.vehicles])
    assert around.illuminance == scenario.light.illuminance_lx
    assert not around.lights.own
