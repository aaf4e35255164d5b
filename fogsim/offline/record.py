"""Estimates as JSON, one object a line."""

import json
import math
from collections.abc import Iterator

from fogsim.offline.estimation import FrameEstimates
from fogsim.values import Estimate

DIGITS = 6
"""Significant digits; no method has more than three."""


def record_lines(result: FrameEstimates) -> Iterator[str]:
    """JSON objects of an image: one for each method, or one with an ``error``.

    Parameters
    ----------
    result : FrameEstimates
        The image and its estimates.

    Yields
    ------
    str
        A line without its end; ASCII, strict JSON.
    """
    if result.picture.error:
        yield json.dumps({"frame": result.picture.name, "error": result.picture.error})
    for estimate in result.estimates:
        yield json.dumps(_record(result.picture.name, estimate), allow_nan=False)


def _record(name: str | int, estimate: Estimate) -> dict[str, object]:
    low, high = estimate.visibility_interval
    valid = estimate.valid
    return {
        "frame": name,
        "method": estimate.method,
        "valid": valid,
        "visibility_m": _number(estimate.visibility) if valid else None,
        "visibility_low_m": _number(low) if valid else None,
        "visibility_high_m": _number(high) if valid else None,
        "extinction_per_m": _number(estimate.extinction) if valid else None,
        "category": estimate.category.value if valid else None,
        "horizon_row": _number(estimate.diagnostics.get("horizon_row")) if valid else None,
    }


def _number(value: object) -> float | None:
    """Value with the digits that are shown; None for what JSON has no number for, such as an endless visibility."""
    if not isinstance(value, int | float) or not math.isfinite(value):
        return None
    return float(f"{value:.{DIGITS}g}")
