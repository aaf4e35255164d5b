"""The figure over a clip."""

import io
import os

import pytest

from fogsim.offline.clip_summary import Clip
from fogsim.offline.estimation import FrameEstimates
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
