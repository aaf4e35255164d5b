"""``fogsim fog``."""

from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import cv2
import numpy as np
import pytest

from tests.helpers.camera_files import camera_yaml

Fog = Callable[..., "CompletedProcess[str]"]

CAMERA_YAML = camera_yaml((40, 30), 60, (20, 15), 1.4, 2, "linear")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "camera.yaml").write_text(CAMERA_YAML, encoding="utf-8")
    cv2.imwrite(str(tmp_path / "image.png"), np.zeros((30, 40, 3), np.uint8))
    np.save(tmp_path / "depth.npy", np.full((30, 40), 80.0, np.float32))
    return tmp_path


@pytest.fixture
def fog(command: Callable[..., "CompletedProcess[str]"]) -> Fog:
    def run(folder: Path, *arguments: str) -> "CompletedProcess[str]":
        given = ["image.png", "--depth", "depth.npy", "--camera", "camera.yaml", "--out", "out.png", *arguments]
        return command("fog", *given, cwd=folder)

    return run


def test_a_black_image_at_the_visibility_has_95_percent_of_the_airlight(folder: Path, fog: Fog) -> None:
    done = fog(folder, "--depth-kind", "range", "--visibility", "80", "--airlight", "240,200,100")
    assert done.returncode == 0, done.stderr
    assert "airlight 240, 200, 100" in done.stdout
    seen = cv2.imread(str(folder / "out.png"), cv2.IMREAD_UNCHANGED)
    assert np.all(seen == np.rint(0.95 * np.array([100.0, 200.0, 240.0])))  # OpenCV has blue first
    assert sorted(path.name for path in folder.iterdir()) == ["camera.yaml", "depth.npy", "image.png", "out.png"]


def test_a_file_that_is_there_is_replaced_only_when_it_is_asked_for(folder: Path, fog: Fog) -> None:
    (folder / "out.png").write_text("of the user", encoding="utf-8")
    given = ("--depth-kind", "range", "--visibility", "80", "--airlight", "240")
    refused = fog(folder, *given)
    assert refused.returncode == 2
    assert "--out out.png already exists" in refused.stderr
    assert (folder / "out.png").read_text(encoding="utf-8") == "of the user"
    assert fog(folder, *given, "--overwrite").returncode == 0
    assert cv2.imread(str(folder / "out.png")) is not None


def test_mistakes_end_in_one_line_and_exit_code_2(folder: Path, fog: Fog) -> None:
    by_range = ("--depth-kind", "range")
    for arguments, told in [
        (("--depth-kind", "rnage"), "did you mean 'range'"),
        ((), "--depth-kind is missing"),
        ((*by_range, "--depth", "none.npy"), "none.npy: cannot be read"),
        ((*by_range, "--road-plane"), "the flat road; both are given"),
        ((*by_range, "--layer-height", "9"), "--layer-height goes with --ground-alb"),
        ((*by_range, "--horizon-row", "9"), "--horizon-row goes with --road-plane"),
    ]:
        done = fog(folder, "--visibility", "80", *arguments)
        assert done.returncode == 2
        assert told in done.stderr
        assert len(done.stderr.strip().splitlines()) == 1
        assert not (folder / "out.png").exists()


def test_an_image_that_is_missing_or_a_folder_is_named(folder: Path, fog: Fog) -> None:
    (folder / "image.png").unlink()
    assert fog(folder, "--visibility", "80").stderr.startswith("error: image.png: there is no such file")
    (folder / "image.png").mkdir()
    assert fog(folder, "--visibility", "80").stderr == "error: image.png: expected one image or video\n"


def test_fog_over_the_flat_road_needs_no_depth_map(
    folder: Path, command: Callable[..., "CompletedProcess[str]"]
) -> None:
    by_file = ("--camera", "camera.yaml")
    by_rows = ("--horizon-row", "12.9", "--focal-length", "60", "--mount-height", "1.4")

    def run(*arguments: str) -> "CompletedProcess[str]":
        given = ("image.png", "--visibility", "20", "--airlight", "200", "--out", "out.png", "--overwrite")
        return command("fog", *given, *arguments, cwd=folder)

    for camera in (by_file, by_rows):
        done = run("--road-plane", *camera)
        assert done.returncode == 0, done.stderr
        seen = cv2.imread(str(folder / "out.png"))
        assert np.all(seen[:13] == 200)
        # The lowest row looks 17 px below the horizon at 60 px: 1.4 m · 60 / 16.1 away, and transmits that much.
        assert np.all(seen[29, 20] < 160)
    for arguments, told in (
        ((), "--depth FILE or from --road-plane, the flat road; neither is given"),
        (("--road-plane",), "lacking: --horizon-row, --focal-length, --mount-height"),
        (("--road-plane", "--horizon-row", "9"), "lacking: --focal-length, --mount-height"),
        (("--road-plane", *by_file, *by_rows), "--mount-height and --camera are both given"),
        (("--road-plane", *by_rows, "--horizon-row", "30"), "--horizon-row must be a row of the image, 0 … 29"),
        (("--road-plane", *by_file, "--depth-kind", "range"), "--depth-kind goes with --depth"),
    ):
        done = run(*arguments)
        assert done.returncode == 2
        assert told in done.stderr
        assert len(done.stderr.strip().splitlines()) <= 2
