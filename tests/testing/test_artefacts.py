"""What is kept of a failure: a video around it and a plot of what was looked at."""

import re
from collections.abc import Iterator
from pathlib import Path

import cv2
import pytest
from early_motorway import ROUTES
from made_up_cases import finding
from matplotlib.figure import Figure

from fogsim.scenario import Scenario, load_scenario
from fogsim.study.drawing import svg_of
from fogsim.testing import artefacts
from fogsim.testing.artefacts import AFTER, BEFORE, KeepFailures
from fogsim.testing.results import finding_from_json
from fogsim.values import Step
from tests.recorders.synthetic import drive

EXPECTED = """
expect:
  safe: {always: ego.ttc >= 1.5 s, while: ego.speed > 10 km/h}
  told: {whenever: advice falls below 100 km/h, require: ego.lane == right}
"""


@pytest.fixture
def scenario(tmp_path: Path) -> Scenario:
    net = ROUTES.parents[2] / "scenarios" / "motorway_fog_bank" / "motorway.net.xml"
    file = tmp_path / "a.fog.yaml"
    traffic = f"traffic: {{net: {net}, routes: [{ROUTES}], ego: ego}}"
    file.write_text(f"name: a\n{traffic}\nfog: {{visibility: 80 m}}\n{EXPECTED}")
    return load_scenario(file)


def test_a_name_is_drawn_as_it_is() -> None:
    figure = Figure()
    figure.subplots().set_ylabel("agent $^$")
    assert "agent $^$" in svg_of(figure, "a")


def test_a_failure_has_a_plot_and_a_video(scenario: Scenario, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    steps: list[Step] = []

    def pretend(_: Scenario, seed: int) -> Iterator[Step]:
        assert seed == 5
        for step in drive():
            steps.append(step)
            yield step

    monkeypatch.setattr(artefacts, "run", pretend)
    period = scenario.clocks.camera_period_s
    failures = [finding("failed", time=8.0), finding("failed", "told", "whenever", time=8.5)]
    work = KeepFailures({"a": tuple(finding_from_json(one) for one in failures)})
    assert work(scenario, 5, tmp_path / "a") == {"status": "complete"}
    assert 8.5 + AFTER <= steps[-1].time < 8.5 + AFTER + 1.5 * period
    video = cv2.VideoCapture(str(tmp_path / "a" / "video.mp4"))
    shown = sum(8.0 - BEFORE <= step.time <= 8.0 + AFTER for step in steps)
    assert video.get(cv2.CAP_PROP_FRAME_COUNT) == shown
    assert video.get(cv2.CAP_PROP_FPS) == pytest.approx(1.0 / period)
    video.release()
    plot = (tmp_path / "a" / "told.whenever.svg").read_text(encoding="utf-8")
    assert plot.startswith("<?xml")
    for told in ("told.whenever", "ego.lane", "advice", "100 km/h", r"[km/h]"):
        assert f"<!-- {told} -->" in plot
    assert not re.search(r"ego\.ttc", plot)
    assert (tmp_path / "a" / "safe.always.svg").is_file()


def test_what_goes_wrong_does_no_harm(scenario: Scenario, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(_: Scenario, __: int) -> Iterator[Step]:
        raise RuntimeError("no more")

    monkeypatch.setattr(artefacts, "run", broken)
    work = KeepFailures({"a": (finding_from_json(finding("failed")),)})
    message = "RuntimeError: no more (test_artefacts.py:73)"
    assert work(scenario, 0, tmp_path / "a") == {"status": "failed", "message": message}


def test_a_video_is_closed_if_its_run_fails(
    scenario: Scenario, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def breaks(_: Scenario, __: int) -> Iterator[Step]:
        yield next(iter(drive()))
        raise RuntimeError("no more")

    monkeypatch.setattr(artefacts, "run", breaks)
    work = KeepFailures({"a": (finding_from_json(finding("failed", time=0.0)),)})
    assert work(scenario, 0, tmp_path / "a")["message"].startswith("RuntimeError: no more")
    assert [path.name for path in (tmp_path / "a").iterdir()] == ["video.mp4"]
