"""A picture like figures 2, 11, 13 and 14 of gallen2014, and of halos' Br50."""

from collections.abc import Mapping, Sequence
from io import BytesIO

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from fogsim.atmosphere.visibility.night_visibility import FogKind, high_beam_veil
from fogsim.lighting.beams import high_beam
from fogsim.reproduce.night.limits import veil_luminance
from fogsim.reproduce.result import Cell

Records = Sequence[Mapping[str, Cell]]


def picture(drives: Records, veil: Records, threshold: float) -> NDArray[np.uint8]:
    """Draw the veil's luminance, scores by reference, estimated over true visibility, and halos of the drives.

    Parameters
    ----------
    drives, veil : sequence of mapping
        Records of the reproduction.
    threshold : float
        Calibrated mean Br50 below which there is fog [levels a pixel].

    Returns
    -------
    (rows, cols, 3) uint8
    """
    figure = Figure(figsize=(13.0, 9.0), dpi=90, layout="constrained")
    (two, eleven), (fourteen, halos) = figure.subplots(2, 2)
    _draw_veil(two)
    _draw_scores(eleven, veil)
    _draw_estimates(fourteen, veil)
    _draw_halos(halos, drives, threshold)
    FigureCanvasAgg(figure)
    drawn = BytesIO()
    figure.savefig(drawn, format="png")
    return np.asarray(Image.open(drawn).convert("RGB"))


def _draw_veil(axes: Axes) -> None:
    visibilities = np.geomspace(30.0, 1000.0, 40).tolist()
    for kind, colour in zip(FogKind, ("C0", "C1"), strict=True):
        axes.plot(
            visibilities, [high_beam_veil(one, kind) for one in visibilities], f"{colour}--", label=f"{kind}, eq. 9"
        )
        axes.plot(visibilities, veil_luminance(high_beam(), visibilities, kind), colour, label=f"{kind}, ours")
    axes.set(xscale="log", xlabel="V_met [m]", ylabel="veil of high beams [cd/m²]", title="Figure 2")
    axes.legend(fontsize=8)


def _draw_scores(axes: Axes, veil: Records) -> None:
    for number, record in enumerate(veil):
        scores = str(record["scores"] or "").split()
        if scores:
            shade = number / max(len(veil) - 1, 1)
            label = f"{float(str(record['visibility_m'])):.0f} m" if number % 4 == 0 else None
            axes.plot([float(one) for one in scores], "o-", color=(shade, 0.3, 1.0 - shade), ms=3, label=label)
    axes.set(xlabel="reference, from dense fog on", ylabel="ZNCC", title="Figures 11 and 13: scores, by true V_met")
    axes.legend(fontsize=8)


def _draw_estimates(axes: Axes, veil: Records) -> None:
    truth = np.array([float(str(record["visibility_m"])) for record in veil])
    axes.plot(truth, truth, color="0.6", lw=1)
    error = np.select([truth < 50.0, truth < 100.0, truth < 200.0], [10.0, 20.0, 40.0], 100.0)
    axes.fill_between(truth, truth - error, truth + error, color="0.9", label="published accuracy")
    for name, mark in (("as_published", "x"), ("log_spaced", "s"), ("night_road", "o")):
        told = [(record["visibility_m"], record[f"{name}_m"]) for record in veil if record[f"{name}_m"] is not None]
        if told:
            axes.plot(*zip(*told, strict=True), mark, ms=5, label=name.replace("_", " "))
    axes.set(xscale="log", yscale="log", xlabel="true V_met [m]", ylabel="estimated V_met [m]", title="Figure 14")
    axes.set_ylim(8.0, 3000.0)
    axes.legend(fontsize=8)


def _draw_halos(axes: Axes, drives: Records, threshold: float) -> None:
    names = [str(record["drive"]) for record in drives]
    axes.bar(names, [float(str(record["median_br50"] or 0.0)) for record in drives], color=["C0", "C0", "0.6", "0.6"])
    axes.axhline(threshold, color="C3", label="calibrated threshold")
    axes.axhline(9.0, color="C3", ls=":", label="the paper's")
    axes.set(ylabel="median of mean Br50 [levels/px]", title="Halos on four drives")
    axes.legend(fontsize=8)
