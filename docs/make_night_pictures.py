"""Draw the pictures of docs/explanation/night.md again: ``python docs/make_night_pictures.py`` (some minutes)."""

import math
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray
from PIL import Image

import fogsim
from fogsim.atmosphere import Droplets
from fogsim.atmosphere.lamps.glow import glow, narasimhan_nayar, scattered_once
from fogsim.atmosphere.lamps.lamp_tables import lamp_table
from fogsim.atmosphere.lamps.phase_function import phase_function
from fogsim.atmosphere.lamps.veil import FOLD_DISTANCE, INTERVALS, lit_air, ray_pieces, veil_along
from fogsim.atmosphere.lamps.veil_kernels import VeilRays
from fogsim.atmosphere.visibility.night_visibility import FogKind, high_beam_veil, visibility_distance
from fogsim.lighting.beams import high_beam, low_beam, scaled_beam
from fogsim.loop import ClosedLoop
from fogsim.units import extinction_from_visibility
from fogsim.values import Command, Lamp

ROOT = Path(__file__).resolve().parents[1]
OUT = ROOT / "docs" / "pictures"
VISIBILITIES = (500, 200, 100, 50)
ROWS = (("low", Lamp.LOW_BEAM, "false"), ("high", Lamp.HIGH_BEAM, "false"), ("street lamps", Lamp.LOW_BEAM, "true"))
"""Rows of the sheet: name, the ego's lamps, whether street lamps are lit."""

FRAME = 60


def photograph(visibility: float, lamp: Lamp, street_lamps: str) -> NDArray[np.uint8]:
    """A camera frame of the motorway by night."""
    keys = [f"fog.visibility_m={visibility}", "light.illuminance_lx=0.0", f"street_lamps={street_lamps}"]
    with ClosedLoop(fogsim.load_scenario("motorway_fog_bank", keys)) as loop:
        step = loop.start(1)
        while step.index < FRAME:
            step = loop.advance(Command(lamps=Lamp.POSITION | lamp))
        return step.observation.image


def sheet() -> Image.Image:
    """Four visibilities by three kinds of light, 400×300 each."""
    picture = Image.new("RGB", (4 * 400, 3 * 300))
    for row, (_, lamp, street_lamps) in enumerate(ROWS):
        for column, visibility in enumerate(VISIBILITIES):
            frame = Image.fromarray(photograph(visibility, lamp, street_lamps))
            picture.paste(frame.resize((400, 300), Image.Resampling.LANCZOS), (400 * column, 300 * row))
    return picture


def photons(name: str) -> NDArray[np.void]:
    """A table that `benchmarks/monte_carlo.py` wrote."""
    text = (ROOT / "tests" / "data" / name).read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    return np.genfromtxt(lines, delimiter=",", names=True, dtype=None, encoding="utf-8")


def draw_veils(axes: plt.Axes) -> None:
    """Veil toward a target 40 m ahead on the road, over visibility."""
    visibilities = np.geomspace(30, 500, 40)
    angle = math.radians(2.02)
    ray = VeilRays((1, 1), np.array([[math.cos(angle), 0.0, -math.sin(angle)]], np.float32), *ray_pieces())
    node = 40.0 / (40.0 + FOLD_DISTANCE) * INTERVALS
    rows = photons("monte_carlo_veil.csv")
    for name, beam, colour in (("high", high_beam(), "C1"), ("low", low_beam(), "C0")):
        table = lamp_table(beam)
        air = lit_air(ray, [((1.8, side, -0.85), table) for side in (0.6, -0.6)], Droplets.HEAVY_RADIATION)
        extinctions = [np.full((1, 1), extinction_from_visibility(v), np.float32) for v in visibilities]
        veils = [np.interp(node, np.arange(INTERVALS + 1), veil_along(air, k, k)[0]) for k in extinctions]
        axes.plot(visibilities, veils, colour, label=f"{name} beam")
        some = rows[(rows["fog"] == "heavy_radiation") & (rows["beam"] == name) & (rows["up"] == -2.02)]
        some = some[some["all_error"] < 0.2 * some["all"]]
        axes.errorbar(some["visibility"], some["all"], some["all_error"], fmt="o", color=colour, ms=4)
        axes.plot(some["visibility"], some["single"], ":", color=colour)
    axes.plot(
        visibilities, [high_beam_veil(v, FogKind.RADIATION) for v in visibilities], "k--", label="gallen2014 eq. 9"
    )
    axes.set(xscale="log", yscale="log", xlabel="V_met [m]", ylabel="veil [cd/m²]", title="Veil of own lamps")
    axes.set_xticks([30, 50, 100, 200, 500], ["30", "50", "100", "200", "500"])
    axes.xaxis.set_minor_formatter("")
    axes.legend(fontsize=8)


def draw_halos(axes: plt.Axes) -> None:
    """Glow over angle at three optical depths."""
    rows, angle = photons("monte_carlo_halo.csv"), np.geomspace(0.5, 80.0, 60)
    for depth, colour in ((0.3, "C2"), (1.5, "C0"), (4.0, "C3")):
        some = rows[(rows["fog"] == "heavy_radiation") & (rows["optical_depth"] == depth) & (rows["angle"] < 80)]
        axes.plot(angle, glow(depth, np.radians(angle), Droplets.HEAVY_RADIATION), colour, label=f"T = {depth:g}")
        axes.plot(some["angle"], some["all"], "o", color=colour, ms=4)
        once = scattered_once(depth, np.radians(angle), phase_function(Droplets.HEAVY_RADIATION))
        axes.plot(angle, once, ":", color=colour)
    series = 3 / (4 * math.pi) * narasimhan_nayar(4.0, np.radians(angle))
    axes.plot(angle, series, "--", color="C3", label="Narasimhan & Nayar, T = 4")
    axes.set(xscale="log", yscale="log", xlabel="angle from the lamp [°]", ylabel="L R² / I", title="Glow about a lamp")
    axes.legend(fontsize=8)


def draw_sight(axes: plt.Axes) -> None:
    """Distance at which the target is seen, over visibility."""
    visibilities = np.geomspace(30, 1500, 50)
    high, low = high_beam(), scaled_beam(low_beam(), 0.30)
    for kind, style in ((FogKind.RADIATION, "-"), (FogKind.ADVECTION, "--")):
        axes.plot(
            visibilities,
            [visibility_distance(high, v, kind) for v in visibilities],
            f"C1{style}",
            label=f"high, {kind}",
        )
        by_low = [visibility_distance(low, v, kind, veil_share=0.10) for v in visibilities]
        axes.plot(visibilities, by_low, f"C0{style}", label=f"low × 0.3, {kind}")
    axes.axhline(visibility_distance(low, math.inf), color="C0", lw=0.8, ls=":", label="low, clear air")
    axes.set(xscale="log", xlabel="V_met [m]", ylabel="distance where VL = 7 [m]", title="Sight by own lamps")
    axes.legend(fontsize=8)


def main() -> None:
    """Draw and save."""
    figure, axes = plt.subplots(1, 3, figsize=(15, 4.6), layout="constrained")
    draw_veils(axes[0])
    draw_halos(axes[1])
    draw_sight(axes[2])
    figure.savefig(OUT / "night_curves.png", dpi=80)
    sheet().save(OUT / "night.jpg", quality=85)


if __name__ == "__main__":
    main()
