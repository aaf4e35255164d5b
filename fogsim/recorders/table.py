"""Every step as a row of a parquet table."""

import io
import json
import math
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Generic

import pyarrow as pa
import pyarrow.parquet as pq

from fogsim.core.files.atomic import write_bytes
from fogsim.core.files.row_log import RowLog, read_rows
from fogsim.recorders.protocol import AnyStep_contra, Derived
from fogsim.recorders.run_directory import ROW_LOG
from fogsim.recorders.table_columns import Column, table_columns
from fogsim.values import Step

ROWS_PER_GROUP = 1024
"""Rows of one row group."""

LOG_PERIOD = 0.5
"""Time between two writings of rows [s]: what a process that is killed loses at most, and what a full disk loses."""


class StepTable(Generic[AnyStep_contra]):
    """Writes ``steps.parquet``: one row a step, columns with units in their names.

    The metadata of its schema says ``fogsim.complete`` (``true`` or ``false``), ``fogsim.methods`` (comma-separated)
    and ``fogsim.columns`` (JSON, one line on each column). Equal steps give equal bytes. Until it is closed, rows are
    in ``steps.arrows`` next to it, at most `LOG_PERIOD` after they were recorded.

    Takes `clock` [s].
    """

    def __init__(
        self,
        path: Path,
        columns: Sequence[Column[AnyStep_contra]],
        methods: Sequence[str] = (),
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._path = path
        self._columns = columns
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

    def record(self, step: AnyStep_contra, derived: Derived) -> None:
        """Add a row; a step that comes once more, with its ending, takes the place of the one before."""
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
        """Make the table of the rows and say in it whether the run was complete."""
        if not self._open:
            return
        if self._log is not None:
            self._log.release_reserve()
        log = self._flush()
        log.release_reserve()
        write_table(self._path, read_rows(log.path), complete)
        log.remove()
        self._open = False


class TableRecorder(StepTable[Step]):
    """Writes the table of a run about an ego (`clock` [s])."""

    def __init__(self, path: Path, methods: Sequence[str], clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__(path, table_columns(methods), methods, clock)


def write_table(path: Path, rows: Any, complete: bool) -> None:
    """Write the rows of a log as a table, whole or not at all."""
    table = rows.replace_schema_metadata(None).combine_chunks()
    file = io.BytesIO()
    # Without a stored copy of the schema readers take its metadata from the end of the file.
    with pq.ParquetWriter(file, table.schema, compression="zstd", store_schema=False) as writer:
        writer.write_table(table, row_group_size=ROWS_PER_GROUP)
        writer.add_key_value_metadata({"fogsim.complete": "true" if complete else "false", **rows.schema.metadata})
    write_bytes(path, file.getvalue())
