"""Runs on a disk that becomes full."""

import json
from pathlib import Path
from typing import Any

import pytest
from pyarrow import parquet

import fogsim
from fogsim.errors import RecorderError
from fogsim.recorders import recover_run, run_directory
from fogsim.simulation import recording
from fogsim.simulation.recording import record_run
from tests.faults.disk import SmallDisk
from tests.faults.steps import drawn_run

STEPS = 300


@pytest.fixture(autouse=True)
def drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps without a simulation, and every row written at once."""
    monkeypatch.setattr(recording, "run", lambda *_, **__: drawn_run(STEPS))
    monkeypatch.setattr("fogsim.recorders.table.LOG_PERIOD", 0.0)


def record(out: Path, **options: Any) -> None:
    record_run(fogsim.load_scenario("motorway_fog_bank"), 1, out, recorders=("table",), **options)


def manifest(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "manifest.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("room", [800_000, 1_600_000])
def test_no_row_is_lost_and_the_files_are_closed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, room: int) -> None:
    out = tmp_path / "out"
    SmallDisk(out, room, monkeypatch)
    taken = []
    with pytest.raises(RecorderError, match=r"the recorder table failed: .*No space left on device: '.*steps\.arrows"):
        record(out, watch=lambda step: taken.append(step.index))
    index = parquet.read_table(out / "steps.parquet")["index"].to_pylist()
    assert index == list(range(len(index)))
    assert len(index) == len(taken) + 1  # the last row had no room in the log, and has it in the table
    assert parquet.read_schema(out / "steps.parquet").metadata[b"fogsim.complete"] == b"false"
    told = manifest(out)
    assert told["status"] == "failed"
    assert "No space left on device" in str(told["message"])
    assert list(told["failed_recorders"]) == ["table"]
    assert sorted(path.name for path in out.iterdir()) == ["manifest.json", "metrics.json", "steps.parquet"]


def test_a_disk_that_is_full_at_first_costs_no_earlier_results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "manifest.json").write_text("earlier", encoding="utf-8")
    (tmp_path / "unfinished").mkdir()
    (tmp_path / "unfinished" / "steps.arrows").write_bytes(bytes(1000))
    SmallDisk(tmp_path, 100_000, monkeypatch)
    with pytest.raises(OSError, match=r"No space left on device: '.*reserve'"):
        record(tmp_path, overwrite=True)
    assert (tmp_path / "manifest.json").read_text(encoding="utf-8") == "earlier"
    assert (tmp_path / "unfinished" / "steps.arrows").read_bytes() == bytes(1000)


def test_rows_that_could_not_be_made_a_table_wait_for_room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "out"
    disk = SmallDisk(out, 10_000_000, monkeypatch)

    def others_fill_it(step: fogsim.Step) -> None:
        if step.index == 100:
            disk.room = 400_000

    with pytest.raises(RecorderError, match=r"No space left on device"):
        record(out, watch=others_fill_it)
    unfinished = out / run_directory.UNFINISHED
    if unfinished.exists():
        assert manifest(unfinished)["status"] == "failed"
        disk.room = 10_000_000
        assert "steps.parquet" in recover_run(out)
    assert manifest(out)["status"] == "failed"
    assert parquet.read_table(out / "steps.parquet")["index"].to_pylist()[:101] == list(range(101))
