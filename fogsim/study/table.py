"""The table of a study: a row for each run, in the order of the grid, whatever the order in which they were run."""

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from fogsim.files.atomic import write_bytes, write_text
from fogsim.study.run_file import Value

Row = Mapping[str, Value]
"""Factors, seed, status, message, and every metric of one run."""


def columns(rows: Sequence[Row]) -> list[str]:
    """Names of all columns, in the order in which they first appear.

    Parameters
    ----------
    rows : sequence of Row
        The table.
    """
    return list(dict.fromkeys(key for row in rows for key in row))


def write_table(rows: Sequence[Row], folder: Path) -> None:
    """Write ``study.parquet`` and ``study.csv``, with a row for each run and the same bytes for the same rows.

    Parameters
    ----------
    rows : sequence of Row
        The table.
    folder : Path
        Where they go.
    """
    names = columns(rows)
    table = pa.table({name: _column([row.get(name) for row in rows]) for name in names})
    content = io.BytesIO()
    pq.write_table(table, content)
    write_bytes(folder / "study.parquet", content.getvalue())
    write_csv(folder / "study.csv", names, [[row.get(name) for name in names] for row in rows])


def _column(values: Sequence[Value]) -> pa.Array:
    """A column of text, whole numbers or numbers; text where kinds are mixed."""
    kinds = {type(value) for value in values if value is not None}
    if kinds <= {int}:
        return pa.array(values, pa.int64()) if kinds else pa.array(values, pa.float64())
    if kinds <= {int, float}:
        return pa.array([None if v is None else float(v) for v in values], pa.float64())
    return pa.array([None if v is None else str(v) for v in values], pa.string())


def write_csv(path: Path, names: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Write a table as CSV; what is undefined is an empty cell.

    Parameters
    ----------
    path : Path
        The file.
    names : sequence of str
        Its columns.
    rows : sequence of sequences
        Its rows.
    """
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(names)
    writer.writerows([["" if value is None else value for value in row] for row in rows])
    write_text(path, text.getvalue())
