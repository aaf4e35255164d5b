"""Recorders that fail on the way or at the end, and what the others keep."""

import contextlib
import json
import os
import signal
from pathlib import Path
from typing import Any

import pytest
from pyarrow import parquet

import fogsim
from fogsim.errors import InputError, RecorderError
from fogsim.recorders import RECORDERS, ReportRecorder, video
from fogsim.simulation import recording
from fogsim.simulation.recording import RecordedRun, record_run
from fogsim.values import Step
from tests.faults.steps import drawn_run

STEPS = 12


@pytest.fixture(autouse=True)
def drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recording, "run", lambda *_, **__: drawn_run(STEPS))


def record(out: Path, **options: object) -> RecordedRun:
    return record_run(fogsim.load_scenario("motorway_fog_bank"), 1, out, **options)  # type: ignore[arg-type]


def manifest(out: Path) -> dict[str, Any]:
    return json.loads((out / "manifest.json").read_text(encoding="utf-8"))


@pytest.fixture
def encoders(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Process ids of the encoders that are started."""
    ids: list[int] = []
    start = video.Encoder.__init__

    def started(encoder: video.Encoder, command: list[str]) -> None:
        start(encoder, command)
        ids.append(encoder._process.pid)

    monkeypatch.setattr(video.Encoder, "__init__", started)
    return ids


@pytest.mark.parametrize(
    ("index", "why"), [(5, "the video encoder has ended"), (STEPS - 1, "the video could not be written")]
)
def test_an_encoder_that_dies_ends_the_run_and_its_video(
    tmp_path: Path, encoders: list[int], index: int, why: str
) -> None:
    def kill(step: Step) -> None:
        if step.index == index:
            os.kill(encoders[0], signal.SIGKILL)

    with pytest.raises(RecorderError, match=f"the recorder video failed: FogSimError: {why}"):
        record(tmp_path, recorders=("table", "video"), watch=kill)
    found = manifest(tmp_path)
    assert (found["status"], [*found["failed_recorders"]]) == ("failed", ["video"])
    assert found["message"].startswith(f"video: FogSimError: {why}")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["manifest.json", "metrics.json", "steps.parquet"]
    assert len(parquet.read_table(tmp_path / "steps.parquet")) >= index + 1


def test_a_stopped_encoder_is_killed_in_time(
    tmp_path: Path, encoders: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(video, "CLOSING_LIMIT", 0.1)

    def stop(step: Step) -> None:
        if step.index == 5:
            os.kill(encoders[0], signal.SIGSTOP)
            raise KeyboardInterrupt

    with pytest.raises(RecorderError, match=r"the video encoder did not end within 0\.1 s, and was killed"):
        record(tmp_path, recorders=("table", "video"), watch=stop)
    assert manifest(tmp_path)["status"] == "interrupted"


@pytest.mark.parametrize("again", [False, True])
def test_ctrl_c_while_a_run_is_closed_makes_it_partial(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, again: bool
) -> None:
    close = ReportRecorder.close

    def interrupted(recorder: ReportRecorder, complete: bool) -> None:
        if complete or again:
            os.kill(os.getpid(), signal.SIGINT)
        close(recorder, complete)

    monkeypatch.setattr(ReportRecorder, "close", interrupted)
    # The second is held until everything is written, and handled then.
    with pytest.raises(KeyboardInterrupt) if again else contextlib.nullcontext():
        assert record(tmp_path, recorders=("table", "report")).status == "interrupted"
    found = manifest(tmp_path)
    assert found["status"] == "interrupted"
    assert found["files"] == ["manifest.json", "metrics.json", "report.html", "steps.parquet"]
    assert "PARTIAL" in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert parquet.read_schema(tmp_path / "steps.parquet").metadata[b"fogsim.complete"] == b"false"
    assert json.loads((tmp_path / "metrics.json").read_text(encoding="utf-8"))["complete"] is False
    assert len(parquet.read_table(tmp_path / "steps.parquet")) == STEPS
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_recorder_without_a_method_is_named_before_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(RECORDERS._entries, "mine", lambda _: object())
    with pytest.raises(InputError, match=r"^recorder 'mine': its factory must return .* record\(\) and close\(\)"):
        record(tmp_path / "out", recorders=("table", "mine"))
    assert not (tmp_path / "out").exists()
