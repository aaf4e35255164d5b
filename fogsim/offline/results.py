"""Estimates as text: JSON, one object per line, CSV, and table rows that can be printed one by one."""

import csv
import io
import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from numbers import Real

from fogsim.offline.drive.sign_watch import SignSummary
from fogsim.offline.estimation import FrameEstimates
from fogsim.offline.source import Picture, Source
from fogsim.values import Estimate, SignLook

ENDLESS = 10_000.0
"""Visibility from which the air is called clear [m]."""


def metres(visibility: float) -> str:
    """Visibility [m] with its unit; "clear" from ten kilometres on."""
    return "clear" if visibility >= ENDLESS else f"{visibility:.0f} m"


def interval_text(estimate: Estimate) -> str:
    """The 90 % interval of a valid estimate's visibility."""
    return span_text(*estimate.visibility_interval)


def span_text(low: float, high: float) -> str:
    """An interval of visibilities [m]."""
    if high >= ENDLESS:
        return f"> {low:.0f} m"
    return f"{low:.0f} – {high:.0f} m"


_DIGITS = 6
"""Significant digits; no method has more than three."""

_LONG = 1000.0
"""Time from which on it has milliseconds instead, since six digits do not distinguish a long drive's frames [s]."""


def record_lines(result: FrameEstimates) -> Iterator[str]:
    """JSON objects of an image: one for each method and one with its ``signs``, if any; or one with an ``error``.

    Parameters
    ----------
    result : FrameEstimates
        The image and its estimates.

    Yields
    ------
    str
        A line without its end; ASCII, strict JSON.
    """
    picture = result.picture
    if picture.error:
        yield json.dumps({**_place(picture), "error": picture.error})
    for estimate in result.estimates:
        yield json.dumps(_record(picture, estimate), allow_nan=False)
    if result.signs:
        signs = [_sign_record(sign) for sign in result.signs]
        yield json.dumps({**_place(picture), "signs": signs}, allow_nan=False)


CSV_KEYS = (
    *("frame", "time_s", "method", "valid", "visibility_m", "visibility_low_m", "visibility_high_m"),
    *("extinction_per_m", "category", "horizon_row", "reason"),
)


def csv_lines(result: FrameEstimates) -> Iterator[str]:
    """Rows of CSV of an image, with the columns of `CSV_KEYS`.

    Parameters
    ----------
    result : FrameEstimates
        The image and its estimates.

    Yields
    ------
    str
        A line without its end for each method; one with the reason alone for an image that could not be used.
    """
    picture = result.picture
    if picture.error:
        yield csv_line({**_place(picture), "valid": False, "reason": picture.error})
    for estimate in result.estimates:
        yield csv_line(_record(picture, estimate))


def csv_line(values: Mapping[str, object] = dict(zip(CSV_KEYS, CSV_KEYS, strict=True))) -> str:
    """Cells of a row of CSV as text; the heading by default.

    Parameters
    ----------
    values : Mapping
        Values by the names of `CSV_KEYS`.
    """
    text = io.StringIO()
    csv.DictWriter(text, CSV_KEYS, extrasaction="ignore", lineterminator="").writerow(dict(values))
    return text.getvalue()


def _sign_record(sign: SignLook) -> dict[str, object]:
    return {
        "sign_id": sign.sign_id,
        "distance_m": _number(sign.distance),
        "detected": sign.detected,
        "u_px": _number(sign.u),
        "v_px": _number(sign.v),
        "radius_px": _number(sign.radius),
        "first_seen_m": _number(sign.first_seen),
    }


def _place(picture: Picture) -> dict[str, object]:
    time = picture.time
    return {"frame": picture.name, "time_s": round(time, 3) if time >= _LONG else _number(time)}


def _record(picture: Picture, estimate: Estimate) -> dict[str, object]:
    low, high = estimate.visibility_interval
    valid = estimate.valid
    return {
        **_place(picture),
        "method": estimate.method,
        "valid": valid,
        "visibility_m": _number(estimate.visibility) if valid else None,
        "visibility_low_m": _number(low) if valid else None,
        "visibility_high_m": _number(high) if valid else None,
        "extinction_per_m": _number(estimate.extinction) if valid else None,
        "category": estimate.category.value if valid else None,
        "horizon_row": _number(estimate.diagnostics.get("horizon_row")) if valid else None,
        "reason": None if valid else estimate.diagnostics.get("reason"),
        **_along_the_road(estimate),
    }


def _along_the_road(estimate: Estimate) -> dict[str, object]:
    """How the fog varies ahead, for methods that estimate it."""
    curve = estimate.optical_depths
    if curve is None:
        return {}
    rows = zip(curve.distance, curve.depth, curve.standard_deviation, strict=True)
    return {
        "reach_m": _number(estimate.reach),
        "denser_fog_m": None if estimate.denser is None else _number(estimate.denser.distance),
        "optical_depths": [[_number(value) for value in row] for row in rows],
    }


def denser_text(estimate: Estimate) -> str:
    """Where much denser fog is ahead; empty if nowhere."""
    return "" if estimate.denser is None else f"denser beyond {estimate.denser.distance:.0f} m"


def _number(value: object) -> float | None:
    """Value with the shown digits; None for values without a JSON number, such as infinite visibility."""
    if not isinstance(value, Real) or not math.isfinite(value):
        return None
    return float(f"{float(value):.{_DIGITS}g}")


_MOST_NAME = 48
"""Width of the column of file names; a longer name loses its beginning."""


def table_heading(source: Source, methods: Sequence[str]) -> str:
    """Heading over the rows of a source.

    Parameters
    ----------
    source : Source
        The images.
    methods : sequence of str
        Names of the methods.
    """
    return _line(
        _widths(source, methods),
        ("frame", "method", "visibility", "90 % interval", "extinction", "category", "horizon"),
    )


def table_rows(source: Source, methods: Sequence[str], result: FrameEstimates) -> Iterator[str]:
    """One row for each method; none for an image that could not be used.

    Parameters
    ----------
    source : Source
        The images.
    methods : sequence of str
        Names of the methods.
    result : FrameEstimates
        One image and its estimates.
    """
    widths = _widths(source, methods)
    name = str(result.picture.name)
    shown = name if len(name) <= _MOST_NAME else "…" + name[1 - _MOST_NAME :]
    for estimate in result.estimates:
        yield _line(widths, (shown, estimate.method, *_cells(estimate)))


def summary_rows(signs: Iterable[SignSummary]) -> Iterator[str]:
    """Table of the signs of a drive; empty without signs.

    Parameters
    ----------
    signs : iterable of SignSummary
        Summary of each sign.
    """
    for number, sign in enumerate(signs):
        if number == 0:
            yield f"{'sign':<20}  {'kind':<20}  {'first seen at':>13}  {'seen in':>7}  {'missed in':>9}"
        first = "not seen" if sign.first_seen is None else f"{sign.first_seen:.0f} m"
        yield f"{sign.sign_id:<20}  {sign.kind:<20}  {first:>13}  {sign.detections:>7}  {sign.misses:>9}"


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
        return (f"no estimate: {estimate.diagnostics.get('reason', 'no reason given')}",)
    horizon = estimate.diagnostics.get("horizon_row")
    return (
        metres(estimate.visibility),
        interval_text(estimate),
        f"{estimate.extinction:.4f} /m",
        estimate.category.value,
        f"row {float(horizon):.1f}" if isinstance(horizon, Real) else "",
    )
