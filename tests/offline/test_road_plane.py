"""Fog over the flat road that a calibration tells of: its distances, images and videos, and what is refused."""

import dataclasses
import math
from pathlib import Path

import cv2
import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.offline.camera_file import Calibration
from fogsim.offline.fog_image import fog_file, fog_video
from fogsim.offline.rectification import RoadPlane, calibration_from_options
from fogsim.offline.video_source import VideoFile, VideoWriter
from fogsim.recorders.video import Encoder, encoder_command
from fogsim.values import Camera, Response

CAMERA = Camera(64, 48, 60.0, (31.5, 20.25), 1.4, math.radians(2.0), response=Response.LINEAR)


def test_a_level_road_lies_at_lambda_over_the_rows_below_the_horizon() -> None:
    # negru2013, eq. 11: depth along the axis; the slant range is longer by height and by the side.
    distance = RoadPlane(Calibration(CAMERA)).distance()
    rows, columns = np.indices(distance.shape)
    below = rows > CAMERA.horizon_row
    depth = CAMERA.row_distance / np.where(below, rows - CAMERA.horizon_row, 1.0)
    ahead = (depth - CAMERA.mount_height * math.sin(CAMERA.pitch)) / math.cos(CAMERA.pitch)
    exact = np.sqrt(ahead**2 + CAMERA.mount_height**2 + (depth * (columns - 31.5) / 60.0) ** 2)
    assert np.all(np.isinf(distance[~below]))
    assert np.allclose(distance[below], exact[below], rtol=1e-6)


def test_points_of_the_road_are_as_far_as_they_are_from_the_lens() -> None:
    """Points of the road are put through OpenCV's camera; where they show, the distance is theirs."""
    for lens in [(), (-0.31, 0.09, 0.0011, -0.0007), (0.08, -0.02, 0.0, 0.0)]:
        for yaw in [0.0, 0.2]:
            for roll in [0.0, 0.05, -0.3]:
                camera = dataclasses.replace(CAMERA, roll=roll)
                distance = RoadPlane(Calibration(camera, lens, yaw)).distance()
                # Vehicle axes: right, down, forward. Yaw left, then pitch down, then roll that lowers the right side.
                turn = cv2.Rodrigues(np.array([0.0, yaw, 0.0]))[0]
                turn = cv2.Rodrigues(np.array([camera.pitch, 0.0, 0.0]))[0] @ turn
                turn = cv2.Rodrigues(np.array([0.0, 0.0, roll]))[0] @ turn
                points = np.array(
                    [(x, camera.mount_height, z) for x in (-6.0, -1.0, 0.0, 2.0, 7.0) for z in (6.0, 9.0, 20.0, 60.0)]
                )
                matrix = np.array([[60.0, 0.0, 31.5], [0.0, 60.0, 20.25], [0.0, 0.0, 1.0]])
                places = cv2.projectPoints(points, turn, np.zeros(3), matrix, np.array(lens) if lens else None)[0][:, 0]
                inside = 0
                for (column, row), length in zip(places, np.linalg.norm(points, axis=1), strict=True):
                    left, upper = math.floor(column), math.floor(row)
                    if (
                        not (0 <= left < 63 and 0 <= upper < 47)
                        or np.isinf(distance[upper : upper + 2, left : left + 2]).any()
                    ):
                        continue
                    # 1 / distance is almost linear in the image.
                    inverse = 1.0 / distance[upper : upper + 2, left : left + 2]
                    right, down = column - left, row - upper
                    along = inverse[:, 0] * (1 - right) + inverse[:, 1] * right
                    assert 1.0 / (along[0] * (1 - down) + along[1] * down) == pytest.approx(length, rel=0.005)
                    inside += 1
                assert inside >= 6


def test_an_image_over_the_road_is_the_closed_form(tmp_path: Path) -> None:
    clear = np.random.default_rng(1).integers(0, 256, (48, 64, 3), dtype=np.uint8)
    cv2.imwrite(str(tmp_path / "clear.png"), clear)
    road = RoadPlane(Calibration(CAMERA))
    fog_file(tmp_path / "clear.png", road, 80.0, CAMERA, tmp_path / "out.png", (240.0,))
    transmittance = np.exp(-math.log(20.0) / 80.0 * road.distance())[..., None]
    seen = cv2.imread(str(tmp_path / "out.png"))
    assert np.abs(seen - (clear * transmittance + 240.0 * (1.0 - transmittance))).max() <= 0.5 + 1e-9
    assert np.all(seen[:18] == 240)


def test_the_airlight_is_the_skys_and_not_that_of_the_woods_before_it(tmp_path: Path) -> None:
    clear = np.full((48, 64, 3), 90, np.uint8)
    clear[:18, :44] = 30
    clear[:18, 44:] = (230, 220, 210)
    cv2.imwrite(str(tmp_path / "clear.png"), clear)
    road = RoadPlane(Calibration(CAMERA))
    assert np.all(fog_file(tmp_path / "clear.png", road, 80.0, CAMERA, tmp_path / "out.png") == [210.0, 220.0, 230.0])


