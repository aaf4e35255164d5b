import dataclasses
import json
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from fogsim.recorders import TrajectoryRecorder, recover_run, trajectories, with_trajectories
from fogsim.recorders.run_directory import TRAJECTORY_LOG
from fogsim.recorders.trajectories import TRAJECTORY_COLUMNS
from fogsim.values import EquippedVehicle, Lamp, PersonState, SpeedAdvice, Step
from tests.recorders.synthetic import belief, drive

STEPS = 12


def rows(path: Path) -> list[dict[str, object]]:
    return list(pq.read_table(path).to_pylist())


def metadata(path: Path) -> dict[bytes, bytes]:
    return dict(pq.read_schema(path).metadata)


def test_every_vehicle_of_every_step_is_a_row_in_sumos_units(tmp_path: Path) -> None:
    path = tmp_path / "trajectories.parquet"
    steps = list(drive(STEPS))
    assert list(with_trajectories(steps, path)) == steps
    found = rows(path)
    assert [(row["index"], row["vehicle_id"]) for row in found] == [
        (step.index, vehicle) for step in steps for vehicle in step.traffic.ids
    ]
    last = steps[-1].traffic
    assert found[-1]["timestep_time"] == last.time
    assert found[-1]["vehicle_x"] == last.position[-1, 0]
    assert found[-1]["vehicle_speed"] == last.speed[-1]
    assert found[-1]["vehicle_lane"] == last.lane[-1]
    # East: 0 rad here, 90° in SUMO.
    assert found[-1]["vehicle_angle"] == pytest.approx(90.0 - np.degrees(last.heading[-1]))
    assert metadata(path)[b"fogsim.complete"] == b"true"
    assert set(json.loads(metadata(path)[b"fogsim.columns"])) == set(TRAJECTORY_COLUMNS)
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


def test_the_fog_at_each_vehicle_is_told_as_visibility(tmp_path: Path) -> None:
    path = tmp_path / "trajectories.parquet"
    unknown, step = drive(2)
    truth = dataclasses.replace(step.truth, vehicle_extinctions=np.array([math.log(20.0) / 50.0, 0.0]))
    list(with_trajectories([unknown, dataclasses.replace(step, truth=truth)], path))
    assert [row["visibility"] for row in rows(path)] == [None, None, pytest.approx(50.0), None]


def test_what_equipped_vehicles_believe_and_are_advised_is_told(tmp_path: Path) -> None:
    path = tmp_path / "trajectories.parquet"
    step = dataclasses.replace(next(iter(drive(1))), belief=belief(80.0, 0.1))
    other = next(one for row, one in enumerate(step.traffic.ids) if row != step.ego)
    seen = EquippedVehicle(other, 0.0, 0.03, 0.03, (), belief(120.0, 0.1), SpeedAdvice(), Lamp.NONE)
    heard = np.where(np.array(step.traffic.ids) == other, 20.0, np.inf)
    traffic = dataclasses.replace(step.traffic, advised_speed=heard)
    list(with_trajectories([dataclasses.replace(step, traffic=traffic, equipped=(seen,))], path))
    of = {row["vehicle_id"]: row for row in rows(path)}
    assert of[other]["believed_visibility"] == pytest.approx(120.0, rel=0.02)
    assert of[other]["believed_visibility_low"] < 120.0 < of[other]["believed_visibility_high"]  # type: ignore[operator]
    assert of["ego"]["believed_visibility"] == pytest.approx(80.0, rel=0.02)
    assert [of[other]["advised_speed"], of["ego"]["advised_speed"]] == [20.0, None]


def test_persons_on_foot_are_rows_too(tmp_path: Path) -> None:
    path = tmp_path / "trajectories.parquet"
    step = next(iter(drive(1)))
    persons = PersonState(
        ("anna",), np.array([[1.0, 2.0, 3.0]]), np.zeros(1), np.array([1.4]), ("way_0",), np.array([True])
    )
    list(
        with_trajectories([dataclasses.replace(step, traffic=dataclasses.replace(step.traffic, persons=persons))], path)
    )
    *vehicles, walker = rows(path)
    assert [row["vehicle_type"] for row in vehicles] == list(step.traffic.types)
    assert (walker["vehicle_id"], walker["vehicle_type"], walker["vehicle_lane"]) == ("anna", "pedestrian", "way_0")
    assert (walker["vehicle_x"], walker["vehicle_y"], walker["vehicle_z"]) == (1.0, 2.0, 3.0)
    assert (walker["vehicle_speed"], walker["vehicle_angle"]) == (1.4, 90.0)
    assert walker["vehicle_acceleration"] is walker["vehicle_slope"] is walker["visibility"] is None


def test_a_step_that_shows_again_what_was_last_seen_adds_nothing(tmp_path: Path) -> None:
    path = tmp_path / "trajectories.parquet"
    *steps, last = drive(3)
    list(with_trajectories([*steps, last, last], path))
    assert len(rows(path)) == sum(len(step.traffic.ids) for step in (*steps, last))


def test_what_is_left_off_is_partial_and_readable(tmp_path: Path) -> None:
    path = tmp_path / "trajectories.parquet"

    def failing() -> Iterator[Step]:
        yield from drive(3)
        raise RuntimeError("SUMO has died")

    with pytest.raises(RuntimeError, match="SUMO has died"):
        list(with_trajectories(failing(), path))
    assert len(rows(path)) == 6
    assert metadata(path)[b"fogsim.complete"] == b"false"


def test_rows_go_into_groups_of_a_bounded_size_and_those_written_twice_count_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trajectories, "MOST_ROWS_HELD", 4)
    monkeypatch.setattr(trajectories, "ROWS_PER_GROUP", 8)
    path = tmp_path / "trajectories.parquet"
    recorder = TrajectoryRecorder(path, clock=lambda: 0.0)
    held: list[Step] = []
    for step in drive(STEPS):
        held = list(recorder._held)
        recorder.record(step)
    # As if Ctrl-C had come between writing them and forgetting them.
    recorder._held = [*held, *recorder._held]
    recorder.close(complete=False)
    file = pq.ParquetFile(path)
    assert [file.metadata.row_group(i).num_rows for i in range(file.metadata.num_row_groups)] == [10, 8, 6]
    assert [row["index"] for row in rows(path)] == [index for index in range(STEPS) for _ in range(2)]


def test_a_dead_runs_trajectories_are_recovered_up_to_where_they_were_cut_off(tmp_path: Path) -> None:
    unfinished = tmp_path / "unfinished"
    unfinished.mkdir()
    ticks = iter(range(STEPS))
    recorder = TrajectoryRecorder(unfinished / "trajectories.parquet", clock=lambda: float(next(ticks)))
    for step in drive(STEPS):
        recorder.record(step)
    log = unfinished / TRAJECTORY_LOG
    log.write_bytes(log.read_bytes()[:-100])
    (unfinished / "manifest.json").write_text('{"status": "running"}')
    assert recover_run(tmp_path) == ["manifest.json", "trajectories.parquet"]
    path = tmp_path / "trajectories.parquet"
    assert len(rows(path)) == 2 * (STEPS - 1)
    assert metadata(path)[b"fogsim.complete"] == b"false"


def test_a_full_disk_leaves_the_log_to_be_recovered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "trajectories.parquet"
    recorder = TrajectoryRecorder(path)
    recorder.record(next(drive(1)))

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("fogsim.core.files.atomic.publish", full)
    with pytest.raises(OSError, match="No space left"):
        recorder.close(complete=True)
    assert not path.exists()
    assert [file.name for file in tmp_path.iterdir()] == ["trajectories.arrows"]
