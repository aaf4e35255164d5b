"""Rows in a file that stays readable however its process ends."""

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

import numpy as np
import pyarrow as pa

from fogsim.core.files.atomic import Reserve, naming
from fogsim.errors import FogSimError, InputError


class RowLog:
    """A file in Arrow's streaming format, which is readable wherever it ends.

    It reserves as much disk space as it has written, for the table that is made from it.
    """

    def __init__(self, path: Path, schema: Any) -> None:
        self.path = path
        self._reserve = Reserve(path.with_name(path.name + ".reserve"))
        self._whole = 0
        with naming(path):
            path.touch()
        self._write(schema.serialize())

    def append(self, batch: Any) -> None:
        """Write rows (pyarrow.RecordBatch), which then survive the process; on a full disk, none of them is written."""
        data = batch.serialize()
        self._reserve.grow(data.size)
        self._write(data)

    def _write(self, data: Any) -> None:
        rest = memoryview(data)
        # Not kept open, since a recorder may be abandoned at any time.
        with naming(self.path), self.path.open("r+b", buffering=0) as file:
            # Overwrites what an interruption left of earlier rows.
            file.seek(self._whole)
            try:
                while rest:
                    rest = rest[file.write(rest) :]
            except OSError:
                file.truncate(self._whole)
                raise
        self._whole += data.size

    def release_reserve(self) -> None:
        """Release the reserved space."""
        self._reserve.release()

    def remove(self) -> None:
        """Remove the file; may be called twice."""
        self._reserve.release()
        self.path.unlink(missing_ok=True)


def row_schema(path: Path) -> Any:
    """Columns of a log, as a pyarrow.Schema."""
    with path.open("rb") as file:
        return _reader(path, file).schema


def row_batches(path: Path) -> Iterator[Any]:
    """Batches of rows of a log (pyarrow.RecordBatch) up to where it was cut off."""
    # Opened here, since Arrow accepts only names in UTF-8.
    with path.open("rb") as file:
        reader = _reader(path, file)
        while True:
            try:
                with _noting_damage(path):
                    batch = reader.read_next_batch()
                    # Damaged offsets would crash the process when rows are read.
                    batch.validate(full=True)
            except (StopIteration, InputError):
                # Unreadable data is the end of a log that was cut off.
                return
            yield batch


def _reader(path: Path, file: IO[bytes]) -> Any:
    with _noting_damage(path):
        reader = pa.ipc.open_stream(file)
        if "index" in reader.schema.names:
            return reader
    raise InputError(f"{path} holds no rows that can be read: there is no column index")


@contextlib.contextmanager
def _noting_damage(path: Path) -> Iterator[None]:
    """Raise InputError for damage, but not if the disk or memory fails: the rows are there still."""
    try:
        yield
    except MemoryError as error:
        raise FogSimError(f"{path}: too little memory for its rows, or damaged: {error}") from error
    except (pa.ArrowException, UnicodeDecodeError, OSError) as error:
        # Those of Arrow's own have no number.
        if isinstance(error, OSError) and error.errno is not None:
            raise
        raise InputError(f"{path} holds no rows that can be read: {error}") from error


def read_rows(path: Path) -> Any:
    """Rows of a log as a pyarrow.Table sorted by ``index``; of rows with the same index, the last one counts."""
    schema = row_schema(path)
    table = pa.Table.from_batches(row_batches(path), schema=schema)
    index = table["index"].to_numpy()
    least_behind = np.minimum.accumulate(index[::-1])[::-1]
    last = np.append(index[:-1] < least_behind[1:], True)[: len(index)]
    return table if last.all() else table.filter(pa.array(last))
