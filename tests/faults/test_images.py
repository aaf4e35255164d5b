"""Images, videos and depth maps that are broken: told in one line, passed over, and nothing else is lost."""

import io
import itertools
import json
import pickle
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fogsim.errors import InputError
from fogsim.estimators import ESTIMATORS
from fogsim.offline.image_files import DepthMap, read_distance, read_image
from fogsim.values import Camera
from tests.helpers.camera_files import camera_yaml
from tests.helpers.command import Command

ROWS, COLS = 60, 80
CAMERA = Camera(COLS, ROWS, 70.0, (39.5, 29.5), 1.3)
CAMERA_YAML = camera_yaml((COLS, ROWS), 70, response="")


def picture(kind: str) -> bytes:
    """A noisy image, encoded."""
    buffer = io.BytesIO()
    Image.fromarray(np.random.default_rng(0).integers(0, 255, (ROWS, COLS), np.uint8)).save(buffer, kind)
    return buffer.getvalue()


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def header_of(size: int) -> bytes:
    """A PNG that says to be of so many rows and columns, and has nothing in it."""
    header = struct.pack(">IIBBBBB", size, size, 8, 2, 0, 0, 0)
    parts = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(b"")) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + parts


def with_an_error(data: bytes) -> bytes:
    middle = len(data) // 2
    return data[:middle] + bytes([data[middle] ^ 255]) + data[middle + 1 :]


BROKEN: dict[str, bytes] = {
    "empty.png": b"",
    "text.png": b"no image",
    "header.png": header_of(60_000),
    "hollow.png": header_of(80),
    "flipped.png": with_an_error(picture("PNG")),
    **{f"cut.{end}": picture(kind)[:-1000] for end, kind in (("png", "PNG"), ("bmp", "BMP"), ("pgm", "PPM"))},
    "cut.jpg": picture("JPEG")[:-1000],
    "float.tif": b"",
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "300")
    (tmp_path / "camera.yaml").write_text(CAMERA_YAML, encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize("as_json", [True, False])
def test_broken_images_in_a_folder_are_listed_at_the_end(command: Command, folder: Path, as_json: bool) -> None:
    (folder / "drive").mkdir()
    for name, data in BROKEN.items():
        (folder / "drive" / name).write_bytes(data)
    Image.fromarray(np.zeros((ROWS, COLS), np.float32)).save(folder / "drive" / "float.tif")
    for name in ("0.png", "z.png"):
        (folder / "drive" / name).write_bytes(picture("PNG"))
    options = ("--camera", "camera.yaml", "--method", "negru2013", *(["--json"] if as_json else []))
    code, out, err = command("estimate", "drive", *options)
    assert code == 2
    last = err[err.index("error: 10 of the images could not be used:") :].splitlines()
    assert sorted(line.split(":")[0].strip() for line in last[1:]) == sorted(f"drive/{name}" for name in BROKEN)
    if as_json:
        records = [json.loads(line) for line in out.splitlines()]
        assert len(records) == len(BROKEN) + 2
        assert [record["frame"] for record in records if "method" in record] == ["drive/0.png", "drive/z.png"]
        assert all({*record} == {"frame", "time_s", "error"} for record in records if "method" not in record)
        assert "passed over: drive/text.png: this is no image" in err


def saved(value: object, **options: bool) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, value, **options)
    return buffer.getvalue()


HUGE = "{'descr': '<f8', 'fortran_order': False, 'shape': (4611686018427387904,), }"
"""More than any memory."""
DEPTHS: dict[str, bytes] = {
    "objects": saved(np.array([[None, {}]], dtype=object), allow_pickle=True),
    "pickle": pickle.dumps({"depth": 3}),
    "text": b"1.0 2.0 3.0\n",
    "nothing": b"",
    "records": saved(np.zeros((ROWS, COLS), dtype=[("depth", float)])),
    "words": saved(np.full((ROWS, COLS), "far")),
    "complex": saved(np.ones((ROWS, COLS), complex)),
    "shape": saved(np.ones((COLS, ROWS))),
    "number": saved(np.float64(3.0)),
    "cut": saved(np.ones((ROWS, COLS)))[:-100],
    "bracket": saved(np.ones((ROWS, COLS))).replace(b"80)", b"80,"),
    "archive": b"PK\x03\x04 and no more",
    "endless": saved(np.ones((2, 2))).replace(b"(2, 2)", b"(2**60,)"),
    "negative": saved(np.full((ROWS, COLS), -1.0)),
    "nan": saved(np.full((ROWS, COLS), np.nan)),
    "huge": b"\x93NUMPY\x01\x00" + struct.pack("<H", 118) + HUGE.ljust(117).encode() + b"\n",
}


def test_a_depth_map_that_is_none_is_told_in_one_line(tmp_path: Path) -> None:
    for name, content in DEPTHS.items():
        path = tmp_path / f"{name}.npy"
        path.write_bytes(content)
        with pytest.raises(InputError, match=path.name) as told:
            read_distance(DepthMap(path, "planar"), CAMERA)
        assert len(str(told.value).splitlines()) == 1


