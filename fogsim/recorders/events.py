"""What happens in a run, one row each: what the script does, collisions, faults, warnings, traffic lights, the end."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import pyarrow as pa

from fogsim.core.files.row_log import row_batches, row_schema
from fogsim.recorders.protocol import Derived
from fogsim.recorders.table import LoggedTable, write_table
from fogsim.values import DriverWarning, SignalColour, Step, TrafficStep

EVENT_COLUMNS: Mapping[str, tuple[Any, str]] = {
    "index": (pa.int64(), "number of the camera period, as in steps.parquet"),
    "time_s": (pa.float64(), "time since the run began"),
    "event": (
        pa.string(),
        "script_begins, script_ends, collision, fault_begins, fault_ends, warning_begins, warning_ends, signal_shows "
        "or run_ends",
    ),
    "name": (pa.string(), "entry of the timeline, sensor and fault, warning, traffic light, or why the run ended"),
    "what": (pa.string(), "what is done; of a collision the speed of the impact [m/s]; lane and colour"),
    "who": (pa.string(), "vehicles, with commas between"),
    "x_m": (pa.float64(), "where the first of them is, the signal head, or else the ego: east; null if none is there"),
    "y_m": (pa.float64(), "the same, north"),
    "z_m": (pa.float64(), "the same, height"),
    "why": (pa.string(), "what held of the condition when it came to hold"),
}
"""Columns of ``events.parquet``: their types and meanings."""


class _Event(NamedTuple):
    """A row but for what every event of a step has."""

    time: float
    event: str
    name: str
    what: str = ""
    who: tuple[str, ...] = ()
    why: str = ""
    place: tuple[float | None, ...] | None = None


class EventRecorder(LoggedTable[tuple[object, ...]]):
    """Writes ``events.parquet``, a row for each event in the order of time; equal steps give equal bytes."""

    def __init__(self, path: Path) -> None:
        super().__init__(path, EVENT_COLUMNS, write_event_table)
        self._faults: frozenset[str] = frozenset()
        self._warning: DriverWarning | None = None
        self._shown: dict[tuple[str, str], SignalColour] = {}

    def record(self, step: TrafficStep, _derived: Derived | None = None) -> None:
        """Add the events of a step."""
        self._held += [self._row(step, event) for event in self._events(step)]
        self._warning = step.command.warning
        self._faults = frozenset(fault.name for fault in step.truth.faults)
        self._flush()

    def _batch(self) -> Any:
        columns = dict(zip(self._schema.names, zip(*self._held, strict=True), strict=True))
        return pa.RecordBatch.from_pydict(columns, schema=self._schema)

    def _events(self, step: TrafficStep) -> Iterator[_Event]:
        for begun in step.begun:
            how = "script_ends" if begun.is_over else "script_begins"
            yield _Event(begun.time, how, begun.name, begun.what, begun.who, begun.why)
        for hit in step.collisions:
            who = (hit.collider, hit.victim)
            yield _Event(step.time, "collision", f"{hit.collider} hit {hit.victim}", f"{hit.impact_speed:.3f}", who)
        now = frozenset(fault.name for fault in step.truth.faults)
        for how, faults in (("fault_begins", now - self._faults), ("fault_ends", self._faults - now)):
            yield from (_Event(step.time, how, fault) for fault in sorted(faults))
        if step.command.warning is not self._warning:
            changes = ("warning_ends", self._warning), ("warning_begins", step.command.warning)
            yield from (_Event(step.time, how, warning) for how, warning in changes if warning is not None)
        yield from self._signals(step)
        if step.ending is not None:
            yield _Event(step.time, "run_ends", step.ending.value)

    def _signals(self, step: TrafficStep) -> Iterator[_Event]:
        """What heads of traffic lights show that are read for the first time, or have changed."""
        signals = step.traffic.signals
        for row, (signal, lane, colour) in enumerate(zip(signals.ids, signals.lane, signals.colour, strict=True)):
            if self._shown.get((signal, lane)) is not colour:
                self._shown[signal, lane] = colour
                place = tuple(signals.position[row].tolist())
                yield _Event(step.time, "signal_shows", signal, f"{lane}: {colour}", place=place)

    def _row(self, step: TrafficStep, event: _Event) -> tuple[object, ...]:
        row = step.traffic.row(event.who[0]) if event.who else step.ego if isinstance(step, Step) else None
        place = event.place or ((None, None, None) if row is None else step.traffic.position[row].tolist())
        told = event.name, event.what, ",".join(event.who)
        return (step.index, event.time, event.event, *told, *place, event.why)


def write_event_table(path: Path, log: Path, complete: bool) -> None:
    """Make a parquet file of a log of events, whole or not at all."""
    write_table(path, pa.Table.from_batches(row_batches(log), schema=row_schema(log)), complete)
