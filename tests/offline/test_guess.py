"""A calibration guessed from images whose true one is known."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fogsim.errors import InputError
from fogsim.offline import camera_text, find_source, guess_camera, load_calibration, write_camera
from fogsim.offline.camera_file import load_camera
from fogsim.offline.guess import _mount_height
from fogsim.offline.source import ImageFiles
from fogsim.values import Response
from fogsim.vision.lines.segments import RoadSegments
from fogsim.vision.lines.vanishing_point import VanishingPoint

HEIGHT = 1.38


def test_the_pitch_comes_from_the_lines_of_the_road(drive) -> None:
    angle = 2.0 * math.atan(0.5 * drive.camera.width / drive.camera.focal_length)
    guess = guess_camera(find_source(drive.folder / "images"), mount_height=HEIGHT, field_of_view=angle)
    assert guess.warnings == ()
    assert guess.camera.pitch == pytest.approx(drive.camera.pitch, abs=math.radians(0.1))
    assert guess.camera.focal_length == pytest.approx(drive.camera.focal_length, rel=1e-9)
    assert (guess.camera.width, guess.camera.height, guess.camera.mount_height) == (640, 480, HEIGHT)
    assert guess.camera.response is Response.SRGB
    assert "8 of 8 images" in guess.reasons["pitch_deg"]


def test_what_is_not_stated_is_assumed_and_said(drive) -> None:
    source = find_source(drive.folder / "images")
    by_height = guess_camera(source, mount_height=HEIGHT)
    assert by_height.camera.focal_length == pytest.approx(320.0 / math.tan(math.radians(36.5)))
    assert any("--field-of-view" in warning for warning in by_height.warnings)
    by_angle = guess_camera(source, field_of_view=1.0)
    # The lanes are 3.75 m wide, not the 3.5 m that are assumed of them.
    assert by_angle.camera.mount_height == pytest.approx(HEIGHT, rel=0.05)
    assert any("measure it" in warning for warning in by_angle.warnings)
    assert "ASSUMED" in camera_text(by_angle)


def test_lines_close_below_a_camera_put_it_above_a_car_and_lines_far_apart_do_not_put_it_below() -> None:
    point = VanishingPoint(320.0, 200.0, 0.5, 4, 400.0)
    for width, height in ((3.5 / 6.0, 9.0), (7.0 / 1.3, 1.3), (3.5 / 1.3, 1.3)):
        lines = RoadSegments(point, 0.5 * width * np.array([-1.0, 1.0]), np.full(2, 200.0))
        guessed = _mount_height([lines] * 5, None)
        assert guessed.value == pytest.approx(height)
        assert guessed.warnings


def test_an_unknown_camera_that_is_held_upright_has_the_same_focal_length(tmp_path: Path) -> None:
    for name, size in (("upright.png", (480, 640, 3)), ("level.png", (640, 480, 3))):
        Image.fromarray(np.full(size, 120, np.uint8)).save(tmp_path / name)
    upright, level = (guess_camera(find_source(path), horizon_row=200.0) for path in sorted(tmp_path.iterdir()))
    assert upright.camera.focal_length == level.camera.focal_length


def test_the_metadata_of_a_photograph_state_its_focal_length(drive, tmp_path: Path) -> None:
    image = Image.fromarray(drive.frames[0])
    exif = Image.Exif()
    exif.get_ifd(0x8769)[0xA405] = 26
    image.save(tmp_path / "photo.jpg", exif=exif, quality=95)
    guess = guess_camera(find_source(tmp_path / "photo.jpg"), mount_height=HEIGHT)
    # 26 mm on 36 mm × 24 mm, whose diagonal is 43.27 mm, by the image's own diagonal of 800 px.
    assert guess.camera.focal_length == pytest.approx(26.0 * 800.0 / 43.27)
    assert "metadata" in guess.reasons["focal_length_px"]
    assert any("1 image alone" in warning for warning in guess.warnings)


def test_a_stated_horizon_needs_no_lines(tmp_path: Path) -> None:
    Image.fromarray(np.full((480, 640, 3), 120, np.uint8)).save(tmp_path / "blank.png")
    source = find_source(tmp_path / "blank.png")
    with pytest.raises(InputError, match="--horizon-row"):
        guess_camera(source, mount_height=HEIGHT)
    camera = guess_camera(source, mount_height=HEIGHT, field_of_view=1.0, horizon_row=200.0).camera
    assert camera.horizon_row == pytest.approx(200.0)


def test_a_camera_that_looks_aside_is_told(drive, tmp_path: Path) -> None:
    for index, frame in enumerate(drive.frames[:3]):
        Image.fromarray(frame[:, 120:]).save(tmp_path / f"{index}.png")
    guess = guess_camera(find_source(tmp_path), mount_height=HEIGHT, field_of_view=0.85)
    assert any("turned to the right" in warning for warning in guess.warnings)


def test_a_camera_file_says_what_it_was_guessed_from_and_reads_back(drive, tmp_path: Path) -> None:
    guess = guess_camera(find_source(drive.folder / "images"), mount_height=HEIGHT)
    path = tmp_path / "camera.yaml"
    write_camera(path, guess)
    text = path.read_text(encoding="utf-8")
    assert "lines of the road meet" in text
    assert "# Uncertain: the lens is not known" in text
    read = load_camera(path)
    rounded = replace(guess.camera, focal_length=read.focal_length, pitch=read.pitch)
    assert read == rounded
    assert read.pitch == pytest.approx(guess.camera.pitch, abs=math.radians(0.001))
    with pytest.raises(InputError, match="--overwrite"):
        write_camera(path, guess)
    uncertain = replace(guess, deviations=replace(guess.deviations, pitch=math.radians(9.0)))
    write_camera(path, uncertain, overwrite=True)
    assert load_calibration(path).deviations.pitch == pytest.approx(math.radians(9.0))
    assert [one.name for one in tmp_path.iterdir()] == ["camera.yaml"]


def test_mistakes_are_told(drive) -> None:
    for options, told in [
        ({"mount_height": 0.0}, "--mount-height must lie"),
        ({"mount_height": float("nan")}, "--mount-height must lie"),
        ({"field_of_view": math.radians(200.0)}, "--field-of-view must lie"),
        ({"mount_height": 1.3, "horizon_row": math.inf}, "--horizon-row must be"),
    ]:
        with pytest.raises(InputError, match=told):
            guess_camera(find_source(drive.folder / "images"), **options)


def test_a_source_of_unknown_length_is_not_kept_whole(tmp_path: Path) -> None:
    class Unstated(ImageFiles):
        count = 1

    Image.fromarray(np.full((48, 64), 120, np.uint8)).save(tmp_path / "blank.png")
    with pytest.raises(InputError, match="found in 50 images"):
        guess_camera(Unstated((tmp_path / "blank.png",) * 200, True, 0.1))


def test_one_image_of_another_size_is_left_out_of_a_guess(drive, tmp_path: Path) -> None:
    exif = Image.Exif()
    exif.get_ifd(0x8769)[0xA405] = 100
    Image.fromarray(drive.frames[0][:400]).save(tmp_path / "a.png", exif=exif)
    for index, frame in enumerate(drive.frames[:3]):
        Image.fromarray(frame).save(tmp_path / f"b{index}.png")
    guess = guess_camera(find_source(tmp_path), mount_height=HEIGHT)
    assert (guess.camera.width, guess.camera.height) == (640, 480)
    assert "metadata" not in guess.reasons["focal_length_px"]
    assert guess.warnings[0].startswith("1 of 4 images have another size than the others (")


def test_images_of_two_sizes_are_of_two_cameras(drive, tmp_path: Path) -> None:
    Image.fromarray(drive.frames[0]).save(tmp_path / "a.png")
    Image.fromarray(drive.frames[0][:400]).save(tmp_path / "b.png")
    with pytest.raises(InputError, match=r"640 × 400 pixels and .*a.png has 640 × 480"):
        guess_camera(find_source(tmp_path), mount_height=HEIGHT)
