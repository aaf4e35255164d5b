"""How far the night models of `fogsim.atmosphere` are from photons and from gallen2014.

The tables of docs/explanation/night.md. Also how much less light a Henyey–Greenstein function with g = 0.85 sends
back than the droplets do.

    python benchmarks/night_deviations.py

`python docs/make_measured_tables.py night` writes them into the page.
"""

import math
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.lamps.glow import glow, narasimhan_nayar, scattered_once
from fogsim.atmosphere.lamps.lamp_tables import lamp_table
from fogsim.atmosphere.lamps.lobes import lobe_glow
from fogsim.atmosphere.lamps.phase_function import Droplets, henyey_greenstein, phase_function
from fogsim.atmosphere.lamps.veil import FOLD_DISTANCE, INTERVALS, VeilRays, lit_air, ray_pieces, veil_along
from fogsim.atmosphere.visibility.night_visibility import FogKind, high_beam_veil
from fogsim.lighting.beams import front_fog_beam, high_beam, low_beam, luminous_flux, scaled_beam
from fogsim.reproduce.night.limits import limits
from fogsim.scene.lamps import FULL, SIGNAL_LOBES, STREET_LOBE
from fogsim.units import extinction_from_visibility
from fogsim.values import Beam
from fogsim.values.luminous_intensity import SignalLobe, luminous_intensity

DATA = Path(__file__).parents[1] / "tests" / "data"
LAMPS = ((1.8, 0.6, -0.85), (1.8, -0.6, -0.85))
SURE = 0.15
"""Standard error of the photons below which they count, relative to them."""
TARGET = -2.02
"""Elevation of a point on the road 40 m ahead [degrees]."""
BACK = math.radians(150.0)
"""Scattering angle beyond which light of the own head lamps comes back."""
AHEAD = math.radians(5.0)

Rows = list[tuple[str, ...]]


