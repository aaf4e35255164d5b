"""Estimates as lines of a table that can be printed one by one."""

from collections.abc import Iterator, Sequence

from fogsim.offline.estimation import FrameEstimates
from fogsim.offline.source import Source
from fogsim.offline.wording import interval_text, metres
from fogsim.values import Estimate

_MOST_NAME = 48
"""Columns that a file's name may take; a longer one loses its beginning."""


def table_heading(source: Source, methods: Sequence[str]) -> str:
    """Heading over the rows of a source."""
    return _line(
        _widths(source, methods),
        ("frame", "method", "visibility", "90 % interval", "extinction", "category", "horizon"),
    )


def table_rows(source: Source, methods: Sequence[str], result: FrameEstimates) -> Iterator[str]:
    """One row for each method; none for an image that could not be used."""
    widths = _widths(source, methods)
    name = str(result.picture.name)
    shown = name if len(name) <= _MOST_NAME else "…" + name[1 - _MOST_NAME :]
    for estimate in result.estimates:
        yield _line(widths, (shown, estimate.method, *_cells(estimate)))


def _widths(source: Source, methods: Sequence[str]) -> tuple[int, int]:
    longest = max((len(str(path)) for path in source.paths), default=5) if source.count == len(source.paths) else 8
    return min(max(longest, 5), _MOST_NAME), max(6, *(len(name) for name in methods))


def _line(widths: tuple[int, int], cells: Sequence[str]) -> str:
    frame, method, visibility, *rest = cells
    start = f"{frame:<{widths[0]}}  {method:<{widths[1]}}  "
    if not rest:
        return start + visibility
    interval, extinction, category, horizon = rest
    return f"{start}{visibility:>10}  {interval:>17}  {extinction:>11}  {category:<10}  {horizon:>9}".rstrip()


def _cells(estimate: Estimate) -> tuple[str, ...]:
    if not estimate.valid:
        return (f"cannot tell: {estimate.diagnostics.get('reason', 'no reason given')}",)
    horizon = estimate.diagnostics.get("horizon_row")
    return (
        metres(estimate.visibility),
        interval_text(estimate),
        f"{estimate.extinction:.4f} /m",
        estimate.category.value,
        f"row {horizon:.1f}" if isinstance(horizon, int | float) else "",
    )
