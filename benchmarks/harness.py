"""What benchmarks share: command line, progress, results to resume from, figures, and output as JSON or tables."""

import argparse
import json
import multiprocessing
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from rich.console import Console
from rich.progress import track

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "docs"))

from page_tables import ROOT, lines_of, write_table

__all__ = ["ROOT", "Kept", "Row", "apart", "columns", "lines_of", "mean", "median", "parse_options", "progress"]
__all__ += ["publish", "quantile", "timed", "write_table"]

Row = dict[str, Any]
Option = tuple[Any, ...]
Table = Callable[[Any], Iterable[str]]
T = TypeVar("T")


def parse_options(
    doc: str | None, *, docs: tuple[str, str] | None = None, pool: int | Option | None = None, **options: Option
) -> argparse.Namespace:
    """Parse the command line; an option has a default (a type if none, a list for several values), help, and choices.

    With `docs`, page and name of a table, there is ``--docs``; with `pool`, ``--pool``.
    """
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print a list of flat records")
    if docs:
        parser.add_argument("--docs", action="store_true", help=f"write the table of docs/{docs[0]}")
    if pool is not None:
        options["pool"] = pool if isinstance(pool, tuple) else (pool, "0: constants chosen on it", (0, 1))
    lists = {}
    for name, (default, meaning, *choices) in options.items():
        flag = f"-{name}" if len(name) == 1 else f"--{name.replace('_', '-')}"
        allowed: dict[str, Any] = {"choices": list(choices[0])} if choices else {}
        usual = default if isinstance(default, list) else [default]
        said = not isinstance(default, bool | type) and usual not in ([""], allowed.get("choices"))
        allowed["help"] = meaning + (f" ({' '.join(map(str, usual))})" if said else "").replace("%", "%%")
        if isinstance(default, bool):
            parser.add_argument(flag, action="store_true", **allowed)
        elif isinstance(default, type):
            parser.add_argument(flag, type=default, **allowed)
        elif isinstance(default, list):
            lists[name] = default
            parser.add_argument(flag, type=type(default[0]), nargs="+", action="extend", **allowed)
        else:
            parser.add_argument(flag, type=type(default), default=default, **allowed)
    given = parser.parse_args()
    for name, default in lists.items():
        if getattr(given, name) is None:
            setattr(given, name, default)
    given.table, given.error = docs, parser.error
    return given


def publish(
    given: argparse.Namespace, records: Sequence[Row], table: Table | None = None, docs: Table | None = None
) -> None:
    """Print records as JSON or as lines of a table, and with ``--docs`` write that table, or another, into its page."""
    table = table or columns
    if getattr(given, "docs", False):
        page, name = given.table
        write_table(page, name, (docs or table)(records))
    print(json.dumps(records, indent=2) if given.json else "\n".join(table(records)))


def columns(records: Sequence[Row]) -> list[str]:
    """Lines of a table with a column for each key, a dash for what is None or missing."""
    keys = list(dict.fromkeys(key for record in records for key in record))
    rows = [["–" if (value := record.get(key)) is None else str(value) for key in keys] for record in records]
    return lines_of(keys, rows)


def progress(items: Iterable[T], label: str, total: int | None = None) -> Iterable[T]:
    """Items with a bar on the standard error."""
    return track(items, label, total, console=Console(stderr=True))


class Kept:
    """Results by unit in a file, from which an interrupted command resumes; its first line has the settings."""

    def __init__(self, path: Path | None, settings: object) -> None:
        self._path, self.results = path, dict[tuple[Any, ...], Any]()
        if path is None:
            return
        if not path.exists():
            path.write_text(json.dumps(settings) + "\n", encoding="utf-8")
        # A line that an interrupted call has written in part does not count.
        whole = path.read_text(encoding="utf-8").rpartition("\n")[0] + "\n"
        path.write_text(whole, encoding="utf-8")
        first, *lines = whole.splitlines()
        if json.loads(first) != json.loads(json.dumps(settings)):
            sys.exit(f"--keep {path}: it was measured with other settings: {first}")
        self.results = {tuple(unit): result for unit, result in map(json.loads, lines)}

    def add(self, unit: tuple[Any, ...], result: object) -> None:
        """Keep the result of a unit."""
        self.results[unit] = result
        if self._path is not None:
            with self._path.open("a", encoding="utf-8") as file:
                file.write(json.dumps([unit, result]) + "\n")


def median(values: Sequence[Any], digits: int | None = None) -> float | None:
    """Median; None of no values."""
    return _rounded(float(np.median(values)), digits) if len(values) else None


def quantile(values: Sequence[Any], share: float, digits: int | None = None) -> float | None:
    """Quantile; None of no values."""
    return _rounded(float(np.quantile(values, share)), digits) if len(values) else None


def mean(values: Sequence[Any], digits: int | None = None) -> float | None:
    """Mean, or share of truths; None of no values."""
    return _rounded(float(np.mean(values)), digits) if len(values) else None


def _rounded(value: float, digits: int | None) -> float:
    return value if digits is None else round(value, digits)


def apart(call: Callable[..., T], *arguments: Any) -> T:
    """What a call returns in a process of its own."""
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(call, arguments)


def timed(call: Callable[[], T]) -> tuple[T, float]:
    """What a call returns, and how long it takes [ms]."""
    started = time.perf_counter()
    result = call()
    return result, 1e3 * (time.perf_counter() - started)
