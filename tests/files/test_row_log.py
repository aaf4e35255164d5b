"""Rows that survive the process that writes them."""

from pathlib import Path
from types import SimpleNamespace

import pyarrow as pa
import pytest

from fogsim.core.files.row_log import RowLog, read_rows
from fogsim.errors import InputError

SCHEMA = pa.schema([("index", pa.int64()), ("speed", pa.float64())])


def batch(*rows: tuple[int, float]) -> pa.RecordBatch:
    return pa.RecordBatch.from_arrays([pa.array(column) for column in zip(*rows, strict=True)], schema=SCHEMA)


def test_rows_are_read_back_and_of_equal_ones_the_last_counts(tmp_path: Path) -> None:
    log = RowLog(tmp_path / "rows", SCHEMA)
    log.append(batch((0, 1.0), (1, 2.0)))
    log.append(batch((1, 2.5), (2, 3.0)))
    assert read_rows(log.path).to_pydict() == {"index": [0, 1, 2], "speed": [1.0, 2.5, 3.0]}
    log.remove()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("missing", [1, 40])
def test_a_log_that_was_cut_off_in_a_row_keeps_those_before(tmp_path: Path, missing: int) -> None:
    log = RowLog(tmp_path / "rows", SCHEMA)
    log.append(batch((0, 1.0)))
    log.append(batch((1, 2.0)))
    log.path.write_bytes(log.path.read_bytes()[:-missing])
    assert read_rows(log.path)["index"].to_pylist() == [0]


def test_a_damaged_row_ends_the_log_and_not_the_process(tmp_path: Path) -> None:
    schema = pa.schema([("index", pa.int64()), ("name", pa.string())])
    log = RowLog(tmp_path / "rows", schema)
    for index in range(2):
        log.append(pa.RecordBatch.from_pydict({"index": [index], "name": ["abc"]}, schema=schema))
    content = log.path.read_bytes()
    place = content.rindex((3).to_bytes(4, "little") + bytes(4))
    log.path.write_bytes(content[:place] + (2**30).to_bytes(4, "little") + content[place + 4 :])
    assert read_rows(log.path).to_pydict() == {"index": [0], "name": ["abc"]}


def test_a_disk_that_fails_is_not_the_end_of_the_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail() -> None:
        raise OSError(5, "Input/output error")

    log = RowLog(tmp_path / "rows", SCHEMA)
    monkeypatch.setattr(pa.ipc, "open_stream", lambda _: SimpleNamespace(schema=SCHEMA, read_next_batch=fail))
    with pytest.raises(OSError, match="Input/output error"):
        read_rows(log.path)


def test_what_is_no_log_is_told(tmp_path: Path) -> None:
    (tmp_path / "none").write_bytes(b"no rows")
    with pytest.raises(InputError, match="holds no rows"):
        read_rows(tmp_path / "none")
