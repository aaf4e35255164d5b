"""Image files of each format: what is written is read again unchanged, or refused."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from fogsim.errors import InputError
from fogsim.offline.image_files import IMAGE_ENDINGS, Pixels, read_image, refuse_unwritable_image, write_image

ROWS, COLS = 24, 40
LOSS = 12  # of JPEG
LEVELS = np.linspace(0, 255, ROWS * COLS).reshape(ROWS, COLS)
GREY = LEVELS.astype(np.uint8)
COLOURED = np.stack([GREY, GREY // 2, 255 - GREY], axis=2)
TRANSPARENT = np.dstack([COLOURED, GREY.T.reshape(ROWS, COLS)])
KINDS: dict[str, Pixels] = {
    "grey": GREY,
    "coloured": COLOURED,
    "transparent": TRANSPARENT,
    **{
        f"deep {name}": image.astype(np.uint16) * 257 - image
        for name, image in (("grey", GREY), ("coloured", COLOURED))
    },
    "deep transparent": TRANSPARENT.astype(np.uint16) * 256,
}
DEEP = {name for name in KINDS if name.startswith("deep")}
CLEAR = {"transparent", "deep transparent"}
REFUSED: dict[str, set[str]] = {
    ".png": set(),
    ".tif": set(),
    ".tiff": set(),
    ".jpg": DEEP | CLEAR,
    ".jpeg": DEEP | CLEAR,
    ".bmp": DEEP,
    ".webp": DEEP,
    ".pgm": {"coloured", "deep coloured", *CLEAR},
    ".ppm": CLEAR,
}


@pytest.mark.parametrize("ending", IMAGE_ENDINGS)
def test_an_image_is_written_unchanged_or_refused(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], ending: str
) -> None:
    loss = LOSS if ending in {".jpg", ".jpeg"} else 0
    for name, image in KINDS.items():
        path = tmp_path / f"{name}{ending}"
        if name in REFUSED[ending]:
            with pytest.raises(
                InputError, match=rf"an image (of|with) .* can be written as .*\.png.*, not as {ending}"
            ):
                write_image(path, image)
            assert not path.exists()
            continue
        write_image(path, image)
        found = read_image(path)
        assert found.dtype == image.dtype
        # Some formats have colours only.
        same = found[..., 0] if image.ndim < found.ndim else found
        assert np.abs(same.astype(int) - image).max() <= loss, name
    assert capfd.readouterr().err == ""


def test_transparency_that_shows_nothing_is_left_out(tmp_path: Path) -> None:
    for ending in (".jpg", ".ppm"):
        write_image(tmp_path / f"opaque{ending}", np.dstack([COLOURED, np.full_like(GREY, 255)]))
        assert np.abs(read_image(tmp_path / f"opaque{ending}").astype(int) - COLOURED).max() <= LOSS


def test_an_image_that_is_too_wide_for_its_format_is_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(InputError, match=r"an image of 17000 × 1 pixels cannot be written as \.webp"):
        write_image(tmp_path / "wide.webp", np.zeros((1, 17_000), np.uint8))
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("ending", [".pbm", ".pnm", ".ras", ".sr", ".gif", ".hdr", ".pfm", ".pic", ".jp2", ".avif", ""])
def test_formats_that_change_pixels_are_not_written(tmp_path: Path, ending: str) -> None:
    with pytest.raises(InputError, match=r"no image can be written with the ending .*; allowed: \.png, .*, \.ppm$"):
        refuse_unwritable_image(tmp_path / f"image{ending}", "--out")


@pytest.mark.parametrize(("most", "is_read"), [(100, False), (255, True), (1000, False), (4095, True), (65535, True)])
def test_the_largest_value_of_a_pgm_is_a_full_scale(tmp_path: Path, most: int, is_read: bool) -> None:
    path, values = tmp_path / "grey.pgm", np.linspace(0, most, 20).astype(">u2" if most > 255 else np.uint8)
    path.write_bytes(b"P5 # made by hand\n# 7 8 9\n5 4\n%d\n" % most + values.tobytes())
    if is_read:
        assert np.array_equal(read_image(path).ravel(), values)
        return
    with pytest.raises(InputError, match=f"expected a largest value of 255, 1023, 4095, 65535 .*, got {most}"):
        read_image(path)


@pytest.mark.parametrize(
    ("header", "most", "is_read"),
    [("P2\n2 1\n{}", 100, True), ("P3 2 1 {}", 255, True), ("P2 2 1 {}", 4095, True), ("P2 2 1 {}", 16383, False)]
    + [("P7\nWIDTH 2\nHEIGHT 1\nDEPTH 1\nMAXVAL {}\nENDHDR", most, most == 255) for most in (100, 255)],
)
def test_the_largest_value_of_other_headers(tmp_path: Path, header: str, most: int, is_read: bool) -> None:
    path, values = tmp_path / "grey.pnm", b"d1" if "P7" in header else b" ".join([b"100", b"49"] * 3)
    path.write_bytes(header.format(most).encode() + b"\n" + values + b"\n")
    if is_read:
        assert read_image(path).ravel()[0] == (255 if most == 100 else 100)
        return
    with pytest.raises(InputError, match=f"expected a largest value of 255, 1023, 4095, 65535 .*, got {most}"):
        read_image(path)


@pytest.mark.parametrize("compression", ["raw", "tiff_lzw"])
def test_colours_of_a_tiff_are_as_they_are_whatever_their_opacity(tmp_path: Path, compression: str) -> None:
    path, turned = tmp_path / "image.tif", Image.Exif()
    for turned[0x0112] in (1, 3):
        Image.fromarray(TRANSPARENT).save(path, compression=compression, exif=turned)
        expected = TRANSPARENT if turned[0x0112] == 1 else TRANSPARENT[::-1, ::-1]
        assert np.array_equal(read_image(path)[..., (2, 1, 0, 3)], expected)


def test_they_are_read(tmp_path: Path) -> None:
    for ending in (".pnm", ".ras", ".sr"):
        cv2.imwrite(str(tmp_path / f"image{ending}"), COLOURED)
        assert np.array_equal(read_image(tmp_path / f"image{ending}"), COLOURED)
    bits = np.where(GREY > 100, 255, 0).astype(np.uint8)
    cv2.imwrite(str(tmp_path / "image.pbm"), bits)
    assert np.array_equal(read_image(tmp_path / "image.pbm"), bits)
    cv2.imwrite(str(tmp_path / "image.gif"), COLOURED)
    assert read_image(tmp_path / "image.gif").shape[:2] == GREY.shape


@pytest.mark.parametrize("kind", ["grey", "deep grey"])
def test_white_is_zero_if_a_tiff_says_so(tmp_path: Path, kind: str) -> None:
    path, image = tmp_path / "image.tif", KINDS[kind]
    Image.fromarray(image).save(path)
    black_is_zero = bytes.fromhex("0601 0300 01000000 0100")  # PhotometricInterpretation
    assert path.read_bytes().count(black_is_zero) == 1
    path.write_bytes(path.read_bytes().replace(black_is_zero, black_is_zero[:-2] + bytes(2)))
    np.testing.assert_array_equal(read_image(path), np.iinfo(image.dtype).max - image)
