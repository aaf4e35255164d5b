"""Every step as a row of a parquet table."""

import io
import json
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from fogsim.files.atomic import write_bytes
from fogsim.files.row_log import RowLog, read_rows
from fogsim.recorders.protocol import DERIVED_QUANTITIES, Derived
from fogsim.recorders.run_directory import ROW_LOG
from fogsim.units import finite_or_none
from fogsim.values import Estimate, Leader, LeadMeasurement, Step

ROWS_PER_GROUP = 1024
"""Rows of one row group."""

LOG_PERIOD = 0.5
"""Time between two writings of rows [s]: what a process that is killed loses at most, and what a full disk loses."""


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
    and ``fogsim.columns`` (JSON, one line on each column). Equal steps give equal bytes. Until it is closed, rows are
    in ``steps.arrows`` beside it, at most `LOG_PERIOD` after they were recorded.

    Parameters
    ----------
    path : Path
        The file; nothing is written before the first row.
    methods : sequence of str
        Estimators that get columns of their own.
    clock : callable
        Gives the time that passes [s].
    """

    def __init__(self, path: Path, methods: Sequence[str], clock: Callable[[], float] = time.monotonic) -> None:
        self._path = path
        self._columns = table_columns(methods)
        self._schema = pa.schema(
            [(column.name, column.kind) for column in self._columns],
            metadata={
                "fogsim.methods": ",".join(methods),
                "fogsim.columns": json.dumps({column.name: column.meaning for column in self._columns}),
            },
        )
        self._clock = clock
        self._log: RowLog | None = None
        self._logged = -math.inf
        self._rows: list[list[object]] = []
        self._open = True

    def record(self, step: Step, derived: Derived) -> None:
        """Add a row; a step that comes once more, with its ending, takes the place of the one before.

        Parameters
        ----------
        step : Step
            The finished step.
        derived : mapping from str to float or None
            `DERIVED_QUANTITIES` of the step.
        """
        self._rows.append([column.value(step, derived) for column in self._columns])
        now = self._clock()
        if now - self._logged >= LOG_PERIOD:
            self._flush()
            self._logged = now

    def _flush(self) -> RowLog:
        if self._log is None:
            self._log = RowLog(self._path.with_name(ROW_LOG), self._schema)
        if self._rows:
            values = zip(*self._rows, strict=True)
            arrays = [pa.array(column, type=field.type) for column, field in zip(values, self._schema, strict=True)]
            self._log.append(pa.RecordBatch.from_arrays(arrays, schema=self._schema))
            # A Ctrl-C before this line has them written twice, which does no harm: the last of equal rows counts.
            self._rows = []
        return self._log

    def close(self, complete: bool) -> None:
        """Make the table of the rows and say in it whether the run was complete.

        Parameters
        ----------
        complete : bool
            False if the run was cut short.
        """
        if not self._open:
            return
        if self._log is not None:
            self._log.release_reserve()
        log = self._flush()
        log.release_reserve()
        write_table(self._path, read_rows(log.path), complete)
        log.remove()
        self._open = False


def write_table(path: Path, rows: Any, complete: bool) -> None:
    """Write the rows of a log as a table, whole or not at all.

    Parameters
    ----------
    path : Path
        The parquet file.
    rows : pyarrow.Table
        The rows, with the metadata of a log.
    complete : bool
        Whether they are of a whole run.

    Raises
    ------
    OSError
        If it cannot be written; the message names the file.
    """
    table = rows.replace_schema_metadata(None).combine_chunks()
    file = io.BytesIO()
    # Without a stored copy of the schema readers take its metadata from the end of the file.
    with pq.ParquetWriter(file, table.schema, compression="zstd", store_schema=False) as writer:
        writer.write_table(table, row_group_size=ROWS_PER_GROUP)
        writer.add_key_value_metadata({"fogsim.complete": "true" if complete else "false", **rows.schema.metadata})
    write_bytes(path, file.getvalue())


def table_columns(methods: Sequence[str]) -> list[Column]:
    """List the columns of the table for given estimators, in their order.

    Parameters
    ----------
    methods : sequence of str
        Names of the estimators.
    """
    columns = [*_EGO_COLUMNS, *_TRAFFIC_COLUMNS, *map(_derived_column, DERIVED_QUANTITIES), *_FOG_COLUMNS]
    for method in methods:
        columns += _estimator_columns(method)
    return columns


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
        return of_estimate(lambda estimate: finite_or_none(value(estimate)) if estimate.valid else None)

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
        lambda step, _: finite_or_none(step.command.advice.speed),
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
        lambda step, _: finite_or_none(step.truth.visibility),
    ),
    Column(
        "true_visibility_ahead_m",
        pa.float64(),
        "of the fog ahead; null for clear air",
        lambda step, _: finite_or_none(step.truth.visibility_ahead),
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
