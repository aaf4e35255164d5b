"""Table and report of traffic alone: figures by hand, and nothing in them that needs an ego."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from pyarrow import parquet

from fogsim.metrics import TrafficRunMetrics
from fogsim.recorders import TRAFFIC_RECORDERS, RunDirectory, RunInformation
from fogsim.recorders.traffic_report import TrafficCurves
from fogsim.values import Collision, Command, Ending, SpeedAdvice, Stretch, StretchAdvice, TrafficStep
from tests.recorders.synthetic import make_traffic_step
from tests.recorders.test_report import Page

SIGN = StretchAdvice(15.0, Stretch(0.0, 500.0))


def some_steps() -> list[TrafficStep]:
    told = Command(SpeedAdvice(20.0), stretches=(SIGN,))
    return [
        make_traffic_step(0, speed=30.0, visibility=80.0, visibilities=(200.0, 50.0)),
        make_traffic_step(1, time=0.5, speed=10.0, visibility=math.inf, command=told, heard=(15.0, math.inf)),
        make_traffic_step(2, time=1.0, collisions=(Collision(0.9, "a", "b", 3.0),), ending=Ending.TIME),
    ]


def emptied(step: TrafficStep) -> TrafficStep:
    """The same without any vehicle."""
    state = step.traffic
    kept = {"time", "signals", "persons", "pieces"}
    empty = {f.name: getattr(state, f.name)[:0] for f in dataclasses.fields(state) if f.name not in kept}
    truth = dataclasses.replace(step.truth, vehicle_extinctions=np.zeros(0))
    return dataclasses.replace(step, traffic=dataclasses.replace(state, **empty), truth=truth)


ROAD = np.array([[25.0, 30.0, 0.0, 5.0], [75.0, 28.0, 0.05, 4.0], [175.0, 20.0, 0.04, 4.0]])


def recorded(folder: Path, steps: list[TrafficStep], road: NDArray[np.float64] = ROAD[:0]) -> Page:
    metrics = TrafficRunMetrics()
    with RunDirectory(folder) as directory:
        directory.begin({})
        meanings = metrics.summary().meanings
        summary = metrics.summary
        information = RunInformation(
            directory, "All", "", 5, (), 0.5, lambda: summary().to_json(), meanings, lambda: road
        )
        recorders = [make(information) for make in TRAFFIC_RECORDERS.values()]
        for step in steps:
            metrics.update(step)
            for recorder in recorders:
                recorder.record(step, metrics.derive(step))
        for recorder in recorders:
            recorder.close(complete=True)
        directory.finish({})
    return Page((folder / "report.html").read_text(encoding="utf-8"))


def test_table_and_report_are_of_all_vehicles(tmp_path: Path) -> None:
    page = recorded(tmp_path, some_steps(), road=ROAD)
    table = parquet.read_table(tmp_path / "steps.parquet")
    columns = table.to_pydict()
    assert columns["time_s"] == [0.0, 0.5, 1.0]
    assert columns["n_vehicles"] == [2, 2, 2]
    assert columns["mean_speed_mps"] == [25.0, 15.0, 22.5]
    assert columns["advised_speed_mps"] == [None, 15.0, None]
    assert columns["n_advised"] == [0, 1, 0]
    assert columns["collisions"] == [0, 0, 1]
    assert columns["ending"] == [None, None, "time"]
    assert columns["true_visibility_m"] == pytest.approx([80.0, None, 100.0])
    assert columns["least_visibility_m"] == pytest.approx([50.0, None, 100.0])
    assert not {"route_position_m", "believed_visibility_m", "leader_gap_m", "lamps"} & set(columns)
    assert table.schema.metadata[b"fogsim.complete"] == b"true"
    assert len(page.images) == 4
    assert "traffic mean speed" in page.text
    assert "Over the road of traffic.along" in page.text
    for word in ("of the ego", "camera", "Gap"):
        assert word not in page.text.split("Timeline")[1].split("All metrics")[0]


def test_a_network_without_vehicles_has_rows_and_figures_too(tmp_path: Path) -> None:
    page = recorded(tmp_path, [emptied(step) for step in some_steps()])
    row = parquet.read_table(tmp_path / "steps.parquet").to_pylist()[0]
    assert (row["n_vehicles"], row["mean_speed_mps"], row["least_visibility_m"]) == (0, None, None)
    assert len(page.images) == 3


def test_curves_are_percentiles_of_speed_and_the_lowest_advice() -> None:
    curves = TrafficCurves()
    for step in some_steps():
        curves.add(step)
    # Speeds are 20 and 30, 20 and 10, 20 and 25 m/s.
    assert curves.slow == pytest.approx([21.5, 11.5, 20.75])
    assert curves.fast == pytest.approx([28.5, 18.5, 24.25])
    assert curves.advice == [None, 15.0, None]
    assert curves.advised == [0, 1, 0]
    assert curves.collisions == [0.9]
