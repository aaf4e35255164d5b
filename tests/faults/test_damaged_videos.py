"""Videos that are damaged, cut off, or none: what was read is kept, one line says where it ended, and the code is 2."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fogsim.errors import InputError
from fogsim.offline import find_source
from fogsim.recorders.video import ffmpeg_program
from tests.helpers.camera_files import camera_yaml
from tests.helpers.command import Command

CAMERA = camera_yaml((80, 60), 70)
VARIABLE_RATE = ("-vf", "select='not(eq(mod(n,5),2))'", "-fps_mode", "vfr")


@pytest.fixture(scope="module")
def videos(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Whole, damaged and foreign files with the names of videos."""
    folder = tmp_path_factory.mktemp("videos")
    source = [ffmpeg_program(), "-loglevel", "error", "-f", "lavfi", "-i", "testsrc=size=80x60:rate=10:duration=3"]
    # The index of an MP4 at its beginning announces all of its frames.
    first = ("-movflags", "+faststart")
    for name, options in {"whole.mp4": first, "variable.mp4": VARIABLE_RATE, "whole.mkv": (), "whole.avi": ()}.items():
        subprocess.run([*source, "-g", "5", *options, str(folder / name)], check=True)
    for name in ("whole.mp4", "whole.mkv", "whole.avi"):
        data = (folder / name).read_bytes()
        (folder / name.replace("whole", "cut")).write_bytes(data[: len(data) // 2])
    data = (folder / "whole.avi").read_bytes()
    middle = len(data) // 2
    (folder / "flipped.avi").write_bytes(data[:middle] + bytes(one ^ 0x5A for one in data[middle : middle + 60]))
    (folder / "playlist.mp4").write_text("#EXTM3U\n#EXT-X-TARGETDURATION:9\n#EXTINF:9,\nwhole.mp4\n#EXT-X-ENDLIST\n")
    (folder / "concat.mp4").write_text("ffconcat version 1.0\nfile whole.mp4\n")
    (folder / "sdp.mp4").write_text("v=0\no=- 0 0 IN IP4 127.0.0.1\nc=IN IP4 127.0.0.1\nm=video 5004 RTP/AVP 96\n")
    (folder / "empty.mp4").write_bytes(b"")
    (folder / "camera.yaml").write_text(CAMERA)
    return folder


@pytest.mark.parametrize(("name", "frames"), [("whole.mp4", 30), ("whole.mkv", 30), ("variable.mp4", 24)])
def test_a_whole_video_has_no_warning(videos: Path, name: str, frames: int) -> None:
    pictures = list(find_source(videos / name).pictures())
    assert len(pictures) == frames
    assert not any(picture.error for picture in pictures)


def test_videos_that_a_shell_has_joined_are_not_read_as_the_first(videos: Path, tmp_path: Path) -> None:
    (tmp_path / "joined.mp4").write_bytes(2 * (videos / "whole.mp4").read_bytes())
    with pytest.raises(InputError, match=r"joined\.mp4: several videos one after another"):
        find_source(tmp_path / "joined.mp4")


@pytest.mark.parametrize("name", ["cut.mp4", "cut.mkv", "cut.avi", "flipped.avi"])
def test_what_was_read_of_a_damaged_video_is_estimated(command: Command, videos: Path, name: str) -> None:
    code, out, err = command(
        *("estimate", name, "--camera", "camera.yaml", "--method", "negru2013", "--json"), cwd=videos
    )
    records = [json.loads(line) for line in out.splitlines()]
    read = len(records) - 1
    assert code == 2
    assert read > 5
    assert [record["frame"] for record in records] == list(range(read + 1))
    told = f"{name}: the video is cut off or damaged: {read} {'of 30 frames' if name == 'cut.mp4' else ''}"
    assert told in err
    assert records[-1]["error"].startswith(told)


@pytest.mark.parametrize("name", ["fog", "restore"])
def test_what_was_read_of_a_damaged_video_is_written(command: Command, videos: Path, tmp_path: Path, name: str) -> None:
    out = tmp_path / "out.mp4"
    road = ("--road-plane",) if name == "fog" else ()
    code, _, err = command(
        *(name, "cut.mkv", "--camera", "camera.yaml", "--visibility", "60", "--out", str(out)), *road, cwd=videos
    )
    assert code == 2
    assert "cut.mkv: the video is cut off or damaged: " in err
    assert f"{out} has what could be read" in err
    written = list(find_source(out).pictures())
    assert 5 < len(written) < 30
    assert not written[-1].error


def test_frames_of_another_size_are_listed_and_left_out(command: Command, videos: Path, tmp_path: Path) -> None:
    """A stream that was joined from two."""
    sizes = tmp_path / "sizes.ts"
    for size in ("80x60", "64x48"):
        source = ["-f", "lavfi", "-i", f"testsrc=size={size}:rate=10:duration=0.5", "-c:v", "libx264", "-bf", "0"]
        made = [ffmpeg_program(), "-loglevel", "error", *source, "-f", "mpegts", "-"]
        with sizes.open("ab") as file:
            file.write(subprocess.run(made, check=True, stdout=subprocess.PIPE).stdout)
    line = (str(sizes), "--camera", str(videos / "camera.yaml"))
    code, out, err = command("estimate", *line, "--method", "negru2013", "--json", cwd=tmp_path)
    records = [json.loads(line) for line in out.splitlines()]
    assert code == 2
    assert ["error" in record for record in records] == [False] * 5 + [True] * 5
    error = "sizes.ts, frame 5: it has 64 × 48 pixels, the first frame 80 × 60"
    assert error in err
    code, _, err = command("fog", *line, "--road-plane", "--visibility", "60", "--out", "out.mp4", cwd=tmp_path)
    assert code == 2
    assert f"{error}; out.mp4 has what could be read" in err
    assert len(list(find_source(tmp_path / "out.mp4").pictures())) == 5


@pytest.mark.parametrize("name", ["playlist.mp4", "concat.mp4", "sdp.mp4", "empty.mp4"])
def test_a_file_that_names_others_or_addresses_is_no_video(
    videos: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.chdir(videos)
    with pytest.raises(InputError, match=f"^{name}: this is no video that can be read$"):
        find_source(name)


FOGGED = "--camera camera.yaml --visibility 60 --out"
PIPES = [
    "estimate pipe.png --camera camera.yaml",
    "estimate pipe.mp4 --camera camera.yaml",
    "estimate photo.png --camera pipe.yaml",
    f"restore pipe.png {FOGGED} out.png",
    f"restore pipe.mp4 {FOGGED} out.mp4",
    f"fog pipe.png --road-plane {FOGGED} out.png",
    f"fog photo.png --depth pipe.npy --depth-kind range {FOGGED} out.png",
    "calibrate signs --camera pipe.yaml",
    "estimate pipe.png --guess-camera --mount-height 1 --camera new.yaml",
]


@pytest.mark.timeout(60)
def test_pipes_are_refused_and_not_waited_for(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Image.fromarray(np.zeros((60, 80), np.uint8)).save("photo.png")
    Path("camera.yaml").write_text(CAMERA)
    for ending in ("png", "mp4", "yaml", "npy"):
        os.mkfifo(f"pipe.{ending}")
    for line in PIPES:
        code, _, err = command(*line.split())
        assert code == 2, line
        assert "regular file" in err, line
