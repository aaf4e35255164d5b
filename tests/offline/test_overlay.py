"""Overlays: what is drawn where, and files that are whole or not there."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fogsim.errors import InputError
from fogsim.offline import FrameEstimates, OverlayFile, Picture, estimates_of, find_source
from fogsim.offline.overlay import Overlay
from fogsim.recorders.style import method_colours
from fogsim.values import Estimate


def test_rows_and_band_are_drawn_where_they_were_found(drive) -> None:
    image = np.full((480, 640, 3), 90, np.uint8)
    found = {"horizon_row": 100.0, "inflection_row": 150.0, "band": (300, 320, 90, 479)}
    result = FrameEstimates(Picture(0, 0.0, image), (Estimate("negru2013", 0.02, 0.001, diagnostics=found),))
    drawn = np.asarray(Overlay(drive.camera, ["negru2013"]).draw(result))
    colour = np.array(method_colours(["negru2013"])["negru2013"])
    coloured = np.all(drawn[:480] == colour, axis=2)
    assert set(np.flatnonzero(coloured[:, 10])) <= {99, 100, 101, 149, 150, 151}
    assert coloured[100, 2]
    assert coloured[150, 2]
    assert not coloured[100, 18]  # the horizon is dashed
    assert coloured[300, 300]
    assert coloured[300, 320]
    assert np.all(drawn[300, 310] == 90)


def test_methods_that_agree_are_all_seen(drive) -> None:
    image = np.full((480, 640, 3), 90, np.uint8)
    rows = {"negru2013": (100.0, 150.0), "zhu2015": (100.4, 150.2), "joint_road": (99.7, 220.0)}
    found = [
        Estimate(name, 0.02, 0.001, diagnostics={"horizon_row": horizon, "inflection_row": inflection})
        for name, (horizon, inflection) in rows.items()
    ]
    drawn = np.asarray(Overlay(drive.camera, list(rows)).draw(FrameEstimates(Picture(0, 0.0, image), tuple(found))))
    for name, colour in method_colours(list(rows)).items():
        of_method = np.all(drawn[:480] == colour, axis=2)
        alone = name == "joint_road"
        # A quarter of the line at the least for each of those who share it, and all of it where it is one's own.
        assert of_method[96:104].any(axis=0).mean() > 0.15
        assert of_method[218:223].any(axis=0).mean() > 0.9 if alone else of_method[146:154].any(axis=0).mean() > 0.4


def test_an_invalid_estimate_draws_nothing_on_the_image(drive) -> None:
    image = np.full((480, 640, 3), 90, np.uint8)
    refused = Estimate.invalid("negru2013", "the road is hidden", horizon_row=100.0, band=(1, 9, 1, 9))
    drawn = np.asarray(Overlay(drive.camera, ["negru2013"]).draw(FrameEstimates(Picture(0, 0.0, image), (refused,))))
    assert np.all(drawn[:480] == 90)
    assert np.any(drawn[480:] > 90)


@pytest.mark.parametrize(("width", "height"), [(16, 16), (161, 121), (1921, 1081)])
def test_every_camera_gets_a_size_that_a_video_can_have(drive, width: int, height: int) -> None:
    camera = replace(drive.camera, width=width, height=height)
    overlay = Overlay(camera, ["a", "b"])
    assert overlay.size[0] % 2 == overlay.size[1] % 2 == 0
    assert 640 <= overlay.size[0] <= 1280
    for bits in (np.uint8, np.uint16):
        result = FrameEstimates(Picture(0, 0.0, np.zeros((height, width), bits)), ())
        assert overlay.draw(result).size == overlay.size


def written(path: str | Path, source, drive, **options) -> None:
    with OverlayFile(path, source, drive.camera, ["negru2013"], **options) as overlay:
        for result in estimates_of(source, drive.camera, ["negru2013"]):
            overlay.add(result)


def test_a_video_has_a_frame_for_each_of_its_frames(drive, tmp_path: Path) -> None:
    source = find_source(drive.folder / "drive.mp4")
    for name in ("a.mp4", "b.mp4"):
        written(tmp_path / name, source, drive)
    frames = find_source(tmp_path / "a.mp4")
    assert frames.size == (640, 540)
    assert frames.period == pytest.approx(0.1)
    assert len(list(frames.pictures())) == len(drive.frames)
    assert (tmp_path / "a.mp4").read_bytes() == (tmp_path / "b.mp4").read_bytes()
    assert sorted(one.name for one in tmp_path.iterdir()) == ["a.mp4", "b.mp4"]


def test_stills_are_shown_one_after_another(drive, tmp_path: Path) -> None:
    for index, name in enumerate("acb"):
        Image.fromarray(drive.frames[index]).save(tmp_path / f"{name}.png")
    written(tmp_path / "out.mp4", find_source(tmp_path, rate=2.0), drive)
    assert [one.time for one in find_source(tmp_path / "out.mp4").pictures()] == pytest.approx([0.0, 0.5, 1.0])
    written(tmp_path / "video.mp4", find_source(drive.folder / "drive.mp4", sequence=False), drive)
    times = [one.time for one in find_source(tmp_path / "video.mp4").pictures()]
    assert times == pytest.approx([0.1 * index for index in range(len(drive.frames))])


def test_a_still_is_a_picture(drive, tmp_path: Path) -> None:
    written(str(tmp_path / "a.png"), find_source(drive.folder / "images" / "003.png"), drive)
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.size == (640, 540)
    assert [one.name for one in tmp_path.iterdir()] == ["a.png"]


def test_an_error_leaves_no_file(drive, tmp_path: Path) -> None:
    source = find_source(drive.folder / "images")

    def fail() -> None:
        with OverlayFile(tmp_path / "a.mp4", source, drive.camera, ["negru2013"]) as overlay:
            overlay.add(next(estimates_of(source, drive.camera, ["negru2013"])))
            raise RuntimeError("boom")

    with pytest.raises(RuntimeError, match="boom"):
        fail()
    assert list(tmp_path.iterdir()) == []


def test_mistakes_are_told_before_anything_is_read(drive, tmp_path: Path) -> None:
    for name, told in [
        ("a.gif", "ends in .mp4, .png or .jpg, got .gif"),
        ("a", "got no ending"),
        ("a.png", "a picture holds one image"),
        ("nowhere/a.mp4", "there is no folder"),
        ("there.mp4", "already exists"),
    ]:
        (tmp_path / "there.mp4").write_bytes(b"mine")
        with pytest.raises(InputError, match=told):
            OverlayFile(tmp_path / name, find_source(drive.folder / "images"), drive.camera, ["negru2013"])
        assert (tmp_path / "there.mp4").read_bytes() == b"mine"


def test_what_is_read_is_never_replaced(drive, tmp_path: Path) -> None:
    path = tmp_path / "drive.mp4"
    path.write_bytes((drive.folder / "drive.mp4").read_bytes())
    with pytest.raises(InputError, match="would replace what is read"):
        OverlayFile(path, find_source(path), drive.camera, ["negru2013"], overwrite=True)
