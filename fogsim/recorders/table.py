"""Every step as a row of a parquet table."""

import io
import json
import math
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Generic, TypeVar

import pyarrow as pa
import pyarrow.parquet as pq

from fogsim.core.files.atomic import write_bytes
from fogsim.core.files.row_log import RowLog, read_rows
from fogsim.recorders.protocol import AnyStep_contra, Derived
from fogsim.recorders.run_directory import LOG_SUFFIX
from fogsim.recorders.table_columns import Column, table_columns
from fogsim.values import Step

ROWS_PER_GROUP = 1024
"""Rows of one row group."""

LOG_PERIOD = 0.5
"""Time between two writings of rows [s]: what a process that is killed loses at most, and what a full disk loses."""


Held = TypeVar("Held")


class LoggedTable(ABC, Generic[Held]):
    """Writes a parquet table: one row at least for each of what is `_held`, in columns with a type and a meaning each.

    Until it is closed, rows are in a log next to it (``.arrows``), at most `LOG_PERIOD` after they were recorded,
    whatever ends the process; `write` makes the table at a path of a log, complete or not. Takes `clock` [s].
    """

    def __init__(
        self,
        path: Path,
        columns: Mapping[str, tuple[Any, str]],
        write: Callable[[Path, Path, bool], None],
        clock: Callable[[], float] = time.monotonic,
        metadata: Mapping[str, str] | None = None,
    ) -> None:
        self._path, self._write, self._clock = path, write, clock
        meanings = json.dumps({name: meaning for name, (_, meaning) in columns.items()})
        self._schema = pa.schema(
            [(name, kind) for name, (kind, _) in columns.items()],
            metadata={**(metadata or {}), "fogsim.columns": meanings},
        )
        self._log: RowLog | None = None
        self._logged = -math.inf
        self._held: list[Held] = []
        self._open = True

    @abstractmethod
    def _batch(self) -> Any:
        """Rows of what is held (pyarrow.RecordBatch)."""

    def _flush_if_due(self, *, at_once: bool = False) -> bool:
        """Write what is held into the log if it is time or must be; whether it was."""
        now = self._clock()
        is_due = at_once or now - self._logged >= LOG_PERIOD
        if is_due:
            self._flush()
            self._logged = now
        return is_due

    def _flush(self) -> RowLog:
        if self._log is None:
            self._log = RowLog(self._path.with_suffix(LOG_SUFFIX), self._schema)
        if self._held:
            self._log.append(self._batch())
            # A Ctrl-C before this line has them written twice; `write` leaves the second out.
            self._held = []
        return self._log

    def close(self, complete: bool) -> None:
        """Make the table of the rows and say in it whether the run was complete."""
        if not self._open:
            return
        if self._log is not None:
            self._log.release_reserve()
        log = self._flush()
        log.release_reserve()
        self._write(self._path, log.path, complete)
        log.remove()
        self._open = False


class StepTable(LoggedTable[Sequence[object]], Generic[AnyStep_contra]):
    """Writes ``steps.parquet``: one row a step, columns with units in their names (`clock` [s]).

    The metadata of its schema says ``fogsim.complete`` (``true`` or ``false``), ``fogsim.methods`` (comma-separated)
    and ``fogsim.columns`` (JSON, one line on each column). Equal steps give equal bytes.
    """

    def __init__(
        self,
        path: Path,
        columns: Sequence[Column[AnyStep_contra]],
        methods: Sequence[str] = (),
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._columns = columns
        described = {column.name: (column.kind, column.meaning) for column in columns}
        super().__init__(path, described, write_step_table, clock, {"fogsim.methods": ",".join(methods)})

    def record(self, step: AnyStep_contra, derived: Derived) -> None:
        """Add a row; a step that comes once more, with its ending, takes the place of the one before."""
        self._held.append([column.value(step, derived) for column in self._columns])
        self._flush_if_due()

    def _batch(self) -> Any:
        values = zip(*self._held, strict=True)
        arrays = [pa.array(column, type=field.type) for column, field in zip(values, self._schema, strict=True)]
        return pa.RecordBatch.from_arrays(arrays, schema=self._schema)


class TableRecorder(StepTable[Step]):
    """Writes the table of a run about an ego (`clock` [s])."""

    def __init__(self, path: Path, methods: Sequence[str], clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__(path, table_columns(methods), methods, clock)


def write_step_table(path: Path, log: Path, complete: bool) -> None:
    """Make ``steps.parquet`` of its log, whole or not at all."""
    write_table(path, read_rows(log), complete)


def write_table(path: Path, rows: Any, complete: bool) -> None:
    """Write the rows of a log as a table, whole or not at all."""
    table = rows.replace_schema_metadata(None).combine_chunks()
    file = io.BytesIO()
    # Without a stored copy of the schema readers take its metadata from the end of the file.
    with pq.ParquetWriter(file, table.schema, compression="zstd", store_schema=False) as writer:
        writer.write_table(table, row_group_size=ROWS_PER_GROUP)
        writer.add_key_value_metadata({"fogsim.complete": "true" if complete else "false", **rows.schema.metadata})
    write_bytes(path, file.getvalue())
