import dataclasses
import itertools
import json
import math
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from fogsim.core.files.row_log import read_rows
from fogsim.metrics import step_metrics
from fogsim.recorders import TableRecorder
from fogsim.recorders.table import ROWS_PER_GROUP
from fogsim.values import Collision, DriverWarning, Ending, Estimate, FogProfile, Lamp, Leader, LeadMeasurement, Step
from tests.recorders.synthetic import METHODS, drive, estimate, make_step


def write(path: Path, steps: list[Step], *, complete: bool = True, clock: Callable[[], float] = time.monotonic) -> Path:
    recorder = TableRecorder(path, METHODS, clock)
    for step in steps:
        recorder.record(step, step_metrics(step))
    recorder.close(complete)
    return path


def only_row(path: Path) -> dict[str, object]:
    rows = pq.read_table(path).to_pylist()
    assert len(rows) == 1
    return dict(rows[0])


def test_a_step_becomes_a_row(tmp_path: Path) -> None:
    step = make_step(
        7,
        time=1.4,
        speed=25.0,
        acceleration=-1.5,
        route_position=40.0,
        leader=Leader("truck", 20.0, 20.0),
        lead=LeadMeasurement(20.5, -5.1),
        collisions=(Collision(1.4, "a", "b", 2.0),),
        visibility=120.0,
        visibility_ahead=100.0,
        estimates=(estimate("joint_road", 110.0), Estimate.invalid("negru2013", "no band")),
        advised=20.0,
        lamps=Lamp.LOW_BEAM | Lamp.REAR_FOG,
        ending=Ending.TIME,
    )
    step = dataclasses.replace(step, command=dataclasses.replace(step.command, warning=DriverWarning.FOG_AHEAD))
    row = only_row(write(tmp_path / "steps.parquet", [step]))
    expected = {
        "index": 7,
        "time_s": 1.4,
        "route_position_m": 40.0,
        "x_m": 40.0,
        "y_m": 0.0,
        "heading_rad": 0.0,
        "speed_mps": 25.0,
        "acceleration_mps2": -1.5,
        "speed_limit_mps": 130 / 3.6,
        "advised_speed_mps": 20.0,
        "lamps": 18,
        "n_vehicles": 2,
        "leader_id": "truck",
        "leader_gap_m": 20.0,
        "leader_speed_mps": 20.0,
        "time_to_collision_s": 4.0,
        "drac_mps2": 0.625,
        "true_visibility_m": pytest.approx(120.0),
        "true_visibility_ahead_m": pytest.approx(100.0),
        "true_extinction_per_m": pytest.approx(math.log(20) / 120),
        "believed_visibility_m": pytest.approx(120.0, rel=0.01),
        "believed_visibility_low_m": pytest.approx(120.0 * math.exp(-1.645 * 0.2), rel=0.02),
        "believed_visibility_high_m": pytest.approx(120.0 * math.exp(1.645 * 0.2), rel=0.02),
        "denser_fog_m": None,
        "measured_lead_distance_m": 20.5,
        "measured_lead_relative_speed_mps": -5.1,
        "collisions": 1,
        "ending": "time",
        "off_lanes": False,
        "sensor_faults": None,
        "warning": "fog_ahead",
        "joint_road_valid": True,
        "joint_road_visibility_m": pytest.approx(110.0),
        "joint_road_extinction_per_m": pytest.approx(math.log(20) / 110),
        "joint_road_standard_deviation_per_m": pytest.approx(0.1 * math.log(20) / 110),
        "negru2013_valid": False,
        "negru2013_visibility_m": None,
        "negru2013_extinction_per_m": None,
        "negru2013_standard_deviation_per_m": None,
    }
    assert {name: row[name] for name in expected} == expected
    of_places = {name for name in row if "_m_ahead" in name}
    assert len(of_places) == 12
    assert all(row[name] is None for name in of_places)
    assert set(row) - set(expected) - of_places == {"stopping_sight_distance_m", "visibility_margin_m"}


def test_what_is_without_limit_or_absent_is_null(tmp_path: Path) -> None:
    clear = Estimate("joint_road", 0.0, 0.001)
    row = only_row(write(tmp_path / "steps.parquet", [make_step(visibility=math.inf, estimates=(clear,))]))
    for name in ("advised_speed_mps", "leader_id", "leader_gap_m", "true_visibility_m", "true_visibility_ahead_m"):
        assert row[name] is None
    for name in ("visibility_margin_m", "measured_lead_distance_m", "joint_road_visibility_m", "negru2013_valid"):
        assert row[name] is None
    assert row["true_extinction_per_m"] == 0.0
    assert row["joint_road_extinction_per_m"] == 0.0


