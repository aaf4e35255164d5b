"""Which files are meant by what stands on a command line."""

from pathlib import Path

import pytest
from PIL import Image

from fogsim.errors import InputError
from fogsim.offline import find_source
from fogsim.offline.input_paths import is_sequence


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("f10.png", "f9.png", "f11.JPG", "notes.txt"):
        (tmp_path / name).write_bytes(b"")
    return tmp_path


def names(source) -> list[str]:
    return [path.name for path in source.paths]


def test_folders_and_patterns_are_in_the_order_of_their_numbers(folder: Path) -> None:
    assert names(find_source(folder)) == ["f9.png", "f10.png", "f11.JPG"]
    assert names(find_source(str(folder / "*.png"))) == ["f9.png", "f10.png"]


def test_files_stay_in_the_order_in_which_they_are_given(folder: Path) -> None:
    assert names(find_source([folder / "f10.png", folder / "f9.png"])) == ["f10.png", "f9.png"]


def test_hidden_files_of_a_folder_are_left_out(folder: Path) -> None:
    (folder / "._f9.png").write_bytes(b"Mac OS X")
    assert names(find_source(folder)) == ["f9.png", "f10.png", "f11.JPG"]


def test_a_sequence_in_the_order_of_a_shell_is_refused(folder: Path) -> None:
    paths = [folder / "f10.png", folder / "f9.png"]
    with pytest.raises(InputError, match=r"--sequence: .*f10.png, .*f9.png, … are in the order of their names as text"):
        find_source(paths, sequence=True)
    assert not find_source(paths).temporal
    assert find_source(paths[::-1], sequence=True).temporal


def test_a_file_with_the_signs_of_a_pattern_in_its_name_is_that_file(folder: Path) -> None:
    (folder / "a[1].png").write_bytes(b"")
    assert names(find_source(str(folder / "a[1].png"))) == ["a[1].png"]


def test_numbers_that_count_on_in_equal_steps_make_a_sequence() -> None:
    for files, sequence in [
        (["a1.png", "a2.png", "a3.png"], True),
        (["cam2_00010.png", "cam2_00015.png", "cam2_00020.png"], True),
        (["a1.png", "a2.png", "a4.png"], False),
        (["a2.png", "a1.png"], False),
        (["a1.png", "b2.png"], False),
        (["x/1.png", "y/2.png"], False),
        (["fog.png", "mist.png"], False),
        (["a1.png"], False),
        ([], False),
    ]:
        assert is_sequence([Path(file) for file in files]) is sequence


def test_images_that_are_missing_in_a_sequence_are_named(tmp_path: Path) -> None:
    for number in (7, 8, 11, 12):
        (tmp_path / f"f{number}.png").write_bytes(b"")
    with pytest.warns(UserWarning, match=r"numbers of \S+f8\.png and \S+f11\.png are farther apart .* taken as 0\.1 s"):
        assert find_source(tmp_path, sequence=True).temporal
    find_source(tmp_path)  # as stills, of which its description speaks


def photographs(folder: Path, *times: str) -> None:
    """Numbered photographs, each with its time within an hour, such as "05:30.25", in EXIF data."""
    for number, time in enumerate(times):
        exif, (whole, _, part) = Image.Exif(), time.partition(".")
        exif.get_ifd(0x8769).update({0x9003: f"2026:01:02 08:{whole}"} | ({0x9291: part} if part else {}))
        Image.new("L", (8, 6)).save(folder / f"IMG_{number}.jpg", exif=exif)


@pytest.mark.parametrize(
    ("times", "period"),
    [
        (("00:00", "05:00", "10:00"), None),
        (("00:02", "00:01", "00:03"), None),
        (("00:00.0", "00:00.25", "00:00.5"), 0.25),
        (("00:00", "00:00", "00:01", "00:01", "00:02"), 0.5),
    ],
)
def test_times_in_photographs_decide_whether_they_are_a_drive(tmp_path: Path, times: tuple, period: float) -> None:
    photographs(tmp_path, *times)
    source = find_source(tmp_path)
    assert source.temporal == (period is not None)
    if period:
        assert source.period == pytest.approx(period)
        assert not source.remarks
    else:
        assert "by their EXIF times they were taken" in source.remarks[0]
    assert find_source(tmp_path, sequence=True).temporal


def test_photographs_minutes_apart_keep_their_times_if_they_are_called_a_sequence(tmp_path: Path) -> None:
    photographs(tmp_path, "00:00", "05:00", "10:00")
    assert "up to 300 s apart" in find_source(tmp_path).remarks[0]
    assert find_source(tmp_path, sequence=True).period == pytest.approx(300.0)
    assert find_source(tmp_path, sequence=True, rate=4.0).period == pytest.approx(0.25)


def test_an_assumed_rate_is_a_remark(folder: Path) -> None:
    assumed = "3 images are taken as one drive, 10 a second, since no EXIF times say otherwise: --rate changes it"
    assert find_source(folder, sequence=True).remarks[0].startswith(assumed)
    assert not find_source(folder, sequence=True, rate=10).remarks
    assert not find_source(folder).remarks


def test_images_of_other_formats_in_a_folder_are_a_remark(folder: Path) -> None:
    for name in ("1.HEIC", "2.heic", "3.avif", "camera.yaml", "._4.heic"):
        (folder / name).write_bytes(b"")
    (remark,) = find_source(folder).remarks
    assert remark.startswith(f"{folder}: left out, since only .png")
    assert remark.endswith("are read from a folder: 2 × .heic, 1 × .avif")
    assert not find_source(str(folder / "*.png"), sequence=False).remarks
    for image in (*folder.glob("*.png"), *folder.glob("*.JPG")):
        image.unlink()
    with pytest.raises(InputError, match=r"no image with one of .*; it has 2 × \.heic, 1 × \.avif$"):
        find_source(folder)


def test_what_was_found_is_told(folder: Path) -> None:
    assert find_source(folder / "f9.png").description == "1 image"
    assert find_source(str(folder / "*.png"), rate=25).description == "2 images, taken as a sequence of 25 a second"
    assert find_source(folder, sequence=False).description == "3 images, taken as stills, each on its own"


@pytest.mark.parametrize(
    ("given", "options", "told"),
    [
        ("nowhere/a.png", {}, "there is no such file or folder"),
        ("f99.png", {}, "did you mean 'f9.png'?"),
        ("*.bmp", {}, "no file fits this pattern"),
        ("empty", {}, "the folder contains no image with one of the endings .png"),
        ("f9.png", {"rate": 0.0}, "--rate must be a positive"),
        ("f9.png", {"rate": float("nan")}, "--rate must be a positive"),
        ("bad.mp4", {}, "bad.mp4: this is no video that can be read"),
        ("bad.mp4", {"rate": 5.0}, "--rate is for image files"),
    ],
)
def test_mistakes_are_told(folder: Path, given: str, options: dict, told: str) -> None:
    (folder / "empty").mkdir()
    (folder / "bad.mp4").write_bytes(b"no video at all")
    with pytest.raises(InputError) as caught:
        find_source(str(folder / given), **options)
    assert told in str(caught.value)


def test_a_video_is_alone(folder: Path) -> None:
    for name in ("a.mp4", "00001.MTS"):
        (folder / name).write_bytes(b"")
        with pytest.raises(InputError, match="one video alone, got 2 files"):
            find_source([folder / name, folder / "f9.png"])


def test_nothing_is_refused() -> None:
    with pytest.raises(InputError, match="no image and no video"):
        find_source([])
