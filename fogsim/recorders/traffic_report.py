"""The report of traffic alone: everyone over time and over the road, and no camera."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from fogsim.recorders.protocol import Derived, RunInformation
from fogsim.recorders.report import StepReport
from fogsim.recorders.report_figures import (
    ADVICE,
    BELIEF,
    SPEED,
    TRUTH,
    drawn_figure,
    figure_over_time,
    plottable,
    scale_visibility,
    shown_visibility,
)
from fogsim.recorders.table_columns import least_visibility, lowest_advice
from fogsim.units import KMH_PER_MPS, finite_or_none, visibility_from_extinction
from fogsim.values import TrafficStep

_SPREAD = (15.0, 85.0)
"""Percentiles of the speeds of all vehicles between which a band is drawn [%]; the 85th is traffic engineers' usual."""


@dataclass(slots=True)
class TrafficCurves:
    """Quantities of everyone over time, one entry a step; None where a quantity is undefined or without limit."""

    # time, mean_speed, slow, fast, advice: in s and m/s; `slow` and `fast` are the 15th and 85th percentile of speed,
    # `advice` is the lowest anywhere
    time: list[float] = field(default_factory=list)
    mean_speed: list[float | None] = field(default_factory=list)
    slow: list[float | None] = field(default_factory=list)
    fast: list[float | None] = field(default_factory=list)
    advice: list[float | None] = field(default_factory=list)
    # vehicles, advised: vehicles in the network, and those of them whose drivers have heard an advice in force
    vehicles: list[int] = field(default_factory=list)
    advised: list[int] = field(default_factory=list)
    # metered, least: visibility at the meter that sees least, and least at the eyes of any driver [m]
    metered: list[float | None] = field(default_factory=list)
    least: list[float | None] = field(default_factory=list)
    collisions: list[float] = field(default_factory=list)  # Instants of collisions [s]

    def add(self, step: TrafficStep) -> None:
        """Take in one step."""
        speed = step.traffic.speed
        slow, fast = np.percentile(speed, _SPREAD).tolist() if len(speed) else (None, None)
        self.time.append(step.time)
        self.mean_speed.append(float(speed.mean()) if len(speed) else None)
        self.slow.append(slow)
        self.fast.append(fast)
        self.advice.append(finite_or_none(lowest_advice(step)))
        self.vehicles.append(len(speed))
        self.advised.append(int(np.isfinite(step.traffic.advised_speed).sum()))
        self.metered.append(finite_or_none(step.truth.visibility))
        self.least.append(least_visibility(step))
        self.collisions.extend(map(step.time_of, step.collisions))


class TrafficReportRecorder(StepReport[TrafficStep]):
    """Writes the report of traffic alone."""

    def __init__(self, information: RunInformation) -> None:
        super().__init__(information)
        self._curves = TrafficCurves()

    def _remember(self, step: TrafficStep, derived: Derived) -> None:  # noqa: ARG002 - all of it is of an ego
        self._curves.add(step)

    def _figures(self) -> Sequence[tuple[str, bytes]]:
        along_road = self._information.along_road()
        return [*_draw_traffic_figures(self._curves), *([_road_figure(along_road)] if len(along_road) else [])]


def _draw_traffic_figures(curves: TrafficCurves) -> list[tuple[str, bytes]]:
    """Caption and PNG of every figure of the report of traffic alone."""
    time, collisions = curves.time, curves.collisions
    return [
        (
            "Speed of all vehicles in the network: mean, and 15th to 85th percentile; lowest advice in force anywhere.",
            figure_over_time(time, collisions, (3.0,), lambda axes: _draw_speed(axes[0], curves)),
        ),
        (
            "Vehicles in the network, and those whose drivers have heard an advice in force.",
            figure_over_time(time, collisions, (2.2,), lambda axes: _draw_vehicles(axes[0], curves)),
        ),
        (
            "Meteorological visibility: at the visibility meter at the road that sees least, and least at the eyes of "
            "any driver; 2000 m stands for all that is more.",
            figure_over_time(time, collisions, (2.5,), lambda axes: _draw_visibility(axes[0], curves)),
        ),
    ]


def _road_figure(along_road: NDArray[np.float64]) -> tuple[str, bytes]:
    """Caption and PNG of speed over the road, and of the visibility there (`along_road` (n, 4))."""
    # No one's mean is a line across a stretch that no one was on.
    place, speed, extinction, _ = np.insert(along_road, _breaks(along_road[:, 0]), np.nan, axis=0).T

    def draw(axes: Sequence[Axes]) -> None:
        axes[0].plot(place / 1000.0, speed * KMH_PER_MPS, color=SPEED, linewidth=1.6)
        axes[0].set_ylim(bottom=0)
        axes[0].set_ylabel("mean speed [km/h]", fontsize=9)
        visibilities = [None if math.isnan(k) else finite_or_none(visibility_from_extinction(k)) for k in extinction]
        axes[1].plot(place / 1000.0, shown_visibility(visibilities), color=TRUTH, linewidth=1.6)
        scale_visibility(axes[1])

    caption = (
        "Over the road of traffic.along: mean speed of all vehicles on it and in its direction, way over time, and the "
        "visibility that they met."
    )
    return caption, drawn_figure((2.4, 1.8), draw, "place along the road [km]")


def _breaks(place: NDArray[np.float64]) -> NDArray[np.intp]:
    """Rows before which stretches of a road are missing."""
    ways = np.diff(place)
    return 1 + np.flatnonzero(ways > 1.5 * ways.min()) if len(ways) else np.zeros(0, np.intp)


def _draw_speed(axis: Axes, curves: TrafficCurves) -> None:
    slow, fast, mean, advice = (_kmh(v) for v in (curves.slow, curves.fast, curves.mean_speed, curves.advice))
    axis.fill_between(curves.time, slow, fast, color=SPEED, alpha=0.15, linewidth=0, label="15th to 85th percentile")
    axis.plot(curves.time, advice, color=ADVICE, linewidth=1.6, drawstyle="steps-post", label="lowest advice")
    axis.plot(curves.time, mean, color=SPEED, linewidth=1.6, label="mean speed")
    axis.set_ylim(bottom=0)
    axis.set_ylabel("speed [km/h]", fontsize=9)


def _draw_vehicles(axis: Axes, curves: TrafficCurves) -> None:
    axis.plot(curves.time, curves.vehicles, color=SPEED, linewidth=1.6, label="vehicles")
    axis.plot(curves.time, curves.advised, color=ADVICE, linewidth=1.6, label="have heard advice")
    axis.set_ylim(bottom=0)
    axis.set_ylabel("vehicles", fontsize=9)


def _draw_visibility(axis: Axes, curves: TrafficCurves) -> None:
    axis.plot(curves.time, shown_visibility(curves.least), color=BELIEF, linewidth=1.6, label="least of any driver")
    metered = shown_visibility(curves.metered)
    axis.plot(curves.time, metered, color=TRUTH, linewidth=1.8, linestyle=(0, (5, 1.5)), label="at the meter")
    scale_visibility(axis)


def _kmh(values: Sequence[float | None]) -> NDArray[np.float64]:
    return plottable(values) * KMH_PER_MPS
