"""``fogsim restore``."""

import subprocess
import weakref
from collections.abc import Generator
from pathlib import Path

import cv2
import numpy as np
import pytest
import typer
from flat_road import Road, photograph, scan

from fogsim.cli.images.restore import restore_command
from fogsim.errors import InputError
from fogsim.offline.camera_file import load_calibration
from fogsim.offline.input_paths import find_source
from fogsim.offline.restoration import RestorationWish, Restored, restore_files
from fogsim.offline.source import Picture
from fogsim.offline.video_source import VideoFile
from fogsim.recorders.video import Encoder, encoder_command, ffmpeg_program
from tests.helpers.camera_files import camera_yaml
from tests.helpers.command import Command

CAMERA = camera_yaml((320, 240), 288, None, 1.38, 2)
WITH_CAMERA = ("--camera", "camera.yaml")
FOG = (*WITH_CAMERA, "--visibility", "80")


@pytest.fixture(scope="module")
def foggy(tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    """A photograph of a road in fog of 80 m."""
    file = tmp_path_factory.mktemp("camera") / "camera.yaml"
    file.write_text(CAMERA, encoding="utf-8")
    road = Road(80.0, camera=load_calibration(file).camera)
    return np.repeat(photograph(road, scan(road, 1, 2), 1)[..., None], 3, axis=2)


@pytest.fixture
def folder(tmp_path: Path, foggy: np.ndarray) -> Path:
    (tmp_path / "camera.yaml").write_text(CAMERA, encoding="utf-8")
    cv2.imwrite(str(tmp_path / "fog.png"), foggy)
    return tmp_path


def contrast(image: np.ndarray) -> float:
    return float(image.astype(float).std())


def test_an_image_is_restored_by_the_visibility_that_it_shows_itself(folder: Path, command: Command) -> None:
    done = command("restore", "fog.png", *WITH_CAMERA, "--out", "out.png", "--beside", cwd=folder)
    assert done.returncode == 0, done.stderr
    visibility = float(done.stdout.split("visibility ")[1].split(" m")[0])
    assert visibility == pytest.approx(80.0, rel=0.1)
    assert "estimated by joint_road" in done.stdout
    out, seen = (cv2.imread(str(folder / name)) for name in ("out.png", "fog.png"))
    assert out.shape == (240, 640, 3)
    assert np.array_equal(out[:, :320], seen)
    assert contrast(out[:, 320:]) > 1.3 * contrast(seen)


def test_several_images_go_into_a_folder_and_are_replaced_if_asked(folder: Path, command: Command) -> None:
    cv2.imwrite(str(folder / "other.png"), cv2.imread(str(folder / "fog.png"))[:, ::-1])
    line = ("restore", "fog.png", "other.png", *WITH_CAMERA, "--method", "tarel2009", "--out", "clear")
    assert command(*line, cwd=folder).returncode == 0
    assert sorted(path.name for path in (folder / "clear").iterdir()) == ["fog.png", "other.png"]
    refused = command(*line, cwd=folder)
    assert refused.returncode == 2
    assert "fog.png already exists" in refused.stderr
    assert command(*line, "--overwrite", cwd=folder).returncode == 0


def test_an_image_without_road_is_named_and_not_written(folder: Path, command: Command) -> None:
    cv2.imwrite(str(folder / "dark.png"), np.zeros((240, 320, 3), np.uint8))
    done = command("restore", "dark.png", "fog.png", *WITH_CAMERA, "--out", "clear", cwd=folder)
    assert done.returncode == 2
    assert "dark.png: no visibility: too dark above the horizon" in done.stderr
    assert [path.name for path in (folder / "clear").iterdir()] == ["fog.png"]


def test_images_that_are_not_restored_are_not_kept_in_memory(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    alive = []

    def lacking(*_: object, **__: object) -> Generator[Restored]:
        made = list[weakref.ref[np.ndarray]]()
        for number in range(8):
            image = np.zeros((4, 4, 3), np.uint8)
            made.append(weakref.ref(image))
            yield Restored(Picture(f"{number}.png", 0.0, image), None, reason="no visibility")
            alive.append(sum(one() is not None for one in made))

    monkeypatch.setattr("fogsim.offline.restoration.restore_files", lacking)
    with pytest.raises(typer.Exit):
        restore_command([str(folder / "fog.png")], folder / "camera.yaml", folder / "out.png")
    assert max(alive) <= 2


def test_why_no_image_could_be_read_is_reported(folder: Path, command: Command) -> None:
    for names in (("broken.png",), ("broken.png", "torn.png")):
        (folder / names[-1]).write_text("no image", encoding="utf-8")
        done = command("restore", *names, *WITH_CAMERA, "--out", "out.png" if len(names) == 1 else "clear", cwd=folder)
        assert done.returncode == 2
        assert all(f"  {name}: this is no image that can be read" in done.stderr for name in names)


def test_targets_are_not_compared_with_every_source(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "in").mkdir()
    (folder / "out").mkdir()
    for number in range(20):
        (folder / "in" / f"{number}.png").write_bytes((folder / "fog.png").read_bytes())
        (folder / "out" / f"{number}.png").touch()
    compared, is_same = list[Path](), Path.samefile

    def noted(path: Path, other: Path) -> bool:
        compared.append(path)
        return is_same(path, other)

    monkeypatch.setattr(Path, "samefile", noted)
    source, camera = find_source(folder / "in"), load_calibration(folder / "camera.yaml").camera
    restoring = restore_files(source, camera, RestorationWish("tarel2009"), folder / "out", overwrite=True)
    next(restoring)
    assert len(compared) <= 20
    (folder / "out" / "3.png").unlink()
    (folder / "out" / "3.png").symlink_to(folder / "in" / "7.png")
    with pytest.raises(InputError, match=r"3\.png would replace what is read"):
        next(restore_files(source, camera, RestorationWish("tarel2009"), folder / "out", overwrite=True))


@pytest.mark.parametrize("method", ["tarel2009", "planar"])
def test_an_interrupted_folder_is_resumed(folder: Path, method: str) -> None:
    for number in range(3):
        (folder / "in").mkdir(exist_ok=True)
        (folder / "in" / f"{number}.png").write_bytes((folder / "fog.png").read_bytes())
    source, camera, out = find_source(folder / "in"), load_calibration(folder / "camera.yaml").camera, folder / "out"
    interrupted = restore_files(source, camera, RestorationWish(method), out)
    assert next(interrupted).picture.name == str(folder / "in" / "0.png")
    interrupted.close()
    (out / "0.png").write_bytes(b"as it was written")
    with pytest.raises(InputError, match=r"0\.png already exists"):
        next(restore_files(source, camera, RestorationWish("dark_channel"), out))
    assert [one.picture.name for one in restore_files(source, camera, RestorationWish(method), out)] == [
        str(folder / "in" / f"{number}.png") for number in (1, 2)
    ]
    assert (out / "0.png").read_bytes() == b"as it was written"
    assert sorted(path.name for path in out.iterdir()) == ["0.png", "1.png", "2.png"]
    with pytest.raises(InputError, match=r"0\.png already exists"):
        next(restore_files(source, camera, RestorationWish(method), out))


def test_an_image_that_cannot_be_written_does_not_end_the_rest(folder: Path, command: Command) -> None:
    cv2.imwrite(str(folder / "deep.png"), np.full((240, 320), 40_000, np.uint16))
    (folder / "deep.png").rename(folder / "deep.bmp")
    line = (*WITH_CAMERA, "--method", "tarel2009", "--out")
    done = command("restore", "deep.bmp", "fog.png", *line, "clear", cwd=folder)
    assert done.returncode == 2
    allowed = "can be written as .png, .tif, .tiff, .pgm, .ppm, not as .bmp"
    assert f"  deep.bmp: clear/deep.bmp: an image of 16 bits {allowed}\n" in done.stderr
    assert [path.name for path in (folder / "clear").iterdir()] == ["fog.png"]
    done = command("restore", "deep.bmp", *line, "deep2.bmp", cwd=folder)
    assert done.stderr == f"error: deep2.bmp: an image of 16 bits {allowed}\n"


@pytest.mark.parametrize("beside", [False, True])
def test_opacity_is_kept(folder: Path, foggy: np.ndarray, command: Command, beside: bool) -> None:
    opacity = np.tile(np.arange(320).astype(np.uint8), (240, 1))
    cv2.imwrite(str(folder / "half.png"), np.dstack([foggy, opacity]))
    line = ("half.png", *FOG, *(["--beside"] if beside else []), "--out")
    assert command("restore", *line, "out.png", cwd=folder).returncode == 0
    out = cv2.imread(str(folder / "out.png"), cv2.IMREAD_UNCHANGED)
    assert np.array_equal(out[..., 3], np.tile(opacity, 1 + beside))
    done = command("restore", *line, "out.jpg", cwd=folder)
    assert done.returncode == 2
    assert "an image with transparency can be written as .png" in done.stderr


def test_sound_is_left_out_with_a_word(folder: Path, command: Command) -> None:
    sources = ["-f", "lavfi", "-i", "testsrc=size=320x240:rate=5", "-f", "lavfi", "-i", "sine", "-t", "0.4"]
    subprocess.run([ffmpeg_program(), "-loglevel", "error", *sources, str(folder / "heard.mp4")], check=True)
    for name, *options in (("restore",), ("fog", "--road-plane")):
        done = command(name, "heard.mp4", *FOG, *options, "--out", f"{name}.mp4", cwd=folder)
        assert done.returncode == 0, done.stderr
        assert done.stderr.endswith("left out: the sound of heard.mp4\n")


def put_video(path: Path, frames: list[np.ndarray]) -> None:
    encoder = Encoder(encoder_command(path, 0.1, (320, 240), 8))
    for frame in frames:
        encoder.write(frame.tobytes())
    encoder.finish()


def test_in_a_video_the_last_estimate_holds(folder: Path, foggy: np.ndarray, command: Command) -> None:
    dark = np.zeros_like(foggy)
    put_video(folder / "drive.mp4", [dark, foggy, dark])
    done = command("restore", "drive.mp4", *WITH_CAMERA, "--out", "clear.mp4", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "1 images had no estimate; the last one was used" in done.stderr
    assert "1 frames before the first estimate are as they were: no visibility" in done.stderr
    frames = [picture.image for picture in VideoFile.open(folder / "clear.mp4").pictures()]
    assert len(frames) == 3
    assert contrast(frames[1]) > 1.3 * contrast(foggy)


def test_a_video_in_which_no_fog_is_found_leaves_nothing(folder: Path, foggy: np.ndarray, command: Command) -> None:
    put_video(folder / "drive.mp4", [np.zeros_like(foggy)])
    done = command("restore", "drive.mp4", *WITH_CAMERA, "--out", "clear.mp4", cwd=folder)
    assert done.returncode == 2
    assert "drive.mp4: no visibility: too dark" in done.stderr
    assert sorted(path.name for path in folder.iterdir()) == ["camera.yaml", "drive.mp4", "fog.png"]


def test_mistakes_end_in_one_line_and_exit_code_2(folder: Path, command: Command) -> None:
    for arguments, message in [
        (("nofog.png", *FOG), "nofog.png: there is no such file"),
        (("fog.png", *FOG, "--method", "plannar"), "did you mean 'planar'"),
        (("fog.png", *FOG, "--method", "dark_channel"), "--visibility goes with planar"),
        (("fog.png", *FOG, "--airlight", "white"), "--airlight: expected a pixel value"),
    ]:
        done = command("restore", *arguments, "--out", "out.png", cwd=folder)
        assert done.returncode == 2
        assert message in done.stderr
        assert len(done.stderr.strip().splitlines()) == 1
        assert not (folder / "out.png").exists()


def test_an_image_of_another_size_is_refused(folder: Path, command: Command) -> None:
    cv2.imwrite(str(folder / "small.png"), np.zeros((24, 32, 3), np.uint8))
    (folder / "fog2.png").write_bytes((folder / "fog.png").read_bytes())
    done = command("restore", "small.png", *FOG, "--out", "out.png", cwd=folder)
    assert done.returncode == 2
    assert "small.png: the image has 32 × 24 pixels, the camera 320 × 240" in done.stderr
    done = command("restore", "fog.png", "small.png", "fog2.png", *FOG, "--out", "clear", cwd=folder)
    assert done.returncode == 2
    assert "  small.png: the image has 32 × 24 pixels" in done.stderr
    assert sorted(path.name for path in (folder / "clear").iterdir()) == ["fog.png", "fog2.png"]


def test_a_video_of_another_size_is_named(folder: Path, foggy: np.ndarray, command: Command) -> None:
    put_video(folder / "drive.mp4", [foggy])
    (folder / "camera.yaml").write_text(CAMERA.replace("width: 320", "width: 322"), encoding="utf-8")
    done = command("restore", "drive.mp4", *FOG, "--out", "clear.mp4", cwd=folder)
    assert "drive.mp4, frame 0: the image has 320 × 240 pixels" in done.stderr
