"""The figure over a clip."""

import io
import os
from dataclasses import replace

import pytest

from fogsim.offline.clip_summary import Clip
from fogsim.offline.estimation import FrameEstimates
from fogsim.offline.input_paths import find_source
from fogsim.offline.source import Picture
from fogsim.values import Estimate


@pytest.mark.parametrize("name", ["drive_$DATE_$TIME.mkv", os.fsdecode(b"m\xfcnchen.mkv")])
def test_a_title_is_any_file_name(name: str) -> None:
    clip = Clip(("joint_road",))
    for frame in range(2):
        clip.add(FrameEstimates(Picture(frame, 0.1 * frame, None), (Estimate("joint_road", 0.02, 0.001),)))
    drawn = io.BytesIO()
    clip.plot(name).savefig(drawn, format="svg")
    assert drawn.getvalue()


def test_an_answer_without_a_number_or_a_reason_counts_as_none() -> None:
    clip = Clip(("mine",))
    for frame in range(3):
        clip.add(FrameEstimates(Picture(frame, 0.1 * frame, None), (Estimate.invalid("mine", ""),)))
    text = "\n".join(clip.lines())
    assert "at the end     no estimate: no reason given" in text
    assert "valid          0 of 3 frames" in text
    assert "nan" not in text


@pytest.mark.parametrize(("factor", "said"), [(1.0, ""), (1.0 / 1.8, "too low"), (1.8, ""), (3.0, "too high")])
def test_lanes_of_an_impossible_width_say_that_the_height_is_wrong(drive, factor: float, said: str) -> None:
    """Where a line is missed, lanes seem twice as wide: only what is beyond that counts."""
    clip = Clip((), replace(drive.camera, mount_height=factor * drive.camera.mount_height))
    for picture in find_source(drive.folder / "images").pictures():
        clip.add(FrameEstimates(picture, ()))
    remarks = list(clip.remarks())
    assert len(remarks) == bool(said)
    assert all(f"mount_height_m is {said}" in remark for remark in remarks)