@cache
def photons(name: str) -> NDArray[Any]:
    """A table of photons."""
    lines = [line for line in (DATA / name).read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    return np.genfromtxt(lines, delimiter=",", names=True, dtype=None, encoding="utf-8")


def modelled_veils(rows: NDArray[Any]) -> Iterator[float]:
    """The model's veil for each row of the photons' table [cd/m²]."""
    tables = {"low": lamp_table(low_beam()), "high": lamp_table(high_beam())}
    known: dict[tuple[Any, ...], Any] = {}
    for row in rows:
        key = (row["fog"], row["beam"], row["right"], row["up"])
        if key not in known:
            a, e = math.radians(row["right"]), math.radians(row["up"])
            towards = [[math.cos(e) * math.cos(a), -math.cos(e) * math.sin(a), math.sin(e)]]
            ray = VeilRays((1, 1), np.array(towards, np.float32), *ray_pieces())
            known[key] = lit_air(ray, [(place, tables[row["beam"]]) for place in LAMPS], Droplets(row["fog"]))
        k = np.full((1, 1), extinction_from_visibility(row["visibility"]), np.float32)
        node = row["reach"] / (row["reach"] + FOLD_DISTANCE) * INTERVALS
        yield float(np.interp(node, np.arange(INTERVALS + 1), veil_along(known[key], k, k)[0]))


def rms_of_ln(ratio: NDArray[np.float64]) -> float:
    """Root mean square of the logarithm of ratios."""
    return math.sqrt(np.mean(np.log(ratio) ** 2))


def veils() -> Rows:
    """Ratio of model to photons by visibility: toward a target, anywhere, and how far either model is off."""
    rows = photons("monte_carlo_veil.csv")
    rows = rows[rows["all_error"] < SURE * rows["all"]]
    ratio = np.array(list(modelled_veils(rows))) / rows["all"]
    table: Rows = []
    for visibility in dict.fromkeys(rows["visibility"]):
        here = rows["visibility"] == visibility
        ahead = ratio[here & (rows["up"] == TARGET)]
        anywhere = ratio[here]
        ranges = [f"{some.min():.2f} … {some.max():.2f}" for some in (ahead, anywhere)]
        once = rms_of_ln(rows["single"][here] / rows["all"][here])
        table.append((f"{visibility:g}", *ranges, f"{rms_of_ln(anywhere):.2f}", f"{once:.2f}"))
    return [
        ("V_met [m]", "toward a target 40 m ahead", "anywhere", "rms of ln", "rms of ln, single scattering"),
        *sorted(table, key=lambda row: float(row[0])),
    ]


def veils_of_gallen() -> Rows:
    """gallen2014's veil of high beams and ours by photons' table and model, toward the same target [cd/m²]."""
    rows = photons("monte_carlo_veil.csv")
    rows = rows[rows["up"] == TARGET]
    ours = np.array(list(modelled_veils(rows)))
    heading: tuple[str, ...] = ("V_met [m]",)
    table = {visibility: [f"{visibility:g}"] for visibility in (30.0, 50.0, 100.0, 200.0, 300.0, 500.0)}
    for kind, droplets in (
        (FogKind.RADIATION, Droplets.MODERATE_RADIATION),
        (FogKind.ADVECTION, Droplets.HEAVY_ADVECTION),
    ):
        heading += (f"{kind}: eq. 9", "high", "high, single", "low", "low, single")
        for visibility, cells in table.items():
            cells.append(f"{high_beam_veil(visibility, kind):.3f}")
            for beam, digits in (("high", 2), ("low", 3)):
                here = (rows["visibility"] == visibility) & (rows["fog"] == droplets) & (rows["beam"] == beam)
                (whole,), (once,) = ours[here], rows["single"][here]
                cells += [f"{whole:.2f}", f"{once:.{digits}f}"]
    return [heading, *map(tuple, table.values())]


def glows() -> Rows:
    """Root mean square of ln(model / photons) below 70° by optical depth, for three models."""
    rows = photons("monte_carlo_halo.csv")
    rows = rows[rows["angle"] < 70]
    table: Rows = [("fog", "τ", "FogSim", "single scattering", "Narasimhan & Nayar, q = 0.9")]
    for droplets in Droplets:
        for depth in dict.fromkeys(rows["optical_depth"]):
            some = rows[(rows["fog"] == droplets) & (rows["optical_depth"] == depth)]
            angle = np.radians(some["angle"])
            models = [glow(depth, angle, droplets), scattered_once(depth, angle, phase_function(droplets))]
            if depth > 1:
                # Far from the source their series is the flux of the source: 3 / (4 π) makes it so.
                models.append(3 / (4 * math.pi) * narasimhan_nayar(depth, angle))
            cells = [f"{rms_of_ln(model / some['all']):.2f}" for model in models]
            table.append((str(droplets), f"{depth:g}", *[*cells, "diverges"][:3]))
    return table


def fog_limits() -> Rows:
    """The paper's limits as printed, with each beam's own veil, and with factors chosen to reach them."""
    third = scaled_beam(low_beam(), 0.3)
    forms = {
        "as printed: one veil (eq. 9) for both beams": (low_beam(), 1.0),
        "each beam's own veil, by FogSim's model": (low_beam(), None),
        "low beams × 0.3, with 0.1 of the veil (chosen to reach the figures)": (third, 0.1),
    }
    table: Rows = [("", "radiation: eq. 11", "advection: eq. 11", "radiation: eq. 12", "advection: eq. 12")]
    for name, (low, veil_share) in forms.items():
        pairs = [limits(low, kind, veil_share) for kind in FogKind]
        table.append((name, *(f"{pair[at]:.0f} m" for at in (0, 1) for pair in pairs)))
    return [*table, ("the paper", "100 m", "100 m", "300 m", "300 m")]


def lobes() -> Rows:
    """Glow of lamps that shine unevenly over that of photons, up to 43° off: smallest and largest of fogs and sides."""
    rows = photons("monte_carlo_lobes.csv")
    rows = rows[rows["angle"] < 45.0]
    depths = list(dict.fromkeys(rows["optical_depth"]))
    table: Rows = [("lamp", *(f"τ = {depth:g}" for depth in depths), "share within a quarter [%]")]
    for name, (beam, unit, eye) in lobe_lamps().items():
        ratios = []
        for depth in depths:
            for droplets in dict.fromkeys(rows["fog"]):
                some = rows[(rows["fog"] == droplets) & (rows["optical_depth"] == depth) & (rows["lamp"] == name)]
                counted = np.stack([some[side] for side in ("right", "up", "left", "down")], axis=1)
                ours = lobe_glow(depth, np.radians(some["angle"]), beam, eye, Droplets(droplets))[:, ::2]
                ratios.append(ours / (unit * counted))
        at_depth = np.array(ratios).reshape(len(depths), -1)
        ranges = [f"{some.min():.2f} … {some.max():.2f}" for some in at_depth]
        inside = np.mean(np.abs(np.log(at_depth)) < math.log(1.25))
        table.append((name.replace("_", " "), *ranges, f"{100 * inside:.0f}"))
    return table


def lobe_lamps() -> dict[str, tuple[Beam, float, tuple[float, float]]]:
    """Lamps of the photons' table by name: beam, its unit in the table [cd], and direction to the eye [rad]."""
    right, up = np.linspace(-math.pi, math.pi, 361), np.linspace(-0.5 * math.pi, 0.5 * math.pi, 181)
    facing = np.maximum(np.cos(up)[:, None] * np.cos(right), 0.0)

    def bell(aside: float, above: float) -> Beam:
        square = (np.degrees(right) / aside) ** 2 + (np.degrees(up)[:, None] / above) ** 2
        return Beam(right, up, 1e3 * np.where(facing > 1e-9, np.exp(-0.5 * square), 0.0))

    lamps = {
        "cosine": (Beam(right, up, 1e3 * facing**4), 1e3, (0.0, 0.0)),
        "wide": (bell(15.0, 8.0), 1e3, (0.0, 0.0)),
        "wide_below": (bell(15.0, 8.0), 1e3, (5.0, 5.0)),
        "narrow": (bell(10.0, 5.0), 1e3, (0.0, 0.0)),
        "low_beam": (low_beam(), 1.0, (-4.0, 0.7)),
        "low_beam_near": (low_beam(), 1.0, (-12.0, 2.5)),
        "high_beam": (high_beam(), 1.0, (-4.0, 0.7)),
        "street_lamp": (STREET_LOBE, 1.0, (0.0, -15.0)),
    }
    return {name: (beam, unit, (math.radians(h), math.radians(v))) for name, (beam, unit, (h, v)) in lamps.items()}


def lamp_fluxes() -> Rows:
    """What lamps shine in all: intensity along the axis, next to and above it, and flux."""
    axial = {"rear position": (8.0, SignalLobe.SIGNAL), "stop": (100.0, SignalLobe.SIGNAL)}
    axial |= {"rear fog": (200.0, SignalLobe.REAR_FOG), "daytime": (600.0, SignalLobe.DAYTIME)}
    lamps = {name: scaled_beam(SIGNAL_LOBES[lobe], full / FULL) for name, (full, lobe) in axial.items()}
    lamps |= {"low beam": low_beam(), "high beam": high_beam(), "front fog": front_fog_beam(), "street": STREET_LOBE}
    table: Rows = [("lamp", "axis [cd]", "10° aside [cd]", "10° above [cd]", "flux [lm]")]
    for name, beam in lamps.items():
        ways = ((0.0, 0.0), (10.0, 0.0), (0.0, 10.0))
        cells = [f"{float(f'{luminous_intensity(beam, *np.radians(way)):.3g}'):g}" for way in ways]
        flux = luminous_flux(beam, (-math.pi, math.pi), (-0.5 * math.pi, 0.5 * math.pi))
        table.append((name, *(cells if name != "street" else ("–",) * 3), f"{float(f'{flux:.3g}'):g}"))
    return table


def scattered_between(phase: Callable[[NDArray[np.float64]], NDArray[np.float64]], low: float, high: float) -> float:
    """Share of scattered light that is turned by angles between two [rad]."""
    angle = np.linspace(low, high, 2001)
    return float(2.0 * math.pi * np.trapezoid(phase(angle) * np.sin(angle), angle))


def directions() -> Rows:
    """Light that goes straight on and that comes back; the latter also over Henyey & Greenstein's, g = 0.85."""
    plain = scattered_between(lambda angle: henyey_greenstein(angle, 0.85), BACK, math.pi)
    table: Rows = [("droplets", "turned by less than 5° [%]", "by more than 150° [%]", "over Henyey & Greenstein's")]
    for droplets in Droplets:
        phase = phase_function(droplets)
        ahead, back = scattered_between(phase, 0.0, AHEAD), scattered_between(phase, BACK, math.pi)
        table.append((str(droplets), f"{100 * ahead:.0f}", f"{100 * back:.1f}", f"{back / plain:.1f}"))
    return table


def main() -> None:
    """Print them all."""
    for table in (veils, veils_of_gallen, glows, lobes, lamp_fluxes, fog_limits, directions):
        heading, *rows = table()
        lines = [heading, tuple("---" for _ in heading), *rows]
        print("\n".join("| " + " | ".join(cells) + " |" for cells in lines) + "\n")


if __name__ == "__main__":
    main()
