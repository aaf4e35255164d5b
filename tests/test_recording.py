"""What a recorded run leaves when something goes wrong."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from early_motorway import EARLY
from pyarrow import parquet

import fogsim
from fogsim.errors import FogSimError, InputError, RecorderError, SimulationError, UnknownNameError
from fogsim.recorders import ReportRecorder
from fogsim.scenario import Scenario
from fogsim.simulation.recording import record_run, record_traffic
from fogsim.values import Step


def short() -> Scenario:
    return fogsim.load_scenario("motorway_fog_bank", [EARLY, "camera.width=64", "camera.height=48", "duration_s=1"])


def status(out: Path) -> dict[str, object]:
    manifest: dict[str, object] = json.loads((out / "manifest.json").read_text(encoding="utf-8"))
    return manifest


def test_a_failing_run_leaves_what_was_recorded_and_says_why(tmp_path: Path) -> None:
    def fail(step: Step) -> None:
        if step.index == 4:
            raise SimulationError("the road is closed")

    with pytest.raises(SimulationError, match="the road is closed"):
        record_run(short(), 1, tmp_path / "out", watch=fail)
    assert status(tmp_path / "out")["status"] == "failed"
    assert status(tmp_path / "out")["message"] == "SimulationError: the road is closed"
    assert parquet.read_table(tmp_path / "out" / "steps.parquet").num_rows == 5


def test_the_metrics_of_a_run_are_its_summary_to_the_last_digit_and_the_same_again(tmp_path: Path) -> None:
    texts = []
    for out in (tmp_path / "one", tmp_path / "again"):
        summary = record_run(short(), np.int64(1), out, recorders=("table",)).summary
        texts.append((out / "metrics.json").read_text(encoding="utf-8"))
        assert json.loads(texts[-1]) == {"complete": True, **summary.to_json()}
    assert texts[0] == texts[1]


def test_one_recorder_that_cannot_finish_does_not_cost_the_others_their_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(ReportRecorder, "close", full)
    with pytest.raises(RecorderError, match=r"the recorder report failed: OSError: .*No space left.* is kept in"):
        record_run(short(), 1, tmp_path / "out")
    assert parquet.read_table(tmp_path / "out" / "steps.parquet").num_rows == 11
    metrics = json.loads((tmp_path / "out" / "metrics.json").read_text(encoding="utf-8"))
    assert metrics["complete"] is True
    # The scenario's advice counts with 2 s.
    assert (metrics["stopping_reaction_time_s"], metrics["stopping_deceleration_mps2"]) == (2.5, 3.4)
    manifest = status(tmp_path / "out")
    assert manifest["files"] == ["manifest.json", "metrics.json", "steps.parquet", "video.mp4"]
    assert manifest["status"] == "failed"
    assert manifest["message"] == "report: OSError: [Errno 28] No space left on device"
    assert manifest["failed_recorders"] == {"report": "OSError: [Errno 28] No space left on device"}


@pytest.mark.parametrize("kept", [False, True])
def test_a_scenario_that_cannot_start_leaves_nothing_of_its_own(tmp_path: Path, kept: bool) -> None:
    out = tmp_path / "runs" / "out"
    if kept:
        out.mkdir(parents=True)
        (out / "notes.txt").write_text("of the user", encoding="utf-8")
    settings = ["traffic.ego=nobody", "traffic.warm_up_limit_s=2"]
    scenario = fogsim.load_scenario("motorway_fog_bank", settings, others_add_vehicles=True)
    with pytest.raises(SimulationError, match="nobody"):
        record_run(scenario, 1, out)
    assert [path.name for path in tmp_path.rglob("*")] == (["runs", "out", "notes.txt"] if kept else [])


def test_mistakes_that_stop_a_run_before_its_first_step_leave_nothing(tmp_path: Path) -> None:
    for mistake, kind in [
        ({"seed": -1}, InputError),
        ({"seed": 1.5}, InputError),
        ({"recorders": ("table", "film")}, UnknownNameError),
    ]:
        with pytest.raises(kind):
            record_run(**{"scenario": short(), "seed": 1, "out": tmp_path / "new" / "out", **mistake})
        assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", [b"run:1", b"-x", b"run\xff"])
def test_odd_names_of_directories_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: bytes) -> None:
    monkeypatch.chdir(tmp_path)
    out = Path(os.fsdecode(name))
    blind = ("renderer=none", "estimators=[]")
    scenario = fogsim.load_scenario("motorway_fog_bank", [EARLY, *blind, "duration_s=0.2"])
    record_run(scenario, 1, out, recorders=("table",), command_line=("fogsim", "run", "--out", str(out)))
    assert [os.fsencode(entry.name) for entry in tmp_path.iterdir()] == [name]
    assert status(out)["command_line"] == ["fogsim", "run", "--out", str(out)]
    with (out / "steps.parquet").open("rb") as table:
        assert parquet.read_table(table).num_rows == 3


def without_ego(*settings: str) -> Scenario:
    nobody = ["traffic.ego=none", "estimators=[]", "lighting=low_beam", "traffic.events=[]", "fog={visibility_m: 60}"]
    clocks = ["clocks.traffic_step_s=0.5", "clocks.camera_period_s=0.5", "duration_s=2"]
    return fogsim.load_scenario("motorway_fog_bank", [EARLY, *nobody, *clocks, *settings])


def test_traffic_alone_is_recorded_the_same_again(tmp_path: Path) -> None:
    texts, tables = [], []
    recorders = ("report", "table", "trajectories")
    for out in (tmp_path / "one", tmp_path / "again"):
        scenario = without_ego("traffic.warm_up_s=10", 'traffic.along=["approach","bank"]')
        done = record_traffic(scenario, 1, out, recorders=recorders)
        assert done.files == ("manifest.json", "metrics.json", "report.html", "steps.parquet", "trajectories.parquet")
        assert "Over the road of traffic.along" in (out / "report.html").read_text(encoding="utf-8")
        texts.append((out / "metrics.json").read_text(encoding="utf-8"))
        tables.append((out / "steps.parquet").read_bytes())
        assert json.loads(texts[-1]) == {"complete": True, **done.summary.to_json()}
    assert texts[0] == texts[1]
    assert tables[0] == tables[1]
    rows = parquet.read_table(tmp_path / "one" / "steps.parquet").to_pylist()
    assert [row["time_s"] for row in rows] == [0.0, 0.5, 1.0, 1.5, 2.0]
    trajectories = parquet.read_table(tmp_path / "one" / "trajectories.parquet").to_pydict()
    assert [trajectories["index"].count(row["index"]) for row in rows] == [row["n_vehicles"] for row in rows]
    assert rows[-1]["n_vehicles"] > 3


def test_traffic_alone_has_no_video_and_a_run_with_an_ego_is_not_alone(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match=r"recorder of traffic alone.*'video'"):
        record_traffic(without_ego(), 1, tmp_path / "out", recorders=("video",))
    with pytest.raises(FogSimError, match=r"traffic\.ego is 'ego'; write none"):
        record_traffic(short(), 1, tmp_path / "out")
    with pytest.raises(FogSimError, match=r"needs an ego vehicle, and traffic\.ego is none; name one, or .*fogsim run"):
        record_run(without_ego(), 1, tmp_path / "out")
    assert list(tmp_path.iterdir()) == []
