"""Signals of conditions in a run, as a figure: a panel for each signal, with the limits and the failure."""

import math
from collections.abc import Iterable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fogsim.conditions import SIGNALS, Comparison, Condition, Edge, History, Quantity, Reference, signals_of
from fogsim.conditions.signal import LanePlace, Value
from fogsim.conditions.syntax import comparisons_of
from fogsim.study.drawing import INK, MUTED, WIDTH, dress, svg_of
from fogsim.units.quantities import parse_quantity
from fogsim.values import TrafficStep

_MOST_PANELS = 6
"""Maximum number of signals in a figure."""

_ALARM, _LIMIT = "#cf3a34", "#9a6700"
_PANEL_HEIGHT = 1.25


class SignalLog:
    """Signals of some conditions, step by step."""

    def __init__(self, conditions: Iterable[Condition]) -> None:
        asked = list(dict.fromkeys(conditions))
        self.limits = list(dict.fromkeys(limit for one in asked for limit in _limits(one)))
        signals = dict.fromkeys(signal for one in asked for signal in signals_of(one))
        self.values: dict[Reference, list[Value]] = {signal: [] for signal in signals}
        self.times: list[float] = []
        self._history = History()

    def update(self, step: TrafficStep) -> None:
        """Record the signals at the next step."""
        moment = self._history.moment(step)
        self.times.append(step.time)
        for signal, values in self.values.items():
            values.append(SIGNALS[signal.signal].read(moment, signal.arguments))


def _limits(condition: Condition) -> list[tuple[Reference, Quantity]]:
    return [
        (one.left, one.right)
        for one in comparisons_of(condition)
        if isinstance(one, Comparison | Edge) and isinstance(one.right, Quantity)
    ]


def plot_signals(log: SignalLog, title: str, failures: Sequence[float]) -> str:
    """Draw signals over time as SVG, with marks where something failed [s]."""
    shown = list(log.values)[:_MOST_PANELS]
    figure = Figure(figsize=(WIDTH, 0.7 + _PANEL_HEIGHT * len(shown)), layout="constrained")
    panels = figure.subplots(len(shown), 1, squeeze=False, sharex=True)[:, 0]
    for axes, signal in zip(panels, shown, strict=True):
        dress(axes)
        _draw(axes, signal, log)
        for instant in failures:
            axes.axvline(instant, color=_ALARM, linewidth=1.2, linestyle=(0, (4, 2)))
    panels[0].set_title(title, fontsize=8.5, loc="left", color=INK)
    panels[-1].set_xlabel("time [s]", fontsize=8.5, color=INK)
    return svg_of(figure, title)


def _draw(axes: Axes, signal: Reference, log: SignalLog) -> None:
    unit, values = SIGNALS[signal.signal].stated_in, log.values[signal]
    texts = sorted({text for text in map(_text, values) if text is not None})
    if texts:
        # Words have no order: each gets a line.
        heights = [math.nan if (text := _text(value)) is None else float(texts.index(text)) for value in values]
        axes.set_yticks(range(len(texts)), texts)
        axes.set_ylim(-0.5, len(texts) - 0.5)
    else:
        size = parse_quantity(f"1 {unit}", SIGNALS[signal.signal].unit) if unit else 1.0
        heights = [_number(value) / size for value in values]
        for limit in (right for left, right in log.limits if left == signal):
            axes.axhline(limit.value / size, color=_LIMIT, linewidth=1.0, linestyle=(0, (1.5, 1.5)))
            axes.annotate(str(limit), (1.0, limit.value / size), xycoords=("axes fraction", "data"), fontsize=7)
    axes.plot(log.times, np.array(heights), color=INK, linewidth=1.4, drawstyle="steps-post" if texts else "default")
    axes.set_ylabel(f"{signal}\n[{unit}]" if unit else str(signal), fontsize=7.5, color=MUTED)


def _text(value: Value) -> str | None:
    """Word of a value that is not a number; None for a number or an unknown value."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, frozenset):
        return " ".join(sorted(value)) or "none"
    return value if isinstance(value, str) else None


def _number(value: Value) -> float:
    """Number to draw; NaN, a gap, if it is unknown or infinite."""
    if isinstance(value, LanePlace):
        return float(value.number)
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else math.nan
