from collections import deque
from pathlib import Path

import cv2
import imageio_ffmpeg
import numpy as np
import pytest
from numpy.typing import NDArray

from fogsim.errors import FogSimError, MissingDependencyError
from fogsim.metrics import step_metrics
from fogsim.offline.video_source import VideoFile
from fogsim.recorders import VideoRecorder, encoder_report
from fogsim.recorders.video import Encoder, encoder_command
from tests.recorders.synthetic import make_step


def read_video(path: Path) -> list[NDArray[np.uint8]]:
    """Frames, red first."""
    video = cv2.VideoCapture(str(path))
    frames = []
    while (read := video.read())[0]:
        frames.append(np.asarray(read[1], np.uint8)[:, :, ::-1])
    video.release()
    return frames


def four_letters(video: cv2.VideoCapture, what: int) -> str:
    return int(video.get(what)).to_bytes(4, "little").decode().lower()


def test_every_step_is_a_frame_at_real_speed(tmp_path: Path) -> None:
    """With the camera's image in it."""
    path, image = tmp_path / "video.mp4", np.zeros((120, 160, 3), np.uint8)
    image[:, :80], image[:, 80:] = (200, 40, 40), (40, 40, 200)
    recorder = VideoRecorder(path, frame_period=0.2)
    for index in range(12):
        step = make_step(index, time=0.2 * index, image=image)
        recorder.record(step, step_metrics(step))
    assert not path.exists()
    recorder.close(complete=True)
    recorder.close(complete=True)
    frames = read_video(path)
    assert len(frames) == 12
    assert frames[0].shape == (480, 1024, 3)
    np.testing.assert_allclose(frames[0][240, 160], (200, 40, 40), atol=12)
    np.testing.assert_allclose(frames[0][240, 480], (40, 40, 200), atol=12)
    video = cv2.VideoCapture(str(path))
    assert video.get(cv2.CAP_PROP_FPS) == pytest.approx(5.0)
    assert four_letters(video, cv2.CAP_PROP_FOURCC) in {"h264", "avc1"}
    assert four_letters(video, cv2.CAP_PROP_CODEC_PIXEL_FORMAT) == "i420"  # yuv420p: what browsers play
    video.release()
    assert [file.name for file in tmp_path.iterdir()] == ["video.mp4"]


def test_a_run_without_steps_leaves_nothing(tmp_path: Path) -> None:
    VideoRecorder(tmp_path / "video.mp4", frame_period=0.1).close(complete=False)
    assert list(tmp_path.iterdir()) == []


def test_time_goes_on_where_one_video_was_appended_to_another(tmp_path: Path) -> None:
    one, both = tmp_path / "one.mkv", tmp_path / "both.mkv"
    command = encoder_command(one, 0.1, (64, 48))
    encoder = Encoder(["matroska" if word == "mp4" else word for word in command])
    for _ in range(4):
        encoder.write(bytes(64 * 48 * 3))
    encoder.finish()
    both.write_bytes(2 * one.read_bytes())
    times = [picture.time for picture in VideoFile.open(both).pictures()]
    assert times == pytest.approx(np.arange(8) / 10.0, abs=0.002)


def test_a_frame_that_was_cut_off_does_not_spoil_the_others(tmp_path: Path) -> None:
    path = tmp_path / "video.mp4"
    encoder = Encoder(encoder_command(path, 0.1))
    frame = bytes(1024 * 480 * 3)
    for piece in (frame, frame, frame[: len(frame) // 3]):
        encoder.write(piece)
    encoder.finish()
    assert len(read_video(path)) == 2


def test_an_encoder_that_cannot_write_says_why(tmp_path: Path) -> None:
    encoder = Encoder(encoder_command(tmp_path / "missing" / "video.mp4", 0.1))
    frames = (bytes(1024 * 480 * 3) for _ in range(100))
    with pytest.raises(FogSimError, match=r"missing.*No such file"):
        deque(map(encoder.write, frames))
    with pytest.raises(FogSimError, match=r"missing.*No such file"):
        encoder.finish()


def test_the_encoder_is_reported_or_its_absence_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    assert encoder_report().startswith("ffmpeg ")

    def missing() -> str:
        raise RuntimeError("No ffmpeg exe could be found")

    monkeypatch.setattr(imageio_ffmpeg, "get_ffmpeg_exe", missing)
    with pytest.raises(MissingDependencyError, match="pip install imageio-ffmpeg"):
        encoder_report()
    with pytest.raises(MissingDependencyError, match="pip install imageio-ffmpeg"):
        VideoRecorder(Path("video.mp4"), 0.1)
