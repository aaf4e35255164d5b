"""The page on FogSim as a library: its two blocks run, and the estimates are of the fog that they set."""

import re
from pathlib import Path

import pytest

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "how_to" / "library.md").read_text(encoding="utf-8")
STAGES, LOOP = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
VISIBILITY = 80.0


def test_the_stages_make_an_image_in_which_the_fog_is_read(capsys: pytest.CaptureFixture[str]) -> None:
    exec(STAGES, {})  # noqa: S102 - what the page prints
    printed = capsys.readouterr().out.strip()
    assert f"It prints {printed}." in PAGE
    assert float(printed.removesuffix(" m")) == pytest.approx(VISIBILITY, rel=0.05)


def test_the_loop_runs_without_a_scenario(capsys: pytest.CaptureFixture[str]) -> None:
    exec(LOOP, {})  # noqa: S102 - what the page prints
    lines = re.findall(r"([\d.]+) s: visibility (\d+) m, advice (\S+) km/h", capsys.readouterr().out)
    assert [float(time) for time, *_ in lines] == pytest.approx([0.1 * i for i in range(21)])
    assert [float(visibility) for _, visibility, _ in lines] == pytest.approx([VISIBILITY] * 21, rel=0.05)
    assert {float(advice) for *_, advice in lines[1:]} == {50.0}
