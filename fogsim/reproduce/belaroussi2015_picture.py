"""A picture like the paper's figures 3 and 4: the detector's curve, and estimated against true visibility."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fogsim.estimators.signs.operating_range import OperatingRange
from fogsim.reproduce.figure_image import figure_image
from fogsim.reproduce.result import Cell

_MARKS = ("o", "s", "^", "D")


def picture(
    records: Sequence[Mapping[str, Cell]],
    ranges: Sequence[tuple[str, OperatingRange]],
    published: Mapping[float, float | None],
) -> NDArray[np.uint8]:
    """Draw operating ranges by camera on the left, estimates and the paper's on the right: (rows, cols, 3) uint8."""
    figure = Figure(figsize=(12.0, 5.0), dpi=100, layout="constrained")
    left, right = figure.subplots(1, 2)
    _draw_ranges(left, ranges)
    _draw_estimates(right, records, [name for name, _ in ranges], published)
    return figure_image(figure)


def _draw_ranges(axes: Axes, ranges: Sequence[tuple[str, OperatingRange]]) -> None:
    for number, (name, measured) in enumerate(ranges):
        colour, mark = f"C{number}", _MARKS[number % len(_MARKS)]
        axes.errorbar(
            measured.first_detection, measured.visibility, xerr=measured.deviation, fmt=mark, color=colour, label=name
        )
        axes.plot(measured.operating_range, measured.visibility, mark, mfc="none", color=colour)
        low, high = measured.reach
        if low < high:
            distances = np.linspace(low, high, 100).tolist()
            found = [measured.visibility_at(distance) for distance in distances]
            axes.plot(distances, [np.nan if one is None else one[0] for one in found], color=colour)
        reach = np.linspace(min(measured.operating_range), max(measured.operating_range), 100)
        axes.plot(reach, np.polyval(measured.cubic, reach), ":", color=colour)
    axes.set(xlabel="distance of first detection (open: of 80 % detection) [m]", ylabel="V_met [m]", ylim=(0.0, 700.0))
    axes.set_title("Operating range; dotted: cubic through 80 %", fontsize=10)
    axes.legend(title="focal length", loc="upper left")


def _draw_estimates(
    axes: Axes, records: Sequence[Mapping[str, Cell]], names: Sequence[str], published: Mapping[float, float | None]
) -> None:
    truth = list(published)
    axes.plot(truth, truth, color="0.6", lw=1)
    known = [(v, value) for v, value in published.items() if value is not None]
    axes.plot(*zip(*known, strict=True), "x", color="black", ms=9, label="the paper's text")
    for number, name in enumerate(names):
        mine = [record for record in records if record["camera"] == name]
        for key, fill, label in (("ours_m", f"C{number}", "ours"), ("cubic_m", "none", "cubic")):
            points = [(record["visibility_m"], record[key]) for record in mine if record[key] is not None]
            if points:
                mark = _MARKS[number % len(_MARKS)]
                axes.plot(*zip(*points, strict=True), mark, color=f"C{number}", mfc=fill, label=f"{name}, {label}")
    axes.set(xlabel="true V_met [m]", ylabel="estimated V_met [m]", ylim=(0.0, 600.0))
    axes.legend(loc="upper left", fontsize=8)
