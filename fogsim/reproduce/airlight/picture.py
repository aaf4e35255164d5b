"""Airlight by elevation and path, and what methods read in it."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fogsim.reproduce.airlight.conditions import Condition, airlight
from fogsim.reproduce.figure_image import figure_image
from fogsim.reproduce.result import Cell
from fogsim.units import extinction_from_visibility
from fogsim.values.fog import AIRLIGHT_SHARE

Records = Sequence[Mapping[str, Cell]]

_ROAD = 0.1
"""Albedo of the road [-]."""

_COLOURS = {0.05: "C3", 0.1: "C1", 0.2: "C2", 0.4: "C0", 0.8: "C4"}


def picture(records: Records) -> NDArray[np.uint8]:
    """Draw the airlight by elevation, a dark road's luminance by distance, and estimates with a car's camera."""
    methods = list(dict.fromkeys(str(one["method"]) for one in records))
    figure = Figure(figsize=(15.0, 8.4), dpi=90, layout="constrained")
    axes = figure.subplots(2, math.ceil((len(methods) + 2) / 2)).ravel()
    _draw_airlight(axes[0])
    _draw_road(axes[1])
    lowest = min(float(str(one["mount_height_m"])) for one in records)
    for method, one in zip(methods, axes[2:], strict=False):
        here = [r for r in records if r["method"] == method and r["mount_height_m"] == lowest]
        _draw_method(one, method, here)
    for one in axes[2 + len(methods) :]:
        one.set_axis_off()
    return figure_image(figure)


def _draw_airlight(axes: Axes) -> None:
    up = np.concatenate((-np.geomspace(15.0, 0.5, 40), [0.0], np.geomspace(0.5, 30.0, 40)))
    for albedo, colour in _COLOURS.items():
        over = Condition("", albedo)
        axes.plot(up, [airlight(over, one) for one in up.tolist()], colour, label=f"ρ {albedo:g}")
    axes.axhline(AIRLIGHT_SHARE, color="0.5", ls="--", label="Koschmieder, ρ 0.1")
    axes.axvline(0.0, color="0.8", lw=1)
    axes.set(xlabel="elevation [°]", ylabel="airlight / (1 − T), over E/π", title="Airlight up to road or sky")
    axes.legend(fontsize=7, loc="lower right")


def _draw_road(axes: Axes) -> None:
    far = np.geomspace(5.0, 300.0, 60)
    for albedo, colour in ((None, "0.5"), (0.1, "C1"), (0.8, "C4")):
        over = Condition("", albedo)
        through = np.exp(-extinction_from_visibility(over.visibility) * far)
        down = -np.degrees(np.arcsin(over.eye / far))
        light = [airlight(over, one, reach) for one, reach in zip(down.tolist(), far.tolist(), strict=True)]
        seen = 1.0 - (np.array(light) * (1.0 - through) + _ROAD * through) / airlight(over, 0.0)
        name = "Koschmieder" if albedo is None else f"land of albedo {albedo:g}"
        axes.semilogy(far, seen, color=colour, ls="--" if albedo is None else "-", label=name)
    axes.axhline(0.05, color="0.8", lw=1)
    axes.set(
        xlabel="distance [m]",
        ylim=(0.005, 1.0),
        ylabel="contrast of the road to the horizon",
        title="Road, V_met 100 m",
    )
    axes.legend(fontsize=8)


def _draw_method(axes: Axes, method: str, records: Records) -> None:
    for albedo in (None, *_COLOURS):
        here = [one for one in records if one["ground_albedo"] == albedo and one["read_m"] is not None]
        true = [float(str(one["visibility_m"])) for one in here]
        ratio = [float(str(one["read_m"])) / float(str(one["visibility_m"])) for one in here]
        name = "Koschmieder" if albedo is None else f"ρ {albedo:g}"
        colour = "0.5" if albedo is None else _COLOURS[albedo]
        axes.plot(true, ratio, "o--" if albedo is None else "o-", color=colour, ms=4, label=name)
    axes.axhline(1.0, color="0.8", lw=1)
    axes.set(
        xscale="log",
        yscale="log",
        ylim=(0.5, 6.0),
        xlabel="true V_met [m]",
        ylabel="read over true V_met",
        title=method,
    )
    axes.set_xticks([50, 100, 200, 400], ["50", "100", "200", "400"])
    axes.set_yticks([0.5, 1, 2, 4], ["0.5", "1", "2", "4"])
    axes.minorticks_off()
    axes.legend(fontsize=7)
