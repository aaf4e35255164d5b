"""Output options that name what cannot be written: refused in one line before the work begins."""

import contextlib
import errno
import os
import re
import socket
from collections.abc import Mapping, Sequence
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from fogsim.cli.app import app
from fogsim.core.files.output_targets import refuse_clashes, refuse_unwritable, refuse_unwritable_folder
from fogsim.errors import InputError
from fogsim.recorders.video import Encoder, encoder_command
from tests.helpers.camera_files import camera_yaml

LONG = "x" * 300

CAMERA = camera_yaml((40, 30), 60, (20, 15), 1.4, 2, "linear")

TEST = """
name: quick
road: {template: motorway}
duration_s: 1
expect:
  driven: {always: ego.speed >= 0 km/h}
"""


@pytest.fixture(scope="session")
def video(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Two black frames."""
    path = tmp_path_factory.mktemp("video") / "video.mp4"
    encoder = Encoder(encoder_command(path, 0.1, (40, 30)))
    encoder.write(bytes(2 * 40 * 30 * 3))
    encoder.finish()
    return path.read_bytes()


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, video: bytes) -> Path:
    """The current folder, with inputs and with what is in the way."""
    monkeypatch.chdir(tmp_path)
    Path("camera.yaml").write_text(CAMERA, encoding="utf-8")
    Path("quick.fog.yaml").write_text(TEST, encoding="utf-8")
    Path("mine").write_text("mine", encoding="utf-8")
    for name in ("image.png", "images/1.png", "images/2.png"):
        Path(name).parent.mkdir(exist_ok=True)
        cv2.imwrite(name, np.zeros((30, 40, 3), np.uint8))
    for name in ("there", "there.png", "there.mp4", "out/negru2013.png"):
        Path(name).mkdir(parents=True)
    Path("loop.png").symlink_to("loop.png")
    Path("nowhere").symlink_to("none")
    os.mkfifo("pipe")
    os.mkfifo("pipe.mp4")
    Path("video.mp4").write_bytes(video)
    return tmp_path


@pytest.fixture
def read_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """A file system that is read-only, played: root could write to a folder without permissions."""

    def refuse(**_: object) -> None:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr("fogsim.core.files.output_targets.tempfile.TemporaryFile", refuse)


FILES: Mapping[str, str] = {
    "there": "is a folder; give the name of a file",
    "none/a": "there is no folder none",
    "mine/a": "mine is not a folder",
    "mine/none/a": "mine is not a folder",
    "nowhere/a": "nowhere is not a folder",
    "loop.png": "cannot be written: Too many levels of symbolic links",
    "loop.png/a": "cannot be written: Too many levels of symbolic links",
    LONG: "cannot be written: File name too long",
    "x" * 253: "cannot be written: File name too long",
    "there/../" * 600 + "a": "cannot be written: File name too long",
    "/proc/a": "cannot be written: No such file or directory",
    "camera.yaml": "would replace what is read",
    "link": "would replace what is read",
    "mine": "already exists; give another name, or replace it with --overwrite",
    "socket": "is a disk or a socket",
    "/dev/fd/999": "cannot be written: Bad file descriptor",
    "a\0": "embedded null",
}


@pytest.mark.usefixtures("folder")
def test_a_file_that_cannot_be_written_is_refused() -> None:
    Path("link").symlink_to("camera.yaml")
    with contextlib.closing(socket.socket(socket.AF_UNIX)) as made:
        made.bind("socket")
        for name, why in FILES.items():
            with pytest.raises(InputError) as told:
                refuse_unwritable(Path(name), "--out", overwrite=False, read=[Path("camera.yaml"), Path("none")])
            assert why in str(told.value), name
            assert "--out " in str(told.value)
            assert "\n" not in str(told.value)
    with Path("mine").open("rb") as file, pytest.raises(InputError, match="not open for writing"):
        refuse_unwritable(Path(f"/dev/fd/{file.fileno()}"), "--out")


@pytest.mark.usefixtures("folder")
def test_what_can_be_written_is_not_touched(folder: Path) -> None:
    before = sorted(folder.rglob("*"))
    for name in ("new", "nowhere", "pipe", "/dev/null", "x" * 250):
        refuse_unwritable(Path(name), overwrite=False, read=[Path("camera.yaml")])
    refuse_unwritable(Path("mine"), read=[Path("camera.yaml")])
    refuse_unwritable(Path("none/deeper/a"), makes_folder=True)
    for name in ("there", "new", "none/deeper"):
        refuse_unwritable_folder(Path(name))
    assert sorted(folder.rglob("*")) == before
    with pytest.raises(InputError, match="is a pipe or a device"):
        refuse_unwritable(Path("pipe"), seeks=True)


FOLDERS: Mapping[str, str] = {
    "mine": "is not a folder; give the name of a folder",
    "pipe": "is not a folder; give the name of a folder",
    "nowhere": "is not a folder; give the name of a folder",
    "loop.png": "is not a folder; give the name of a folder",
    "mine/none/a": "mine is not a folder",
    f"none/{LONG}": "cannot be written: File name too long",
    "/proc/a": "cannot be written: No such file or directory",
    "a\0": "embedded null",
}


@pytest.mark.usefixtures("folder")
def test_a_folder_that_cannot_be_written_is_refused() -> None:
    for name, why in FOLDERS.items():
        with pytest.raises(InputError) as told:
            refuse_unwritable_folder(Path(name))
        assert why in str(told.value), name


@pytest.mark.usefixtures("folder", "read_only")
def test_a_disk_that_is_read_only_is_refused() -> None:
    for refuse in (refuse_unwritable, refuse_unwritable_folder):
        with pytest.raises(InputError, match="--out there/new: cannot be written: Read-only file system"):
            refuse(Path("there/new"), "--out")


@pytest.mark.usefixtures("folder")
def test_outputs_in_the_way_of_one_another_are_refused() -> None:
    for files, out, told in (
        ({"--junit": "a", "--html": "a"}, "out", "--junit a is in the way of --html a"),
        ({"--junit": "a", "--html": "there/../a"}, "out", "--junit a is in the way of --html there/../a"),
        ({"--junit": "nowhere", "--html": "none"}, "out", "--junit nowhere is in the way of --html none"),
        ({"--junit": "a"}, "a", "--junit a is in the way of --out a"),
        ({"--junit": "a"}, "a/b", "--junit a is in the way of --out a/b"),
        ({"--junit": "a", "--html": "a/b"}, "out", "--junit a is in the way of --html a/b"),
        ({"--junit": "/dev/null", "--html": "/dev/null"}, "out", ""),
        ({"--junit": "out/a", "--html": "out/b"}, "out", ""),
    ):
        with pytest.raises(InputError, match=told) if told else contextlib.nullcontext():
            refuse_clashes({option: Path(name) for option, name in files.items()}, {"--out": Path(out)})


FOGGED = ("--visibility", "80", "--camera", "camera.yaml")
CALIBRATION = ("--camera", "camera.yaml", "--overwrite", "--out")
REFUSED: Sequence[tuple[Sequence[str], str]] = (
    (("run", "clear_day", "--out", "mine"), "not a folder"),
    (("test", "quick.fog.yaml", "--junit", "mine/junit.xml"), "mine is not a folder"),
    (("test", "quick.fog.yaml", "--junit", "there"), "is a folder"),
    (("test", "quick.fog.yaml", "--junit", "quick.fog.yaml"), "would replace what is read"),
    (("test", "quick.fog.yaml", "--html", "a", "--junit", "a"), "in the way of"),
    (("test", "quick.fog.yaml", "--out", "mine"), "not a folder"),
    (("study", "motorway_policies", "--out", "mine"), "not a folder"),
    (("dataset", "clear_day", "--frames", "1", "--out", "mine"), "not a folder"),
    (("campaign", "quick.fog.yaml", "--junit", "quick.fog.yaml"), "would replace what is read"),
    (("campaign", "quick.fog.yaml", "--out", "a", "--junit", "a"), "in the way of"),
    (("signs", "clear_day", "--out", "there"), "is a folder"),
    (("signs", "quick.fog.yaml", "--out", "quick.fog.yaml", "--overwrite"), "would replace what is read"),
    (("view", "clear_day", "--out", "there.png"), "is a folder"),
    (("view", "clear_day", "--out", "a.docx"), "ending '.docx'"),
    (("new", "a", "--from", "clear_day", "--in", "mine"), "not a folder"),
    (("fog", "image.png", *FOGGED, "--road-plane", "--out", "there.png"), "is a folder"),
    (("fog", "image.png", *FOGGED, "--road-plane", "--out", "image.png", "--overwrite"), "would replace"),
    (("restore", "image.png", *FOGGED, "--out", "loop.png"), "symbolic links"),
    (("restore", "image.png", *FOGGED, "--out", "a.docx"), "ending '.docx'"),
    (("restore", "images", *FOGGED, "--out", "mine"), "not a folder"),
    (("restore", "images", *FOGGED, "--out", "images", "--overwrite"), "would replace"),
    (("restore", "video.mp4", *FOGGED, "--out", "pipe.mp4"), "is a pipe"),
    (("estimate", "image.png", "--camera", "camera.yaml", "--overlay", "there.png"), "is a folder"),
    (("estimate", "video.mp4", "--camera", "camera.yaml", "--overlay", "pipe.mp4"), "is a pipe"),
    (("estimate", "image.png", "--guess-camera", "--camera", "image.png", "--overwrite"), "would replace"),
    (("estimate", "image.png", "--guess-camera", "--camera", "mine/a"), "not a folder"),
    (("calibrate", "signs", *CALIBRATION, "camera.yaml"), "would replace"),
    (("calibrate", "signs", "--camera", "camera.yaml", "--out", "mine"), "already exists"),
    (("calibrate", "halos", *CALIBRATION, "mine/a"), "not a folder"),
    (("reproduce", "negru2013", "--out", "mine"), "not a folder"),
    (("reproduce", "negru2013", "--out", "out"), "is a folder"),
)


def test_a_command_refuses_its_target_before_it_works(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def work(*_: object, **__: object) -> None:
        raise AssertionError("the work has begun")

    for name in (
        "fogsim.simulation.loop.ClosedLoop.__init__",
        "fogsim.study.pool.ProcessPool.run",
        "fogsim.offline.guess.guess_camera",
    ):
        monkeypatch.setattr(name, work)
    monkeypatch.setattr("fogsim.cli.run.compiling_in_background", lambda: contextlib.nullcontext(lambda _: None))
    before = {path: path.read_bytes() if path.is_file() else None for path in folder.rglob("*")}
    for arguments, why in REFUSED:
        done = CliRunner().invoke(app, arguments)
        told = str(done.exception)
        assert isinstance(done.exception, InputError), (arguments, done.output + told)
        assert why in told, arguments
        assert re.fullmatch("--(out|in|junit|html|overlay|camera) .*", told), arguments
        after = {path: path.read_bytes() if path.is_file() else None for path in folder.rglob("*")}
        assert after == before, arguments
