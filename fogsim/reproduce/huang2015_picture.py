"""A picture like huang2015's figure 4.9: the vehicle as it was followed, and image confidence over range."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fogsim.estimators import make
from fogsim.estimators.huang2015_comparison import BODY_HALF_WIDTH, BODY_HEIGHTS
from fogsim.estimators.huang2015_ratios import image_confidence
from fogsim.render import Renderer
from fogsim.reproduce.figure_image import figure_image
from fogsim.reproduce.huang2015_chase import Chase
from fogsim.units import extinction_from_visibility
from fogsim.values import Estimate

_RANGES = (25.0, 35.0, 45.0, 55.0, 65.0, 75.0, 85.0)
"""Ranges of the patches [m]."""

_COLOURS = {"published": "tab:orange", "corrected": "tab:blue"}


@dataclass(frozen=True, slots=True)
class Tracked:
    """Estimates by variant after the vehicle was followed in fog of a true V_met [m]."""

    visibility: float
    estimates: Mapping[str, Estimate]


def picture(renderer: Renderer, chase: Chase, shown: Sequence[Tracked]) -> NDArray[np.uint8]:
    """Draw a row of patches over range for each fog, and confidence curves below them."""
    figure = Figure(figsize=(12.8, 3.2 + 1.7 * len(shown)), dpi=100, layout="constrained")
    grid = figure.add_gridspec(len(shown) + 1, 1, height_ratios=[*([1.0] * len(shown)), 2.0])
    found = _patches(renderer, chase, [row.visibility for row in shown])
    for i, row in enumerate(shown):
        for j, axes in enumerate(figure.add_subfigure(grid[i]).subplots(1, len(_RANGES))):
            _patch(axes, *found[row.visibility][j], "" if j else f"V = {row.visibility:.0f} m")
            axes.set_xlabel(f"{_RANGES[j]:.0f} m")
    plots = figure.add_subfigure(grid[len(shown)]).subplots(1, len(shown), squeeze=False)[0]
    for axes, row in zip(plots, shown, strict=True):
        _curves(axes, row)
    return figure_image(figure)


def _patches(
    renderer: Renderer, chase: Chase, visibilities: Sequence[float]
) -> dict[float, list[tuple[NDArray[np.uint8], tuple[float, float, float] | None]]]:
    """Pieces of frames about the vehicle, and where in them the estimator has it (column, foot, width) [px]."""
    estimators = {v: make("huang2015_lead", chase.camera) for v in visibilities}
    found: dict[float, list[tuple[NDArray[np.uint8], tuple[float, float, float] | None]]] = {
        v: [] for v in visibilities
    }
    for ahead, seen in chase.seen(renderer, dict.fromkeys(_RANGES, visibilities), np.random.default_rng(1)):
        scale = chase.camera.focal_length / ahead
        row = round(chase.camera.horizon_row + chase.camera.row_distance / ahead)
        col = round(chase.camera.principal_point[0] - chase.vehicle.left * scale)
        top, left = max(row - round(2.0 * scale), 0), max(col - round(1.5 * scale), 0)
        for v, observation in seen.items():
            window = estimators[v].update(observation).diagnostics.get("window")
            piece = observation.image[top : row + round(0.4 * scale), left : col + round(1.5 * scale)]
            at = (window[0] - left, window[1] - top, window[2]) if isinstance(window, tuple) else None
            found[v].append((np.asarray(piece, np.uint8), at))
    return found


def _patch(axes: Axes, piece: NDArray[np.uint8], window: tuple[float, float, float] | None, name: str) -> None:
    axes.imshow(piece, interpolation="nearest")
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_ylabel(name)
    if window is not None:
        column, foot, width = window
        sides = column + BODY_HALF_WIDTH * width * np.array([-1, 1, 1, -1, -1])
        ends = foot - width * np.array(BODY_HEIGHTS)[[0, 0, 1, 1, 0]]
        axes.plot(sides, ends, color="tab:green", linewidth=1.2)


def _curves(axes: Axes, row: Tracked) -> None:
    distance = np.linspace(0.0, 200.0, 201)
    true = extinction_from_visibility(row.visibility)
    axes.plot(distance, 100.0 * image_confidence(true, distance), color="black", linewidth=1.0, label="true")
    for name, estimate in row.estimates.items():
        if not estimate.valid:
            continue
        curve = 100.0 * image_confidence(estimate.extinction, distance)
        axes.plot(distance, curve, color=_COLOURS[name], label=f"{name}: V = {estimate.visibility:.0f} m")
    published = row.estimates.get("published")
    if published is not None and "variances" in published.diagnostics:
        at = np.asarray(published.diagnostics["distances"])
        variance = np.asarray(published.diagnostics["variances"])
        left = 100.0 * variance / variance[0] * image_confidence(true, at[0])
        axes.plot(at, left, ".", color=_COLOURS["published"], label="variances, over the nearest")
    axes.set_title(f"Image confidence at V = {row.visibility:.0f} m", fontsize=10)
    axes.set_xlabel("range [m]")
    axes.set_ylabel("confidence [%]")
    axes.set_ylim(0.0, 105.0)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)
