"""Data sets whose records or identity were damaged: made again, or one line; never taken as they are."""

import io
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fogsim.dataset import read_png
from fogsim.dataset.directory import IDENTITY, LAYERS, DatasetDirectory
from fogsim.errors import InputError

IDENTITY_OF_SET = {"seed": 0, "every": 1}
ENTRY = {"width": 4, "height": 4, "run": 0, "seed": 0, "step": 0}

DAMAGES: dict[str, bytes] = {
    "empty": b"",
    "cut off": b'{"image": {"width": 4, "height": 4, "run": 0, "seed": 0, "step"',
    "list": b"[]",
    "null": b"null",
    "number": b"3",
    "NaN": b'{"image": NaN, "annotations": []}',
    "deep": b"[" * 100_000,
    "not UTF-8": b'"\xff"',
    "no entry": b'{"annotations": []}',
    "another frame's": json.dumps({"image": ENTRY, "annotations": []}).encode(),
    **{
        f"run {run!r}": json.dumps({"image": ENTRY | {"run": run}, "annotations": []}).encode()
        for run in (None, True, "0", 0.5, -1, 10**9, [])
    },
    "annotations": json.dumps({"image": ENTRY, "annotations": [3]}).encode(),
}


@pytest.fixture
def directory(tmp_path: Path) -> DatasetDirectory:
    """A data set of one frame."""
    made = DatasetDirectory(tmp_path / "set", IDENTITY_OF_SET)
    made.write(0, dict.fromkeys(LAYERS, np.zeros((4, 4), np.uint8)), {"image": ENTRY, "annotations": []})
    made.close()
    return made


@pytest.mark.parametrize("kind", DAMAGES)
def test_a_damaged_record_is_not_there(directory: DatasetDirectory, kind: str) -> None:
    assert directory.has(0)
    (directory.path / "records" / "000000.json").write_bytes(DAMAGES[kind])
    assert not directory.has(0)
    with pytest.raises(InputError, match=r"000000\.json: damaged"):
        directory.record(0)


def test_an_image_that_was_cut_off_is_made_again(directory: DatasetDirectory) -> None:
    image = directory.path / "depth" / "000000.png"
    for size in (0, 5, 50):
        image.write_bytes(image.read_bytes()[:size])
        assert not directory.has(0)
        directory.write(0, dict.fromkeys(LAYERS, np.zeros((4, 4), np.uint8)), {"image": ENTRY, "annotations": []})
        assert directory.has(0)
    # A stray file among the records counts for nothing.
    (directory.path / "records" / "notes.json").write_text("{}", encoding="utf-8")
    assert directory.beyond(1) == 0


def test_a_damaged_identity_is_refused_in_one_line(directory: DatasetDirectory) -> None:
    for kind in ["empty", "cut off", "list", "null", "number", "NaN", "deep", "not UTF-8", "no entry"]:
        (directory.path / IDENTITY).write_bytes(DAMAGES[kind])
        with pytest.raises(InputError, match=f"^[^\n]*{directory.path}[^\n]*$"):
            DatasetDirectory(directory.path, IDENTITY_OF_SET)


def test_a_layer_that_is_no_image_is_refused(tmp_path: Path) -> None:
    pixels = np.random.default_rng(0).integers(0, 255, (64, 64, 4), np.uint8)
    whole, photo, clear = (io.BytesIO() for _ in range(3))
    Image.fromarray(pixels[..., :3]).save(whole, "PNG")
    Image.fromarray(pixels[..., :3]).save(photo, "JPEG")
    Image.fromarray(pixels).save(clear, "PNG")
    for data, message in [
        *((data, "expected a PNG file") for data in (b"", b"no image", whole.getvalue()[:-30], photo.getvalue())),
        (whole.getvalue()[:100] + whole.getvalue()[-12:], "this PNG file is damaged"),
        (clear.getvalue(), "expected a grey or colour image"),
    ]:
        (tmp_path / "x.png").write_bytes(data)
        with pytest.raises(InputError, match=rf"x\.png: {message}"):
            read_png(tmp_path / "x.png")
    (tmp_path / "x.png").write_bytes(whole.getvalue() + b"more")
    assert np.array_equal(read_png(tmp_path / "x.png"), pixels[..., :3])