def test_a_tiff_that_is_cut_off_makes_no_library_print(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    whole, path = io.BytesIO(), tmp_path / "cut.tif"
    Image.fromarray(np.random.default_rng(0).integers(0, 255, (60, 80, 3), dtype=np.uint8)).save(whole, "TIFF")
    path.write_bytes(whole.getvalue()[: len(whole.getvalue()) // 2])
    with pytest.raises(InputError, match=r"cut\.tif: "):
        read_image(path)
    assert capfd.readouterr() == ("", "")


def encoded(image: Image.Image, kind: str, **options: object) -> bytes:
    buffer = io.BytesIO()
    image.save(buffer, kind, **options)
    return buffer.getvalue()


COLOURS = Image.fromarray(np.random.default_rng(1).integers(0, 255, (ROWS, COLS, 3), np.uint8))
DEEP = Image.fromarray(np.random.default_rng(2).integers(0, 65535, (ROWS, COLS)).astype(np.uint16))
READABLE: dict[str, bytes] = {
    "palette.png": encoded(COLOURS.convert("P"), "PNG"),
    "opacity.png": encoded(COLOURS.convert("LA"), "PNG"),
    "one_bit.png": encoded(COLOURS.convert("1"), "PNG"),
    "16_bit.png": encoded(DEEP, "PNG"),
    "cmyk.jpg": encoded(COLOURS.convert("CMYK"), "JPEG"),
    "cmyk.tif": encoded(COLOURS.convert("CMYK"), "TIFF"),
    "colours.webp": encoded(COLOURS, "WEBP"),
}
BOMB = b"BM" + struct.pack("<IHHIIiiHHIIiiII", 54, 0, 0, 54, 40, 40_000, 40_000, 1, 24, 0, 0, 0, 0, 0, 0)
TWO_FRAMES = encoded(COLOURS, "GIF", save_all=True, append_images=[COLOURS.rotate(180)])


def with_an_empty_page(tiff: bytes) -> bytes:
    """The number that follows the entries of a page is where the next one begins."""
    (page,) = struct.unpack_from("<I", tiff, 4)
    end = page + 2 + 12 * int.from_bytes(tiff[page : page + 2], "little")
    return tiff[:end] + struct.pack("<I", len(tiff)) + tiff[end + 4 :] + bytes(6)


UNREADABLE: dict[str, bytes] = {name: data for name, data in BROKEN.items() if name != "float.tif"} | {
    "cut.webp": READABLE["colours.webp"][:-1000],
    "pages.tif": with_an_empty_page(encoded(COLOURS, "TIFF")),
    "moving.gif": TWO_FRAMES[: TWO_FRAMES.rindex(struct.pack("<BHHHH", 0x2C, 0, 0, COLS, ROWS)) + 10],
    "cut.gif": encoded(COLOURS, "GIF")[:900],
    "whole.tif": encoded(Image.fromarray(np.zeros((ROWS, COLS), np.int32)), "TIFF"),
    "none.exr": b"v/1\x01" + bytes(100),
    "none.svg": b"<svg/>",
    "bomb.bmp": BOMB,
    "bomb.pgm": b"P5 100000 100000 255\n",
}
COMMANDS: dict[str, tuple[str, ...]] = {
    "estimate": ("--method", "negru2013", "--json"),
    "restore": ("--visibility", "60", "--out", "made.png"),
    "fog": ("--road-plane", "--visibility", "60", "--out", "made.png"),
    "fog by depth": ("--depth", "depth.npy", "--depth-kind", "range", "--visibility", "60", "--out", "made.png"),
}


def test_an_image_of_any_kind_is_read_or_named_in_one_line(command: Command, folder: Path) -> None:
    np.save(folder / "depth.npy", np.full((ROWS, COLS), 50.0))
    images = {**READABLE, **UNREADABLE}
    for (name, image), kind in zip(images.items(), itertools.cycle(COMMANDS), strict=False):
        (folder / name).write_bytes(image)
        code, _, err = command(kind.split(maxsplit=1)[0], name, "--camera", "camera.yaml", *COMMANDS[kind])
        if name in READABLE:
            assert code == 0, (name, err)
        else:
            assert code == 2, name
            assert sum(f"{name}: " in line for line in err.splitlines()) == 1, name
            assert not (folder / "made.png").exists(), name
        (folder / "made.png").unlink(missing_ok=True)


SMALL_COMMANDS: dict[str, tuple[str, ...]] = {
    "estimate": ("--method", "all", "--json"),
    "estimate by night": ("--night",),
    **{f"restore {name}": ("--method", name, "--out", "made.png") for name in ("dark_channel", "tarel2009")},
    "restore planar": ("--visibility", "60", "--most-gain", "1000", "--tone-map", "--out", "made.png"),
    "fog by depth": COMMANDS["fog by depth"],
}


@pytest.mark.parametrize(("rows", "cols"), [(1, 1), (2, 2), (3, 3), (1, 1000), (1000, 1)])
def test_a_tiny_image_is_worked_on(command: Command, folder: Path, rows: int, cols: int) -> None:
    Image.fromarray(np.random.default_rng(3).integers(0, 255, (rows, cols, 3), np.uint8)).save(folder / "tiny.png")
    np.save(folder / "depth.npy", np.full((rows, cols), 50.0))
    (folder / "tiny.yaml").write_text(camera_yaml((cols, rows), 70, (cols / 2, rows / 2), response=""))
    for kind, options in SMALL_COMMANDS.items():
        (folder / "made.png").unlink(missing_ok=True)
        code, out, err = command(kind.split(maxsplit=1)[0], "tiny.png", "--camera", "tiny.yaml", *options)
        assert code == 0, (kind, err)
        if kind == "estimate":
            assert [json.loads(line)["method"] for line in out.splitlines()] == list(ESTIMATORS)


@pytest.mark.parametrize("subject", [pytest.param("signs", marks=pytest.mark.nightly), "halos"])
def test_a_camera_of_one_pixel_cannot_be_calibrated(command: Command, folder: Path, subject: str) -> None:
    (folder / "tiny.yaml").write_text(camera_yaml((1, 1), 70, (0, 0), response=""))
    few = {"signs": ("--approaches", "4"), "halos": ("--scenes", "4")}
    code, _, err = command("calibrate", subject, "--camera", "tiny.yaml", *few[subject])
    assert code == 2
    assert len([line for line in err.splitlines() if line.startswith("error: ")]) == 1
