"""Files as cameras and phones write them: stored turned, at uneven times, animated, cut off."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageOps

from fogsim.errors import InputError
from fogsim.offline import find_source
from fogsim.offline.image_files import read_image
from fogsim.offline.video_source import VideoWriter
from fogsim.recorders.video import ffmpeg_program


def frame(index: int) -> np.ndarray:
    image = np.full((32, 48, 3), 40 * index, np.uint8)
    image[: 4 * index + 4, :8] = 200
    return image


def test_images_are_turned_upright(tmp_path: Path) -> None:
    for ending in [".jpg", ".png", ".tif", ".webp"]:
        for orientation in range(1, 9):
            path, tag = tmp_path / f"turned{ending}", Image.Exif()
            tag[0x0112] = orientation
            options = {"lossless": True} if ending == ".webp" else {}
            Image.fromarray(frame(3)).save(path, exif=tag, **options)
            with Image.open(path) as stored:
                expected = np.asarray(ImageOps.exif_transpose(stored).convert("RGB"))
            np.testing.assert_array_equal(read_image(path)[..., ::-1], expected)


@pytest.mark.parametrize("ending", [".gif", ".webp", ".png"])
def test_an_animation_is_a_sequence(tmp_path: Path, ending: str) -> None:
    path, durations = tmp_path / f"moving{ending}", [50, 400, 100]
    first, *others = (Image.fromarray(frame(index)) for index in range(3))
    first.save(path, save_all=True, append_images=others, duration=durations)
    source = find_source(path)
    pictures = list(source.pictures())
    assert source.temporal
    assert [one.time for one in pictures] == pytest.approx([0.0, 0.05, 0.45])
    for index, one in enumerate(pictures):
        assert np.abs(one.image.astype(int) - frame(index)).mean() < 3
    with pytest.raises(InputError, match=r"expected one image, got 3 frames"):
        read_image(path)


def test_pages_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "scan.tif"
    Image.fromarray(frame(0)).save(path, save_all=True, append_images=[Image.fromarray(frame(1))])
    with pytest.raises(InputError, match=r"expected one image, got 2 pages"):
        read_image(path)


@pytest.mark.parametrize(
    ("times", "off"),
    [((0.0, 0.05, 0.1, 0.5, 0.9, 2.0), 1e-3), ((0.0, 0.1, 0.2, 0.201, 0.202, 0.3), 1e-4)],
    ids=["uneven", "one closely after another"],
)
def test_frames_of_a_video_keep_their_times_and_are_no_damage(
    tmp_path: Path, times: tuple[float, ...], off: float
) -> None:
    path = tmp_path / "uneven.mp4"
    with VideoWriter(path) as writer:
        for index, at in enumerate(times):
            writer.write(frame(index), at)
    pictures = list(find_source(path).pictures())
    assert [one.error for one in pictures] == [""] * len(times)
    assert [one.time for one in pictures] == pytest.approx(times, abs=off)
    assert [round(float(one.image.mean()) / 40) for one in pictures] == [
        round(float(frame(index).mean()) / 40) for index in range(len(times))
    ]


def made(path: Path, *options: str) -> Path:
    source = ["-f", "lavfi", "-i", "testsrc=size=64x48:rate=10:duration=0.3"]
    subprocess.run([ffmpeg_program(), "-loglevel", "error", *source, *options, str(path)], check=True)
    return path


def test_pixels_of_a_video_are_square(tmp_path: Path) -> None:
    for ratio, size in [("4/3", (86, 48)), ("10/11", (58, 48)), ("1919/1920", (64, 48)), ("0/1", (64, 48))]:
        source = find_source(made(tmp_path / f"{size[0]}_{ratio[:2]}.avi".replace("/", ""), "-vf", f"setsar={ratio}"))
        pictures = list(source.pictures())
        assert source.size == size
        assert [one.image.shape for one in pictures] == [(*size[::-1], 3)] * 3


@pytest.mark.parametrize("curve", ["arib-std-b67", "smpte2084"])
def test_a_video_of_high_dynamic_range_is_refused(tmp_path: Path, curve: str) -> None:
    tags = f"log-level=none:colorprim=bt2020:transfer={curve}:colormatrix=bt2020nc"
    path = made(tmp_path / "hdr.mov", "-c:v", "libx265", "-pix_fmt", "yuv420p10le", "-x265-params", tags)
    with pytest.raises(InputError, match=rf"an HDR video \({curve}\)"):
        find_source(path)


def test_frames_at_one_time_are_read_and_written(tmp_path: Path) -> None:
    path, copy = tmp_path / "equal.mkv", tmp_path / "copy.mp4"
    source = ["-f", "lavfi", "-i", "testsrc=size=80x60:rate=10:duration=1", "-c:v", "mjpeg"]
    repeated = "setts=ts='if(eq(N,3),PREV_OUTPTS,if(eq(N,6),PREV_OUTPTS-50,PTS))'"
    subprocess.run([ffmpeg_program(), "-loglevel", "error", *source, "-bsf:v", repeated, str(path)], check=False)
    pictures = list(find_source(path).pictures())
    times = [one.time for one in pictures]
    assert (len(times), times[2]) == (10, times[3])
    with VideoWriter(copy) as writer:
        for one in pictures:
            assert one.image is not None, one.error
            writer.write(one.image, one.time)
    copied = list(find_source(copy).pictures())
    assert [one.error for one in copied] == [""] * 10
    assert np.all(np.diff([one.time for one in copied]) > 0.0)


SLOW_ENCODER = "import os, pathlib, sys, time; pathlib.Path('pid').write_text(f'{os.getpid()} '); time.sleep(60)"


@pytest.mark.timeout(30)
@pytest.mark.parametrize("is_complete", [False, True])
def test_an_encoder_ends_at_once_with_an_interrupted_video(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_complete: bool
) -> None:
    monkeypatch.chdir(tmp_path)
    command = [sys.executable, "-c", SLOW_ENCODER]
    monkeypatch.setattr("fogsim.offline.video_source.encoding_command", lambda part, *_: [*command, str(part)])
    main = threading.main_thread().ident
    assert main is not None
    with pytest.raises(KeyboardInterrupt), VideoWriter(tmp_path / "out.mp4") as writer:  # noqa: PT012 - within or at the end
        writer.write(frame(0), 0.0)
        while not (text := Path("pid").read_text() if Path("pid").exists() else "").endswith(" "):
            time.sleep(0.01)
        if is_complete:
            threading.Timer(0.5, signal.pthread_kill, (main, signal.SIGINT)).start()
        else:
            raise KeyboardInterrupt
    with pytest.raises(ProcessLookupError):
        os.kill(int(text), 0)
    assert [path.name for path in tmp_path.iterdir()] == ["pid"]


@pytest.mark.parametrize("ending", [".mkv", ".ts", ".mp4"])
def test_sound_before_the_first_frame_is_no_damage(tmp_path: Path, ending: str) -> None:
    whole, trimmed = tmp_path / "whole.mkv", tmp_path / f"trimmed{ending}"
    ffmpeg = [ffmpeg_program(), "-loglevel", "error"]
    sources = ["-f", "lavfi", "-i", "testsrc=size=80x60:rate=10:duration=4", "-f", "lavfi", "-i", "sine=duration=4"]
    subprocess.run([*ffmpeg, *sources, "-g", "20", str(whole)], check=True)
    subprocess.run([*ffmpeg, "-i", str(whole), "-ss", "1.1", "-c", "copy", str(trimmed)], check=True)
    pictures = list(find_source(trimmed).pictures())
    assert not pictures[-1].error
    assert len(pictures) == find_source(trimmed).count == 20


@pytest.mark.parametrize("ending", [".mkv", ".mp4"])
def test_sound_after_the_last_frame_is_no_damage(tmp_path: Path, ending: str) -> None:
    whole, cut = (tmp_path / f"{name}{ending}" for name in ("whole", "cut"))
    sound = ["-f", "lavfi", "-i", "sine=duration=3", "-movflags", "+faststart"]
    pictures = list(find_source(made(whole, *sound)).pictures())
    assert [one.error for one in pictures] == [""] * 3
    cut.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    assert "cut off or damaged" in list(find_source(cut).pictures())[-1].error


@pytest.mark.parametrize(("ending", "codec"), [("mkv", "mjpeg"), ("webm", "vp8"), ("wmv", "wmv2"), ("mp4", "mpeg4")])
def test_a_later_segment_of_a_recording_is_no_damage(tmp_path: Path, ending: str, codec: str) -> None:
    source = find_source(made(tmp_path / f"segment.{ending}", "-output_ts_offset", "60", "-c:v", codec))
    assert source.count == 3
    assert [one.error for one in source.pictures()] == [""] * 3


@pytest.mark.parametrize("codec", ["mjpeg", "libx264"])  # without and with frames in another order
def test_a_later_segment_in_an_avi_file_begins_with_its_first_frame(tmp_path: Path, codec: str) -> None:
    path = made(tmp_path / "segment.avi", "-output_ts_offset", "60", "-c:v", codec)
    pictures = list(find_source(path).pictures())
    assert [one.error for one in pictures] == [""] * 3
    assert [one.time for one in pictures] == pytest.approx([0.0, 0.1, 0.2])


@pytest.mark.parametrize("codec", ["libx264", "mpeg2video"])
def test_a_stream_that_was_cut_off_says_so(tmp_path: Path, codec: str) -> None:
    whole, stream, cut = (tmp_path / name for name in ("whole.mp4", "stream.ts", "cut.ts"))
    with VideoWriter(whole) as writer:
        for index in range(50):
            writer.write(np.random.default_rng(index).integers(0, 255, (64, 96, 3), np.uint8), index / 25)
    command = [ffmpeg_program(), "-loglevel", "error", "-i", str(whole), "-c:v", codec, "-f", "mpegts", str(stream)]
    subprocess.run(command, check=True)
    assert all(not one.error for one in find_source(stream).pictures())
    cut.write_bytes(stream.read_bytes()[: stream.stat().st_size * 6 // 10])
    *_, last = find_source(cut).pictures()
    assert last.image is None
    assert "the video is cut off or damaged" in last.error
