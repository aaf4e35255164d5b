"""Every step as a row of a parquet table."""

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from fogsim.recorders.files import partial_path, publish
from fogsim.recorders.protocol import DERIVED_QUANTITIES, Derived
from fogsim.values import Estimate, Leader, LeadMeasurement, Step

ROWS_PER_GROUP = 1024
"""Rows that are held in memory before they are written as one row group."""


@dataclass(frozen=True, slots=True)
class Column:
    """One column of the table.

    Attributes
    ----------
    name : str
        Its name, which ends in its unit.
    kind : pyarrow.DataType
        Its type.
    meaning : str
        One line on it, stored in the file.
    value : callable
        Takes it from a step and what was derived from it; None is stored as null.
    """

    name: str
    kind: Any
    meaning: str
    value: Callable[[Step, Derived], object]


class TableRecorder:
    """Writes ``steps.parquet``: one row a step, columns with units in their names.

    The metadata of its schema says ``fogsim.complete`` (``true`` or ``false``), ``fogsim.methods`` (comma-separated)
    and ``fogsim.columns`` (JSON, one line on each column). Equal steps give equal bytes.

    Parameters
    ----------
    path : Path
        The file.
    methods : sequence of str
        Estimators that get columns of their own.
    """

    def __init__(self, path: Path, methods: Sequence[str]) -> None:
        self._path = path
        self._columns = table_columns(methods)
        self._methods = tuple(methods)
        self._schema = pa.schema([(column.name, column.kind) for column in self._columns])
        # Without a stored copy of the schema readers take its metadata from the end of the file, which is written
        # when it is known whether the run was complete.
        self._writer = pq.ParquetWriter(partial_path(path), self._schema, compression="zstd", store_schema=False)
        self._rows: list[list[object]] = []
        self._last_index: int | None = None
        self._open = True

    def record(self, step: Step, derived: Derived) -> None:
        """Add a row; a step that comes once more, with its ending, takes the place of the one before."""
        if step.index == self._last_index:
            self._rows.pop()
        elif len(self._rows) == ROWS_PER_GROUP:
            self._flush()
        self._last_index = step.index
        self._rows.append([column.value(step, derived) for column in self._columns])

    def _flush(self) -> None:
        values = zip(*self._rows, strict=True)
        arrays = [pa.array(column, type=field.type) for column, field in zip(values, self._schema, strict=True)]
        group = pa.Table.from_arrays(arrays, schema=self._schema)
        # Emptied first: a Ctrl-C while the group is written is raised after it, and must not write it twice.
        self._rows = []
        self._writer.write_table(group)

    def close(self, complete: bool) -> None:
        """Write what is left and say whether the run was complete."""
        if not self._open:
            return
        self._open = False
        if self._rows:
            self._flush()
        self._writer.add_key_value_metadata(
            {
                "fogsim.complete": "true" if complete else "false",
                "fogsim.methods": ",".join(self._methods),
                "fogsim.columns": json.dumps({column.name: column.meaning for column in self._columns}),
            }
        )
        self._writer.close()
        publish(self._path)


def table_columns(methods: Sequence[str]) -> list[Column]:
    """List the columns of the table for given estimators, in their order."""
    columns = [*_EGO_COLUMNS, *_TRAFFIC_COLUMNS, *map(_derived_column, DERIVED_QUANTITIES), *_FOG_COLUMNS]
    for method in methods:
        columns += _estimator_columns(method)
    return columns


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _ego(name: str) -> Callable[[Step, Derived], object]:
    return lambda step, _: float(getattr(step.traffic, name)[step.ego])


def _position(axis: int) -> Callable[[Step, Derived], object]:
    return lambda step, _: float(step.traffic.position[step.ego, axis])


def _of_leader(value: Callable[[Leader], object]) -> Callable[[Step, Derived], object]:
    return lambda step, _: None if step.leader is None else value(step.leader)


def _of_lead(value: Callable[[LeadMeasurement], float]) -> Callable[[Step, Derived], object]:
    return lambda step, _: None if step.observation.lead is None else value(step.observation.lead)


def _believed(share: float) -> Callable[[Step, Derived], object]:
    return lambda step, _: step.belief.visibility_quantile(share)


def _derived_column(name: str) -> Column:
    return Column(name, pa.float64(), DERIVED_QUANTITIES[name], lambda _, derived: derived[name])


