"""The visibility over a clip, method by method: at its end, over its length, and why there was no answer."""

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fogsim.errors import printable
from fogsim.offline.estimation import FrameEstimates
from fogsim.offline.guess import LaneCheck
from fogsim.offline.results import ENDLESS, metres, span_text
from fogsim.values.camera import Camera
from fogsim.values.estimate import Estimate, fog_category

_RECENT = 1.0
"""Time before the last image over which estimates are summed up as those of now [s]."""

_NEAREST, FARTHEST, COLUMNS = 20.0, 2000.0, 60
"""Visibilities at the ends of the drawn scale [m], and columns of the line of blocks."""

_MOST_REASONS = 3
"""Reasons that are listed, the most frequent ones."""

_BLOCKS = "▁▂▃▄▅▆▇█"


@dataclass(frozen=True, slots=True)
class Reading:
    """What a method made of one image: visibility, its 90 % interval [m], or why there is none."""

    time: float
    visibility: float
    low: float
    high: float
    reason: str = ""

    @classmethod
    def of(cls, time: float, estimate: Estimate) -> "Reading":
        """From an estimate at an instant [s]."""
        low, high = estimate.visibility_interval
        reason = "" if estimate.valid else str(estimate.diagnostics.get("reason") or "no reason given")
        return cls(time, estimate.visibility if estimate.valid else math.nan, low, high, reason)


class Clip:
    """Readings of each method over a clip, and what contradicts the height of the camera, if one is given."""

    def __init__(self, methods: tuple[str, ...], camera: Camera | None = None) -> None:
        self._lanes = None if camera is None else LaneCheck(camera)
        self._readings: dict[str, list[Reading]] = {method: [] for method in methods}

    def add(self, result: FrameEstimates) -> None:
        """Add the estimates of an image."""
        if self._lanes is not None and result.picture.image is not None:
            self._lanes.add(result.picture.image)
        for estimate in result.estimates:
            self._readings[estimate.method].append(Reading.of(result.picture.time, estimate))

    def remarks(self) -> Iterator[str]:
        """What the images say against the calibration."""
        return iter(()) if self._lanes is None else self._lanes.remarks()

    def lines(self) -> Iterator[str]:
        """Summary as text."""
        for method, readings in self._readings.items():
            yield method
            if readings:
                yield from (f"  {line}" for line in _summary(readings))

    def plot(self, title: str) -> Figure:
        """Draw visibilities with their intervals over time."""
        count = len(self._readings)
        figure = Figure(figsize=(9.0, 1.0 + 2.4 * count), layout="constrained")
        panels = figure.subplots(count, 1, squeeze=False, sharex=True)[:, 0]
        for axes, (method, readings) in zip(panels, self._readings.items(), strict=True):
            _draw(axes, readings)
            axes.set_title(printable(method), loc="left", fontsize="medium", parse_math=False)
        panels[-1].set_xlabel("time [s]")
        figure.suptitle(printable(title), fontsize="large", parse_math=False)
        return figure


def _summary(readings: list[Reading]) -> Iterator[str]:
    valid = [one for one in readings if not math.isnan(one.visibility)]
    end = readings[-1].time
    recent = [one for one in valid if one.time >= end - _RECENT]
    length = end - readings[0].time
    if recent:
        middle, low, high = (float(np.median([getattr(one, name) for one in recent])) for name in _VALUES)
        yield f"at the end     {metres(middle)} (90 %: {span_text(low, high)}), fog: {fog_category(middle).value}"
    else:
        yield f"at the end     no estimate: {readings[-1].reason or 'no valid estimate in the last second'}"
    if valid:
        low, middle, high = np.quantile([min(one.visibility, ENDLESS) for one in valid], (0.05, 0.5, 0.95))
        yield f"{f'over {length:.1f} s':15}median {metres(middle)}, 9 of 10 frames within {span_text(low, high)}"
        yield f"               {_blocks(readings)}  {_NEAREST:.0f} m … {FARTHEST:.0f} m, log scale"
    yield f"valid          {len(valid)} of {len(readings)} frames"
    reasons = Counter(one.reason for one in readings if one.reason)
    for reason, count in reasons.most_common(_MOST_REASONS):
        yield f"no answer      {count} × {reason}"


_VALUES = ("visibility", "low", "high")


def _blocks(readings: list[Reading]) -> str:
    """Medians of visibility over equal parts of the clip as a line of blocks; blank where there is no answer."""
    columns = []
    for part in np.array_split(np.array([one.visibility for one in readings]), min(COLUMNS, len(readings))):
        seen = part[~np.isnan(part)]
        if seen.size == 0:
            columns.append(" ")
            continue
        share = math.log(min(max(float(np.median(seen)), _NEAREST), FARTHEST) / _NEAREST) / math.log(
            FARTHEST / _NEAREST
        )
        columns.append(_BLOCKS[min(int(share * len(_BLOCKS)), len(_BLOCKS) - 1)])
    return "".join(columns)


def _draw(axes: Axes, readings: list[Reading]) -> None:
    time = np.array([one.time for one in readings])
    shown, low, high = (np.array([getattr(one, name) for one in readings]) for name in _VALUES)
    silent = np.isnan(shown)
    low, high = (np.where(silent, np.nan, np.clip(end, _NEAREST, FARTHEST)) for end in (low, high))
    axes.fill_between(time, low, high, alpha=0.25, linewidth=0, label="90 % interval")
    axes.plot(time, np.clip(shown, _NEAREST, FARTHEST), linewidth=1.4, label="visibility")
    if silent.any():
        axes.plot(time[silent], np.full(int(silent.sum()), _NEAREST), "|", color="0.5", label="no answer")
    axes.set(yscale="log", ylim=(_NEAREST, FARTHEST), ylabel="V_met [m]")
    axes.set_yticks([20, 50, 100, 300, 1000], ["20", "50", "100", "300", "1000"])
    axes.grid(alpha=0.3)
    axes.legend(loc="upper right", fontsize="small")
