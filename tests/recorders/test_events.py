"""events.parquet: what happens in a run, a row each."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from fogsim.recorders.events import EVENT_COLUMNS, EventRecorder
from fogsim.recorders.recovery import _make_readable
from fogsim.values import (
    Collision,
    Command,
    DriverWarning,
    Ending,
    Fault,
    SignalColour,
    SignalState,
    TrafficStep,
    Truth,
)
from fogsim.values.fault import Blackout
from fogsim.values.script import Begun
from tests.helpers.vehicles import vehicles


def step(index: int, **further: object) -> TrafficStep:
    state = vehicles([[5.0, 6.0, 7.0]], time=0.1 * index, ids=["slow"], lane="e_0")
    truth = Truth(0.0, 0.0, faults=(Fault(Blackout()),) if index == 1 else ())
    plain = TrafficStep(
        index=index, time=0.1 * index, traffic=state, collisions=(), truth=truth, command=Command(), ending=None
    )
    return replace(plain, **further)  # type: ignore[arg-type]  # any field


BEGUN = Begun("cut_in", 0.0, "slow: brake", "slow.speed = 3 m/s", ("slow", "ego"), "timeline.0")
STEPS = [
    step(0),
    step(1, begun=(BEGUN,)),
    step(2, collisions=(Collision(0.2, "slow", "other", 4.5),), begun=(replace(BEGUN, time=0.2, is_over=True),)),
    step(3, ending=Ending.TIME),
]
EXPECTED = [
    (1, 0.0, "script_begins", "cut_in", "slow: brake", "slow,ego", 5.0, 6.0, 7.0, "slow.speed = 3 m/s"),
    (1, 0.1, "fault_begins", "camera blackout", "", "", None, None, None, ""),
    (2, 0.2, "script_ends", "cut_in", "slow: brake", "slow,ego", 5.0, 6.0, 7.0, "slow.speed = 3 m/s"),
    (2, 0.2, "collision", "slow hit other", "4.500", "slow,other", 5.0, 6.0, 7.0, ""),
    (2, 0.2, "fault_ends", "camera blackout", "", "", None, None, None, ""),
    (3, pytest.approx(0.3), "run_ends", "time", "", "", None, None, None, ""),
]


def rows(file: Path) -> list[tuple[object, ...]]:
    table = pq.read_table(file)
    assert table.schema.names == list(EVENT_COLUMNS)
    return [tuple(row.values()) for row in table.to_pylist()]


def test_warnings_begin_and_end(tmp_path: Path) -> None:
    recorder = EventRecorder(tmp_path / "events.parquet")
    given = (DriverWarning.CANNOT_SEE, DriverWarning.CANNOT_SEE, DriverWarning.FOG_AHEAD, None)
    for number, warning in enumerate(given):
        recorder.record(step(2 + number, command=Command(warning=warning)))
    recorder.close(complete=True)
    assert [row[2:4] for row in rows(tmp_path / "events.parquet")] == [
        ("warning_begins", "cannot_see"),
        ("warning_ends", "cannot_see"),
        ("warning_begins", "fog_ahead"),
        ("warning_ends", "fog_ahead"),
    ]


def test_every_event_is_a_row(tmp_path: Path) -> None:
    file = tmp_path / "events.parquet"
    recorder = EventRecorder(file)
    for one in STEPS:
        recorder.record(one)
    recorder.close(complete=False)
    recorder.close(complete=True)
    assert rows(file) == EXPECTED
    assert pq.read_schema(file).metadata[b"fogsim.complete"] == b"false"
    assert [one.name for one in tmp_path.iterdir()] == ["events.parquet"]


def test_events_of_a_process_that_died_are_there(tmp_path: Path) -> None:
    recorder = EventRecorder(tmp_path / "events.parquet")
    for one in STEPS[:2]:
        recorder.record(one)
    _make_readable(tmp_path)
    assert rows(tmp_path / "events.parquet") == EXPECTED[:2]


def test_traffic_lights_are_told_when_they_come_near_and_when_they_change(tmp_path: Path) -> None:
    def showing(index: int, *colours: SignalColour) -> TrafficStep:
        count = len(colours)
        places = np.tile((1.0, 2.0, 3.0), (count, 1))
        signals = SignalState(("C",) * count, ("w_0", "e_0")[:count], places, np.zeros(count), np.ones(count), colours)
        plain = step(index)
        return replace(plain, traffic=replace(plain.traffic, signals=signals))

    recorder, red, green = EventRecorder(tmp_path / "events.parquet"), SignalColour.RED, SignalColour.GREEN
    for one in (showing(2, red), showing(3, red, green), showing(4, green, green), showing(5), showing(6, green)):
        recorder.record(one)
    recorder.close(complete=True)
    told = [(row[0], row[2], row[3], row[4], row[6:9]) for row in rows(tmp_path / "events.parquet")]
    at = (1.0, 2.0, 3.0)
    assert [row for row in told if row[1] == "signal_shows"] == [
        (2, "signal_shows", "C", "w_0: red", at),
        (3, "signal_shows", "C", "e_0: green", at),
        (4, "signal_shows", "C", "w_0: green", at),
    ]