def test_many_steps_keep_their_order_over_row_groups(tmp_path: Path) -> None:
    count = ROWS_PER_GROUP + 5
    steps = [make_step(i, time=0.1 * i) for i in range(count)]
    path = write(tmp_path / "steps.parquet", steps)
    assert pq.ParquetFile(path).metadata.num_row_groups == 2
    assert pq.read_table(path)["index"].to_pylist() == list(range(count))


@pytest.mark.parametrize("before", [0, ROWS_PER_GROUP - 1, ROWS_PER_GROUP])
def test_a_step_that_comes_once_more_replaces_its_row(tmp_path: Path, before: int) -> None:
    steps = [make_step(i, time=0.1 * i) for i in range(before + 1)]
    again = dataclasses.replace(steps[-1], ending=Ending.LEFT_NETWORK)
    table = pq.read_table(write(tmp_path / "steps.parquet", [*steps, again]))
    assert table.num_rows == before + 1
    assert table["ending"].to_pylist()[-1] == "left the network"


def test_every_column_has_a_description(tmp_path: Path) -> None:
    schema = pq.read_schema(write(tmp_path / "steps.parquet", [make_step()]))
    meanings = json.loads(schema.metadata[b"fogsim.columns"])
    assert list(meanings) == schema.names
    assert all(meanings.values())
    assert schema.metadata[b"fogsim.methods"] == b"joint_road,negru2013"


def test_until_it_is_closed_there_is_no_file_under_the_final_name(tmp_path: Path) -> None:
    path = tmp_path / "steps.parquet"
    recorder = TableRecorder(path, METHODS)
    recorder.record(make_step(), step_metrics(make_step()))
    assert not path.exists()
    recorder.close(complete=True)
    recorder.close(complete=False)
    assert [file.name for file in tmp_path.iterdir()] == ["steps.parquet"]
    assert pq.read_schema(path).metadata[b"fogsim.complete"] == b"true"


def test_rows_are_in_the_log_half_a_second_after_they_were_recorded(tmp_path: Path) -> None:
    now = [0.0]
    recorder = TableRecorder(tmp_path / "steps.parquet", METHODS, clock=lambda: now[0])
    logged = []
    for index, now[0] in enumerate((0.0, 0.2, 0.4, 0.6, 0.7, 5.0)):
        recorder.record(make_step(index), step_metrics(make_step(index)))
        logged.append(len(read_rows(tmp_path / "steps.arrows")))
    assert logged == [1, 1, 1, 4, 4, 6]
    recorder.close(complete=True)


def test_equal_steps_give_equal_bytes(tmp_path: Path) -> None:
    one = write(tmp_path / "one.parquet", list(drive(30)))
    two = write(tmp_path / "two.parquet", list(drive(30)), clock=itertools.count().__next__)
    assert one.read_bytes() == two.read_bytes()


def test_a_run_without_steps_is_an_empty_table(tmp_path: Path) -> None:
    table = pq.read_table(write(tmp_path / "steps.parquet", [], complete=False))
    assert table.schema.metadata[b"fogsim.complete"] == b"false"
    assert table.num_rows == 0
    assert "joint_road_visibility_m" in table.column_names


def test_what_is_believed_of_places_ahead_has_columns_with_the_truth_beside_it(tmp_path: Path) -> None:
    step = make_step()
    places = np.array([0.0, 100.0, 300.0])
    believed = FogProfile(places, np.log([0.01, 0.02, 0.02]), np.array([0.1, 0.3, 0.3]))
    told = dataclasses.replace(
        step,
        belief=dataclasses.replace(step.belief, profile=believed),
        truth=dataclasses.replace(step.truth, profile=FogProfile(places, np.log([0.01, 0.03, 1e-6]), np.zeros(3))),
    )
    row = only_row(write(tmp_path / "steps.parquet", [told]))
    assert row["believed_visibility_100_m_ahead_m"] == pytest.approx(math.log(20.0) / 0.02)
    low, high = (row[f"believed_visibility_100_m_ahead_{end}_m"] for end in ("low", "high"))
    assert low == pytest.approx(math.log(20.0) / 0.02 * math.exp(-1.645 * 0.3), rel=1e-3)
    assert high == pytest.approx(math.log(20.0) / 0.02 * math.exp(1.645 * 0.3), rel=1e-3)
    assert row["true_visibility_100_m_ahead_m"] == pytest.approx(math.log(20.0) / 0.03)
    # Beyond what is known of the road there is no truth to tell, and no belief but the last.
    assert row["true_visibility_400_m_ahead_m"] is None
    assert row["believed_visibility_400_m_ahead_m"] == row["believed_visibility_200_m_ahead_m"]
    plain = only_row(write(tmp_path / "plain.parquet", [step]))
    assert plain["believed_visibility_100_m_ahead_m"] is None
    assert plain["true_visibility_100_m_ahead_m"] is None