def test_a_told_horizon_is_a_level_camera_with_its_axis_in_the_middle(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "clear.png"), np.zeros((48, 64, 3), np.uint8))
    camera = calibration_from_options(tmp_path / "clear.png", 18.0, 60.0, 1.4).camera
    assert camera.horizon_row == pytest.approx(18.0)
    assert (camera.width, camera.height, camera.response) == (64, 48, Response.SRGB)
    for changed, told in (
        ((48.0, 60.0, 1.4), "--horizon-row must be a row of the image, 0 … 47"),
        ((18.0, 0.0, 1.4), "--focal-length must be"),
        ((18.0, 60.0, math.nan), "--mount-height must be"),
    ):
        with pytest.raises(InputError, match=told):
            calibration_from_options(tmp_path / "clear.png", *changed)


def test_a_horizon_outside_the_image_is_refused() -> None:
    for pitch in [-40.0, 60.0]:
        camera = dataclasses.replace(CAMERA, pitch=math.radians(pitch))
        with pytest.raises(InputError, match=r"horizon, on row .* is not within the image of rows 0 … 47"):
            RoadPlane(Calibration(camera)).distance()


def test_a_lens_that_folds_the_image_is_refused() -> None:
    with pytest.raises(InputError, match="of the image's pixels by no ray"):
        RoadPlane(Calibration(CAMERA, (-2.0, 0.0, 0.0, 0.0))).distance()


@pytest.fixture
def clear_video(tmp_path: Path) -> Path:
    """Grey frames that grow brighter, half a second of them."""
    encoder = Encoder(encoder_command(tmp_path / "clear.mp4", 0.1, (64, 48)))
    for value in range(60, 110, 10):
        frame = np.full((48, 64, 3), value, np.uint8)
        frame[:18] = 220
        encoder.write(frame.tobytes())
    encoder.finish()
    return tmp_path / "clear.mp4"


def test_a_video_is_fogged_frame_by_frame_with_the_airlight_of_its_first(clear_video: Path, tmp_path: Path) -> None:
    camera = dataclasses.replace(CAMERA, response=Response.SRGB)
    road, out = RoadPlane(Calibration(camera)), tmp_path / "fog.mp4"
    air = list(fog_video(VideoFile.open(clear_video), road, 20.0, out))
    assert len(air) == 5
    assert np.all(np.abs(air[0] - 220.0) <= 2.0)
    before = [picture.image for picture in VideoFile.open(clear_video).pictures()]
    after = [picture.image for picture in VideoFile.open(out).pictures()]
    assert len(after) == 5
    for index, (clear, fogged) in enumerate(zip(before, after, strict=True)):
        cv2.imwrite(str(tmp_path / f"{index}.png"), clear[..., ::-1])
        fog_file(tmp_path / f"{index}.png", road, 20.0, camera, tmp_path / f"{index}_fog.png", tuple(air[0]))
        exact = cv2.imread(str(tmp_path / f"{index}_fog.png"))
        assert np.abs(fogged[..., ::-1].astype(int) - exact).mean() < 2.0  # what the encoder loses
    assert not list(tmp_path.glob("*.part"))


def test_a_video_that_is_left_or_refused_leaves_no_file(clear_video: Path, tmp_path: Path) -> None:
    road, out = RoadPlane(Calibration(CAMERA)), tmp_path / "fog.mp4"
    frames = fog_video(VideoFile.open(clear_video), road, 20.0, out)
    next(frames)
    frames.close()
    assert [path.name for path in tmp_path.iterdir()] == ["clear.mp4"]
    for changed, told in (
        ((tmp_path / "fog.avi", road), "is written as .mp4, got .avi"),
        ((clear_video, road), "would replace what is read"),
        ((out, RoadPlane(Calibration(dataclasses.replace(CAMERA, bits=12)))), "frames have 8 bits, the camera 12"),
        ((out, RoadPlane(Calibration(dataclasses.replace(CAMERA, width=66)))), "64 × 48 pixels, the camera 66 × 48"),
    ):
        with pytest.raises(InputError, match=told):
            next(fog_video(VideoFile.open(clear_video), changed[1], 20.0, changed[0]))
    with pytest.raises(InputError, match="--visibility must be"):
        next(fog_video(VideoFile.open(clear_video), road, 0.0, out))
    assert [path.name for path in tmp_path.iterdir()] == ["clear.mp4"]


def test_a_video_that_another_process_writes_is_left_alone(tmp_path: Path) -> None:
    out, frame = tmp_path / "out.mp4", np.zeros((32, 32, 3), np.uint8)
    # A process that was killed left these.
    (tmp_path / "out.mp4.part").symlink_to(tmp_path / "elsewhere")
    (tmp_path / "out.mp4.part.lock").touch(0o444)
    with VideoWriter(out) as first:
        first.write(frame, 0.0)
        assert (tmp_path / "out.mp4.part.lock").is_file(), "the encoder could not write a locked file on SMB"
        with pytest.raises(InputError, match="another process is writing it"), VideoWriter(out) as second:
            second.write(frame, 0.0)
        first.write(frame, 1.0)
    assert [path.name for path in tmp_path.iterdir()] == ["out.mp4"]
