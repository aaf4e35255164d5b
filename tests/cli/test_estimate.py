"""``fogsim estimate``: what it prints, what it refuses, and with which exit code."""

import csv
import functools
import itertools
import json
import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from early_motorway import EARLY
from PIL import Image

import fogsim
from fogsim import offline
from fogsim.offline import FrameEstimates, estimates_of
from tests.helpers.camera_files import camera_yaml
from tests.helpers.command import Command

HEIGHT, WIDTH = 240, 320
CAMERA_YAML = camera_yaml((WIDTH, HEIGHT), 288.45, (160, 120), 1.38, 2)
KEYS = {"frame", "method", "valid", "visibility_m", "visibility_low_m", "visibility_high_m"} | {
    "extinction_per_m",
    "category",
    "horizon_row",
    "reason",
    "time_s",
}


@pytest.fixture(scope="module")
def drawn() -> list[np.ndarray]:
    """Three frames in fog of 80 m."""
    settings = [EARLY, "fog.visibility_m=80", "duration_s=0.2", "camera.width=320", "camera.height=240"]
    scenario = fogsim.load_scenario("motorway_fog_bank", settings)
    return [step.observation.image for step in fogsim.run(scenario, seed=4)]


@pytest.fixture
def folder(drawn, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "drive").mkdir()
    for index, image in enumerate(drawn):
        Image.fromarray(image).save(tmp_path / "drive" / f"{index}.png")
    (tmp_path / "camera.yaml").write_text(CAMERA_YAML, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("NO_COLOR", "1")
    return tmp_path


@pytest.fixture
def estimate(folder: Path, command: Command) -> Command:
    """Run the command in this process, in the folder."""
    return functools.partial(command, "estimate")


def test_json_is_all_there_is_on_stdout_and_the_same_each_time(estimate, folder: Path) -> None:
    """Also where the response is not given, which is assumed to be sRGB: linear, 80 m would be less than 70 m."""
    (folder / "short.yaml").write_text(CAMERA_YAML.replace("response: srgb\n", ""), encoding="utf-8")
    code, out, err = estimate("drive", "--camera", "camera.yaml", "--json", "--method", "joint_road")
    assumed = estimate("drive", "--camera", "short.yaml", "--json", "--method", "joint_road")
    assert assumed[:2] == (code, out)
    assert "assumed" not in err
    assert "short.yaml: response is not given: srgb is assumed, as images of 8 bits" in assumed[2]
    records = [json.loads(line) for line in out.splitlines()]
    assert [record["frame"] for record in records] == ["drive/0.png", "drive/1.png", "drive/2.png"]
    for record in records:
        assert set(record) == KEYS | ({"denser_fog_m", "reach_m", "optical_depths"} if record["valid"] else set())
    valid = [record for record in records if record["valid"] is True]
    assert valid
    for record in valid:
        assert record["visibility_m"] == pytest.approx(80.0, rel=0.1)
        assert record["visibility_low_m"] < record["visibility_m"] < record["visibility_high_m"]
        assert record["category"] == "dense"
    # The road's lines, which noise moves in each frame, have a say of a fraction of a pixel in where the horizon is.
    horizon_row = np.median([record["horizon_row"] for record in valid])
    assert horizon_row == pytest.approx(stated_horizon(2.0), abs=0.25)


def stated_horizon(pitch_deg: float) -> float:
    """Row of the horizon by the calibration, for a pitch [px]."""
    return 120 - 288.45 * float(np.tan(np.radians(pitch_deg)))


def test_the_told_pitch_is_what_places_the_horizon(estimate, folder: Path) -> None:
    """A wrong one takes the horizon most of the way along: the lines alone would leave it where it was."""
    (folder / "higher.yaml").write_text(CAMERA_YAML.replace("pitch_deg: 2", "pitch_deg: 1"), encoding="utf-8")
    _, out, _ = estimate("drive", "--camera", "higher.yaml", "--method", "negru2013", "--json")
    rows = [record["horizon_row"] for line in out.splitlines() if (record := json.loads(line))["valid"]]
    assert rows
    assert min(rows) > 0.5 * (stated_horizon(1.0) + stated_horizon(2.0))


def test_stills_have_a_table_with_a_row_each(estimate) -> None:
    code, out, _ = estimate("drive", "--camera", "camera.yaml", "--method", "negru2013", "--stills")
    assert code == 0
    lines = out.splitlines()
    assert lines[0].split()[:3] == ["frame", "method", "visibility"]
    assert [line.split()[0] for line in lines[1:]] == ["drive/0.png", "drive/1.png", "drive/2.png"]
    assert all("dense" in line or "no estimate" in line for line in lines[1:])


def test_a_sequence_is_summed_up(estimate) -> None:
    code, out, _ = estimate("drive", "--camera", "camera.yaml", "--plot", "v.svg")
    assert code == 0
    lines = out.splitlines()
    assert lines[0] == "joint_road"
    assert re.search(r"at the end +\d+ m \(90 %: \d+ – \d+ m\), fog: dense", lines[1])
    assert re.search(r"valid +3 of 3 frames", lines[-1])
    assert "joint_road" in Path("v.svg").read_text(encoding="utf-8")


def test_what_is_assumed_of_images_or_left_out_is_printed(estimate, folder: Path) -> None:
    (folder / "drive" / "3.heic").touch()
    for command, *options in (["estimate"], ["restore", "--out", "clear"]):
        err = estimate.func(command, "drive", "--camera", "camera.yaml", *options).stderr
        assert "warning: 3 images are taken as one drive, 10 a second, since no EXIF times say otherwise: --rate" in err
        assert "warning: drive: left out, since only .png, " in err


@pytest.mark.parametrize("as_json", [False, True])
def test_what_was_done_before_ctrl_c_is_summed_up(estimate, monkeypatch: pytest.MonkeyPatch, as_json: bool) -> None:
    def interrupted(*given: object) -> Iterator[FrameEstimates]:
        yield from itertools.islice(estimates_of(*given), 2)
        raise KeyboardInterrupt

    monkeypatch.setattr(offline, "estimates_of", interrupted)
    options = ["--json"] if as_json else []
    code, out, err = estimate("drive", "--camera", "camera.yaml", "--overlay", "o.mp4", "--plot", "v.svg", *options)
    assert code == 130
    assert "interrupted after 2 of 3 images; no plot and no overlay is written" in err
    lines = out.splitlines()
    assert len(lines) == 2 if as_json else re.search(r"valid +2 of 2 frames", lines[-1])
    assert not {"o.mp4", "v.svg"} & {path.name for path in Path().iterdir()}


def test_csv_has_a_heading_and_a_row_for_each_image(estimate) -> None:
    code, out, _ = estimate("drive", "--camera", "camera.yaml", "--csv")
    assert code == 0
    rows = list(csv.DictReader(out.splitlines()))
    assert [row["frame"] for row in rows] == ["drive/0.png", "drive/1.png", "drive/2.png"]
    assert [float(row["time_s"]) for row in rows] == pytest.approx([0.0, 0.1, 0.2])
    assert all(float(row["visibility_m"]) == pytest.approx(80.0, rel=0.15) for row in rows)


def test_an_unknown_camera_is_guessed_and_its_uncertainty_is_in_the_interval(estimate) -> None:
    code, out, err = estimate("drive", "--json")
    assert code == 0
    assert "guessed: focal length" in err
    for record in map(json.loads, out.splitlines()):
        assert record["visibility_low_m"] < 80.0 < record["visibility_high_m"]
        # The field of view alone is uncertain by a quarter.
        assert record["visibility_high_m"] > 1.5 * record["visibility_low_m"]


def test_an_overlay_is_written(estimate, folder: Path) -> None:
    drive = ("drive", "--camera", "camera.yaml", "--overlay", "o.mp4")
    code, out, err = estimate(*drive, "--method", "negru2013", "--json")
    assert code == 0
    assert len(out.splitlines()) == 3
    assert "overlay: o.mp4" in err
    assert sorted(path.name for path in folder.iterdir()) == ["camera.yaml", "drive", "o.mp4"]
    again, out, err = estimate(*drive)
    assert (again, out) == (2, "")
    assert "--overwrite" in err


def test_a_guessed_camera_is_written_and_good_to_use(estimate, folder: Path) -> None:
    guess = ("drive", "--camera", "guess.yaml", "--guess-camera", "--mount-height", "1.38", "--field-of-view", "58.04")
    code, out, err = estimate(*guess)
    assert code == 0, err
    assert "mount_height_m: 1.38  # as stated" in out
    assert estimate(*guess)[0] == 2
    assert estimate(*guess, "--overwrite")[0] == 0
    code, out, _ = estimate("drive", "--camera", "guess.yaml", "--method", "joint_road", "--json")
    assert code == 0
    found = [record["visibility_m"] for line in out.splitlines() if (record := json.loads(line))["valid"]]
    assert found
    assert found == pytest.approx([80.0] * len(found), rel=0.15)


NOT_FOR_A_GUESS = (("--json",), ("--method", "all"), ("--overlay", "o.mp4"), ("--night",), ("--setback", "0"))


def test_mistakes_end_with_exit_code_2(estimate, folder: Path) -> None:
    (folder / "typo.yaml").write_text(CAMERA_YAML.replace("width", "widht"), encoding="utf-8")
    (folder / "aside.yaml").write_text(CAMERA_YAML + "yaw_deg: 55\n", encoding="utf-8")
    before = {path.name for path in folder.iterdir()}
    guess = ("drive", "--camera", "new.yaml", "--guess-camera", "--mount-height", "1.4")
    for arguments, message in [
        (("none.png", "--camera", "camera.yaml"), "none.png: there is no such file"),
        (("drive", "--camera", "none.yaml"), "none.yaml: cannot be read"),
        (("drive", "--camera", "typo.yaml"), "typo.yaml:1: widht: unknown key; did you mean 'width'"),
        (("camera.yaml", "--camera", "camera.yaml"), "the only image cannot be read"),
        (("drive", "--camera", "camera.yaml", "--mount-height", "1.4"), "--mount-height is for a guess"),
        (("drive", "--guess-camera"), "--camera camera.yaml"),
        *(((*guess, *option), f"{option[0]} does not go with --guess-camera") for option in NOT_FOR_A_GUESS),
        (("drive", "--camera", "camera.yaml", "--track-offset", "3"), "--track-offset goes with --track"),
        (("drive", "--camera", "camera.yaml", "--json", "--csv"), "give one of them"),
        (("drive/0.png", "--camera", "camera.yaml", "--rate", "5"), "--rate is for a sequence or an overlay; these"),
        (("drive", "--camera", "camera.yaml", "--stills", "--plot", "v.png"), "--plot draws over time"),
        (("drive", "--camera", "camera.yaml", "--plot", "v.bmp"), "--plot must end in .png, .svg or .pdf"),
        (("drive", "--camera", "camera.yaml", "--guess-camera", "--mount-height", "1.4"), "already exists"),
        (("drive", "--camera", "aside.yaml"), "aside.yaml:8: yaw_deg must lie within -29.0 … 28.9"),
        ((*guess, "--horizon-row", "99999"), "--horizon-row must be a row of the images, 0 … 239, got 99999.0"),
    ]:
        code, _, err = estimate(*arguments)
        assert code == 2
        assert message in err
        assert {path.name for path in folder.iterdir()} == before


def test_a_video_without_frames_is_refused(estimate, folder: Path) -> None:
    from fogsim.recorders.video import Encoder, encoder_command

    encoder = Encoder(encoder_command(folder / "whole.mp4", 0.1, (WIDTH, HEIGHT)))
    encoder.write(bytes(3 * WIDTH * HEIGHT))
    encoder.finish()
    whole = (folder / "whole.mp4").read_bytes()
    # The index is at the file's beginning, so a header without pictures is left.
    (folder / "none.mp4").write_bytes(whole[: whole.index(b"mdat") + 4])
    code, out, err = estimate("none.mp4", "--camera", "camera.yaml", "--method", "negru2013", "--json")
    assert (code, out) == (2, "")
    assert "no frames" in err


@pytest.mark.skipif(sys.platform == "win32", reason="such names are none there")
@pytest.mark.parametrize("name", [b"2026-11-22T01:14:00", b"-x", b"caf\xe9", b"a\x1b[31m\nb", b"[red]"], ids=str)
def test_odd_names_of_images_and_outputs_work_and_are_printed_escaped(estimate, folder: Path, name: bytes) -> None:
    image, overlay = os.fsdecode(b"drive/" + name + b".png"), os.fsdecode(name + b".mp4")
    (folder / "drive" / "1.png").rename(image)
    code, out, err = estimate(image, "--camera", "camera.yaml", "--method", "negru2013", "--overlay", overlay)
    assert code == 0, err
    assert len(out.splitlines()) == 2
    assert (out + err).replace("\n", "").isprintable()
    assert {path.name for path in folder.iterdir()} == {"camera.yaml", "drive", overlay}


def test_signs_of_an_own_map_are_looked_for_and_what_became_of_them_is_told(estimate, folder: Path) -> None:
    place = {"type": "Point", "coordinates": [25.0, 60.0005]}
    features = [{"type": "Feature", "id": "s", "geometry": place, "properties": {"kind": "stop", "diameter_m": 2.0}}]
    (folder / "map.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    rows = [f"{0.1 * index},{60.0 + 1e-5 * index},25.0,0" for index in range(3)]
    (folder / "track.csv").write_text("\n".join(["time_s,latitude,longitude,heading_deg", *rows]))
    drive = ("drive", "--camera", "camera.yaml", "--method", "zhu2015")
    code, out, err = estimate(*drive, "--signs", "map.geojson", "--track", "track.csv")
    assert code == 0
    assert out.splitlines()[-1].split()[:4] == ["s", "stop", "not", "seen"]
    assert "assumed: map.geojson: 1 sign with no height_m" in err
    assert "none of the 1 signs that images should show was found" in err
    code, out, err = estimate(*drive, "--json", "--signs", "map.geojson", "--track", "track.csv")
    signs = [record["signs"] for line in out.splitlines() if "signs" in (record := json.loads(line))]
    assert [one[0]["detected"] for one in signs] == [False] * 3
    for option, message in (("--signs", "--signs needs --track"), ("--track", "--track goes with --signs")):
        code, _, err = estimate(*drive, option, "track.csv")
        assert code == 2
        assert message in err
