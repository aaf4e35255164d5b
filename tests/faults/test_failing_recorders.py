"""Recorders that fail on the way or at the end, and what the others keep."""

import json
import os
import signal
from pathlib import Path

import pytest
from pyarrow import parquet

import fogsim
from fogsim.errors import InputError, RecorderError
from fogsim.recorders import RECORDERS, ReportRecorder, video
from fogsim.simulation import recording
from fogsim.simulation.recording import RecordedRun, record_run
from fogsim.values import Step
from tests.faults.steps import drawn_run

STEPS = 30


@pytest.fixture(autouse=True)
def drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recording, "run", lambda *_, **__: drawn_run(STEPS))


def record(out: Path, **options: object) -> RecordedRun:
    return record_run(fogsim.load_scenario("motorway_fog_bank"), 1, out, **options)  # type: ignore[arg-type]


def manifest(out: Path) -> dict[str, object]:
    content: dict[str, object] = json.loads((out / "manifest.json").read_text(encoding="utf-8"))
    return content


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


def test_an_encoder_that_dies_ends_the_run_and_costs_only_the_video(tmp_path: Path, encoders: list[int]) -> None:
    def kill(step: Step) -> None:
        if step.index == 5:
            os.kill(encoders[0], signal.SIGKILL)

    with pytest.raises(RecorderError, match=r"the recorder video failed: FogSimError: the video encoder has ended"):
        record(tmp_path, recorders=("table", "video"), watch=kill)
    told = manifest(tmp_path)
    assert told["status"] == "failed"
    assert list(told["failed_recorders"]) == ["video"]  # type: ignore[call-overload]  # a mapping
    assert str(told["message"]).startswith("video: FogSimError: the video encoder has ended")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["manifest.json", "metrics.json", "steps.parquet"]
    assert len(parquet.read_table(tmp_path / "steps.parquet")) >= 6


def test_an_encoder_that_dies_at_the_end_is_told_too(tmp_path: Path, encoders: list[int]) -> None:
    def kill(step: Step) -> None:
        if step.index == STEPS - 1:
            os.kill(encoders[0], signal.SIGKILL)

    with pytest.raises(RecorderError, match=r"the recorder video failed: FogSimError: the video could not be written"):
        record(tmp_path, recorders=("table", "video"), watch=kill)
    assert manifest(tmp_path)["status"] == "failed"
    assert len(parquet.read_table(tmp_path / "steps.parquet")) == STEPS
    assert not list(tmp_path.rglob("*.part"))


def test_an_encoder_that_was_stopped_is_not_waited_for_for_ever(
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


def test_ctrl_c_while_a_whole_run_is_closed_makes_it_partial(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    close = ReportRecorder.close

    def interrupted(recorder: ReportRecorder, complete: bool) -> None:
        if complete:
            os.kill(os.getpid(), signal.SIGINT)
        close(recorder, complete)

    monkeypatch.setattr(ReportRecorder, "close", interrupted)
    done = record(tmp_path, recorders=("table", "report"))
    assert (done.status, manifest(tmp_path)["status"]) == ("interrupted", "interrupted")
    assert "PARTIAL" in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert parquet.read_schema(tmp_path / "steps.parquet").metadata[b"fogsim.complete"] == b"false"
    assert json.loads((tmp_path / "metrics.json").read_text(encoding="utf-8"))["complete"] is False
    assert len(parquet.read_table(tmp_path / "steps.parquet")) == STEPS


def test_ctrl_c_twice_while_a_run_is_closed_tears_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    close = ReportRecorder.close

    def interrupted(recorder: ReportRecorder, complete: bool) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        close(recorder, complete)

    monkeypatch.setattr(ReportRecorder, "close", interrupted)
    # The second is held until everything is written, and handled then.
    with pytest.raises(KeyboardInterrupt):
        record(tmp_path, recorders=("table", "report"))
    assert manifest(tmp_path)["status"] == "interrupted"
    assert manifest(tmp_path)["files"] == ["manifest.json", "metrics.json", "report.html", "steps.parquet"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_recorder_without_a_method_is_named_before_the_run_begins(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(RECORDERS._entries, "mine", lambda _: object())
    with pytest.raises(InputError, match=r"^recorder 'mine': its factory must return .* record\(\) and close\(\)"):
        record(tmp_path / "out", recorders=("table", "mine"))
    assert not (tmp_path / "out").exists()
