"""Images like figures 2, 11 and 14 of gallen2014, and the halos' Br50 on four drives."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fogsim.atmosphere.visibility.night_visibility import FogKind, high_beam_veil
from fogsim.lighting.beams import high_beam
from fogsim.reproduce.figure_image import figure_image
from fogsim.reproduce.night.limits import veil_luminance

Records = Sequence[Mapping[str, Any]]


def picture(drives: Records, fogs: Records, threshold: float) -> NDArray[np.uint8]:
    """Draw the veil's luminance, scores by reference, estimated over true visibility, and the drives' halos, if run."""
    figure = Figure(figsize=(13.0, 9.0), dpi=90, layout="constrained")
    (two, eleven), (fourteen, halos) = figure.subplots(2, 2)
    _draw_veil(two)
    if fogs:
        _draw_scores(eleven, fogs)
        _draw_estimates(fourteen, fogs)
    if drives:
        _draw_halos(halos, drives, threshold)
    for axes in (eleven, fourteen, halos):
        axes.set_visible(axes.has_data())
    return figure_image(figure)


def _draw_veil(axes: Axes) -> None:
    visibilities = np.geomspace(30.0, 1000.0, 40).tolist()
    for kind, colour in zip(FogKind, ("C0", "C1"), strict=True):
        published = [high_beam_veil(one, kind) for one in visibilities]
        axes.plot(visibilities, published, f"{colour}--", label=f"{kind}, eq. 9")
        axes.plot(visibilities, veil_luminance(high_beam(), visibilities, kind), colour, label=f"{kind}, FogSim")
    axes.set(xscale="log", xlabel="V_met [m]", ylabel="veil of high beams [cd/m²]", title="Figure 2")
    axes.legend(fontsize=8)


def _draw_scores(axes: Axes, fogs: Records) -> None:
    truth = _column(fogs, "visibility_m")
    for key in (key for key in fogs[0] if key.startswith("score_")):
        axes.plot(truth, _column(fogs, key), label=f"{key.removeprefix('score_')} m")
    axes.set(xscale="log", xlabel="true V_met [m]", ylabel="ZNCC", title="Figure 11: scores of six reference frames")
    axes.legend(fontsize=8, title="V_met of the reference", loc="center right")


def _draw_estimates(axes: Axes, fogs: Records) -> None:
    truth = _column(fogs, "visibility_m")
    axes.plot(truth, truth, color="0.6", lw=1)
    error = np.select([truth < 50.0, truth < 100.0, truth < 200.0], [10.0, 20.0, 40.0], 100.0)
    axes.fill_between(truth, np.maximum(truth - error, 1.0), truth + error, color="0.9", label="published accuracy")
    for name, mark in (("as_published", "x"), ("corrected", "s")):
        axes.plot(truth, _column(fogs, f"{name}_m"), mark, ms=4, label=name.replace("_", " "))
    axes.set(xscale="log", yscale="log", xlabel="true V_met [m]", ylabel="estimated V_met [m]", title="Figure 14")
    axes.set_ylim(8.0, 3000.0)
    axes.legend(fontsize=8)


def _draw_halos(axes: Axes, drives: Records, threshold: float) -> None:
    names = [str(record["drive"]) for record in drives]
    axes.bar(names, _column(drives, "median_br50"), color=["C0", "C0", "0.6", "0.6"])
    axes.axhline(threshold, color="C3", label="calibrated threshold")
    axes.axhline(9.0, color="C3", ls=":", label="the paper's threshold")
    axes.set(ylabel="median of mean Br50 [levels/px]", title="Halos on four drives")
    axes.legend(fontsize=8)


def _column(records: Records, key: str) -> NDArray[np.float64]:
    return np.array([one[key] for one in records], np.float64)
