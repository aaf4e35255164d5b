"""The table of a study: a row for each run in the order of the grid, regardless of the order of execution."""

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from fogsim.core.files.atomic import write_bytes, write_text
from fogsim.errors import InputError
from fogsim.metrics import metric_definitions
from fogsim.study.main_metrics import METHODS_KEY
from fogsim.study.run_file import Value

Row = Mapping[str, Value]
"""Factors, seed, status, message, and every metric of one run."""


def _columns(rows: Sequence[Row]) -> list[str]:
    """Names of all columns, in the order in which they first appear."""
    return list(dict.fromkeys(key for row in rows for key in row))


def rows_of_cells(factors: Iterable[str], rows: Iterable[Row]) -> dict[tuple[str, ...], list[Row]]:
    """Rows by the levels of all factors."""
    names = tuple(factors)
    cells: dict[tuple[str, ...], list[Row]] = {}
    for row in rows:
        cells.setdefault(tuple(str(row[name]) for name in names), []).append(row)
    return cells


FIXED_COLUMNS = frozenset({"run", "seed", "status", "message", "sumo_outputs"})
"""Columns of every table, besides factors and metrics."""


def column_mistake(factor: str) -> str | None:
    """Why the table cannot have a column of a factor's name; None if it can."""
    if factor in FIXED_COLUMNS:
        return "the table has a column of that name; choose another"
    if factor in metric_definitions() or factor.startswith(f"{METHODS_KEY}."):
        return "a metric has that name; choose another"
    return None


def check_factors(rows: Sequence[Row], levels: Sequence[Mapping[str, str]]) -> None:
    """Raise InputError if a metric, such as a user's, has the column name of a factor."""
    for row, wanted in zip(rows, levels, strict=True):
        for factor, level in wanted.items():
            if row[factor] != level:
                raise InputError(
                    f"factors.{factor}: run {row['run']} has a metric of that name, which would take its column; "
                    "rename the factor and give the same command again: finished runs are kept"
                )


def write_table(rows: Sequence[Row], folder: Path) -> None:
    """Write ``study.parquet`` and ``study.csv``, with a row per run and the same bytes for the same rows."""
    names = _columns(rows)
    table = pa.table({name: _column([row.get(name) for row in rows]) for name in names})
    content = io.BytesIO()
    pq.write_table(table, content)
    write_bytes(folder / "study.parquet", content.getvalue())
    write_csv(folder / "study.csv", names, [[row.get(name) for name in names] for row in rows])


def _column(values: Sequence[Value]) -> pa.Array:
    """A column of text, integers or floats; text if types are mixed."""
    kinds = {type(value) for value in values if value is not None}
    if kinds <= {int}:
        return pa.array(values, pa.int64()) if kinds else pa.array(values, pa.float64())
    if kinds <= {int, float}:
        return pa.array([None if v is None else float(v) for v in values], pa.float64())
    return pa.array([None if v is None else str(v) for v in values], pa.string())


def write_csv(path: Path, names: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Write a table as CSV; undefined values are empty cells."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(names)
    writer.writerows([["" if value is None else value for value in row] for row in rows])
    write_text(path, text.getvalue())
