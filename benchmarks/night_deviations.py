"""How far the night models of `fogsim.atmosphere` are from photons: prints the tables of docs/night.md.

python benchmarks/night_deviations.py
"""

import math
from pathlib import Path

import numpy as np

from fogsim.atmosphere.glow import glow, narasimhan_nayar, scattered_once
from fogsim.atmosphere.lamp_tables import lamp_table
from fogsim.atmosphere.phase import Droplets, phase_function
from fogsim.atmosphere.veil import FOLD_DISTANCE, INTERVALS, VeilRays, lit_air, ray_pieces, veil_along
from fogsim.lighting.beams import high_beam, low_beam
from fogsim.units import extinction_from_visibility

DATA = Path(__file__).parents[1] / "tests" / "data"
LAMPS = ((1.8, 0.6, -0.85), (1.8, -0.6, -0.85))
SURE = 0.15


def read(name):
    """A table of photons."""
    lines = [line for line in (DATA / name).read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    return np.genfromtxt(lines, delimiter=",", names=True, dtype=None, encoding="utf-8")


def modelled_veils(rows):
    """The model's veil for each row of the photons' table."""
    tables = {"low": lamp_table(low_beam()), "high": lamp_table(high_beam())}
    known = {}
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


def print_veils():
    """Ratio of model to photons by visibility and direction."""
    rows = read("monte_carlo_veil.csv")
    ratio = np.array(list(modelled_veils(rows))) / rows["all"]
    sure = rows["all_error"] < SURE * rows["all"]
    directions = list(dict.fromkeys((float(row["right"]), float(row["up"])) for row in rows))
    print("| fog | beam | V_met | " + " | ".join(f"{r:g}°, {u:g}°" for r, u in directions) + " |")
    print("|---|---|---|" + "---|" * len(directions))
    for fog in dict.fromkeys(rows["fog"]):
        for beam in ("low", "high"):
            for visibility in dict.fromkeys(rows["visibility"]):
                cells = []
                for right, up in directions:
                    here = (rows["fog"] == fog) & (rows["beam"] == beam) & (rows["visibility"] == visibility)
                    here &= (rows["right"] == right) & (rows["up"] == up)
                    cells.append(f"{ratio[here][0]:.2f}" if sure[here][0] else "–")
                print(f"| {fog} | {beam} | {visibility:g} | " + " | ".join(cells) + " |")


def print_halos():
    """Root mean square of ln(model / photons) below 70° by optical depth, for three models."""
    rows = read("monte_carlo_halo.csv")
    rows = rows[rows["angle"] < 70]
    print("| fog | T | FogSim | single scattering | Narasimhan & Nayar, q = 0.9 |")
    print("|---|---|---|---|---|")
    for droplets in Droplets:
        for depth in dict.fromkeys(rows["optical_depth"]):
            some = rows[(rows["fog"] == droplets) & (rows["optical_depth"] == depth)]
            angle = np.radians(some["angle"])
            models = [glow(depth, angle, droplets), scattered_once(depth, angle, phase_function(droplets))]
            if depth > 1:
                # Far from the source their series is the flux of the source: 3 / (4 π) makes it so.
                models.append(3 / (4 * math.pi) * narasimhan_nayar(depth, angle))
            cells = [f"{math.sqrt(np.mean(np.log(model / some['all']) ** 2)):.2f}" for model in models]
            print(f"| {droplets} | {depth:g} | " + " | ".join([*cells, "diverges"][:3]) + " |")


def main():
    """Print both."""
    print_veils()
    print()
    print_halos()


if __name__ == "__main__":
    main()