def _estimator_columns(method: str) -> list[Column]:
    def of_estimate(value: Callable[[Estimate], object]) -> Callable[[Step, Derived], object]:
        return lambda step, _: next((value(e) for e in step.estimates if e.method == method), None)

    def if_valid(value: Callable[[Estimate], float]) -> Callable[[Step, Derived], object]:
        return of_estimate(lambda estimate: _finite(value(estimate)) if estimate.valid else None)

    number = pa.float64()
    return [
        Column(f"{method}_valid", pa.bool_(), "the method could tell", of_estimate(lambda e: e.valid)),
        Column(
            f"{method}_extinction_per_m",
            number,
            "estimated extinction coefficient",
            if_valid(lambda e: e.extinction),
        ),
        Column(
            f"{method}_standard_deviation_per_m",
            number,
            "its standard deviation as the method gives it",
            if_valid(lambda e: e.standard_deviation),
        ),
        Column(
            f"{method}_visibility_m",
            number,
            "estimated meteorological visibility; null for clear air",
            if_valid(lambda e: e.visibility),
        ),
    ]


_EGO_COLUMNS = (
    Column("index", pa.int64(), "number of the camera period, from 0", lambda step, _: step.index),
    Column("time_s", pa.float64(), "simulated time", lambda step, _: step.time),
    Column("route_position_m", pa.float64(), "distance along the route", lambda step, _: step.route_position),
    Column("x_m", pa.float64(), "east, middle of the front bumper", _position(0)),
    Column("y_m", pa.float64(), "north, middle of the front bumper", _position(1)),
    Column("heading_rad", pa.float64(), "counterclockwise from east", _ego("heading")),
    Column("speed_mps", pa.float64(), "speed of the ego", _ego("speed")),
    Column("acceleration_mps2", pa.float64(), "acceleration of the ego", _ego("acceleration")),
    Column("speed_limit_mps", pa.float64(), "speed limit", lambda step, _: step.speed_limit),
    Column(
        "advised_speed_mps",
        pa.float64(),
        "advice in force; null for none",
        lambda step, _: _finite(step.command.advice.speed),
    ),
    Column(
        "lamps",
        pa.int32(),
        "lit lamps of the ego, bits of Lamp",
        lambda step, _: int(step.traffic.lamps[step.ego]),
    ),
)
_TRAFFIC_COLUMNS = (
    Column("n_vehicles", pa.int32(), "vehicles near the ego, itself included", lambda step, _: len(step.traffic.ids)),
    Column("leader_id", pa.string(), "vehicle ahead", _of_leader(lambda leader: leader.vehicle_id)),
    Column("leader_gap_m", pa.float64(), "true gap to it", _of_leader(lambda leader: leader.gap)),
    Column("leader_speed_mps", pa.float64(), "its true speed", _of_leader(lambda leader: leader.speed)),
    Column("collisions", pa.int32(), "collisions new in this period", lambda step, _: len(step.collisions)),
    Column(
        "ending",
        pa.string(),
        "why the run is over",
        lambda step, _: None if step.ending is None else step.ending.value,
    ),
)
_FOG_COLUMNS = (
    Column("true_extinction_per_m", pa.float64(), "at the camera", lambda step, _: step.truth.extinction),
    Column(
        "true_visibility_m",
        pa.float64(),
        "at the camera; null for clear air",
        lambda step, _: _finite(step.truth.visibility),
    ),
    Column(
        "true_visibility_ahead_m",
        pa.float64(),
        "of the fog ahead; null for clear air",
        lambda step, _: _finite(step.truth.visibility_ahead),
    ),
    Column("believed_visibility_m", pa.float64(), "median of the belief", _believed(0.5)),
    Column("believed_visibility_low_m", pa.float64(), "5 % quantile of the belief", _believed(0.05)),
    Column("believed_visibility_high_m", pa.float64(), "95 % quantile of the belief", _believed(0.95)),
    Column(
        "measured_lead_distance_m",
        pa.float64(),
        "gap by the range sensor",
        _of_lead(lambda lead: lead.distance),
    ),
    Column(
        "measured_lead_relative_speed_mps",
        pa.float64(),
        "lead's speed minus own by the range sensor",
        _of_lead(lambda lead: lead.relative_speed),
    ),
)
