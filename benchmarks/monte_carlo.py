"""Photons in fog: veils, halos of lamps, airlight by day, to which the models of `fogsim.atmosphere` are compared.

    python benchmarks/monte_carlo.py airlight tests/data/monte_carlo_airlight.csv --photons 400000
    python benchmarks/monte_carlo.py surroundings tests/data/monte_carlo_surroundings.csv --photons 400000
    python benchmarks/monte_carlo.py halo tests/data/monte_carlo_halo.csv --photons 1000000
    python benchmarks/monte_carlo.py lobes tests/data/monte_carlo_lobes.csv --photons 4000000
    python benchmarks/monte_carlo.py origins fogsim/atmosphere/data/light_origins.csv --photons 6000000
    python benchmarks/monte_carlo.py road tests/data/monte_carlo_road.csv --photons 60000
    python benchmarks/monte_carlo.py veil tests/data/monte_carlo_veil.csv --photons 400000

Slow (minutes), seeded, and independent of the models: it shares with them only the tables of lamps and phase functions.
"""

import argparse
import itertools
import math
from pathlib import Path

import numpy as np
from photon_paths import (
    LAMP_SIZES,
    STEP,
    between_trees,
    from_layer,
    halo,
    likely_cosines,
    lobe_halo,
    origins,
    road_light,
    veil,
    without_peak,
)

from fogsim.atmosphere.lamps.phase_function import henyey_greenstein
from fogsim.lighting.beams import high_beam, low_beam
from fogsim.scene.lamps import STREET_ANGLES, STREET_INTENSITIES
from fogsim.units import extinction_from_visibility
from fogsim.values.luminous_intensity import luminous_intensity

PHASES = Path(__file__).parents[1] / "fogsim" / "atmosphere" / "data" / "phase_functions.csv"
FOGS = ("heavy_advection", "moderate_advection", "heavy_radiation", "moderate_radiation")
HALO_DEPTHS = np.array([0.3, 0.6, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0])
HALO_EDGES = np.radians(np.concatenate((np.geomspace(0.5, 60.0, 19), [80.0, 100.0, 130.0, 180.0])))
HALO_END = 30.0
LOBE_FOGS = ("heavy_advection", "heavy_radiation", "moderate_radiation")
LOBE_DEPTHS = np.array([0.5, 1.0, 2.0, 3.0])
LOBE_EDGES = np.radians([[1.8, 2.2], [4.6, 5.4], [9.2, 10.8], [18.5, 21.5], [28.0, 32.0], [37.0, 43.0], [56.0, 64.0]])
SIDES = {"right": 0.0, "up": 0.5 * math.pi, "left": math.pi, "down": -0.5 * math.pi}
"""Where a line of sight passes a lamp, as the lamp sees it: angle from its right to above."""

ORIGIN_DEPTHS = np.array([0.3, 0.7, 1.5, 3.0, 6.0])
ORIGIN_ANGLES = np.radians([0.35, 0.7, 1.4, 2.8, 5.5, 9.5, 15.0, 22.0, 31.0, 43.0, 60.0, 85.0, 120.0, 170.0])
ORIGIN_EMITTED = np.radians(
    [0.0, 1.0, 2.5, 5.0, 9.0, 14.0, 20.0, 28.0, 38.0, 50.0, 65.0, 85.0, 110.0, 135.0, 155.0, 168.0, 180.0]
)
ORIGIN_TURNS = np.radians([0.0, 1.5, 5.0, 12.0, 25.0, 45.0, 75.0, 115.0, 180.0])
LOBE_STEP = math.radians(0.5)
VEIL_FOGS = ("heavy_advection", "heavy_radiation", "moderate_radiation")
VISIBILITIES = (30.0, 50.0, 80.0, 100.0, 150.0, 200.0, 300.0, 500.0)
DIRECTIONS = ((0.0, -2.02), (0.0, 2.0), (0.0, 8.0), (0.0, -8.0), (10.0, 0.0), (-15.0, -4.0))
LAMPS = np.array([[1.8, 0.6, -0.85], [1.8, -0.6, -0.85]])
EYE_HEIGHT = 1.5
LAYERS = (
    (30, 250, 1.3),
    (50, 250, 1.3),
    (100, 250, 1.3),
    (100, 250, 2.5),
    (100, 20, 1.3),
    (400, 250, 1.3),
    (2000, 250, 1.3),
)
"""V_met, height of the layer and of the eye [m]."""

LOOKS = (-30.0, -10.0, -5.0, -2.0, -0.5, 0.0, 0.5, 2.0, 5.0, 10.0, 30.0, 90.0)


def phase_table(fog):
    """Phase function on a fine grid of angles [1/sr]."""
    table = np.loadtxt(PHASES, delimiter=",", skiprows=4)
    angle = np.arange(0.0, math.pi + STEP, STEP)
    return np.exp(np.interp(np.degrees(angle), table[:, 0], np.log(table[:, 1 + FOGS.index(fog)])))


def write_road(out, paths):
    """Table of the sky's light by what the road returns."""
    grid = np.linspace(-math.pi / 2, math.pi / 2, 1441)
    table = luminous_intensity(low_beam(), grid, grid[:, None])
    with out.open("w", encoding="utf-8") as file:
        file.write("# Radiance of the sky ahead by what a road of albedo 0.1 returns of own low beams [cd/m^2].\n")
        file.write("# Eye and lamps as in monte_carlo_veil.csv; angles above the horizon [degrees]; standard errors.\n")
        file.write(f"# Command: python benchmarks/monte_carlo.py road {out} --photons {paths}\n")
        file.write("fog,visibility,up,road,error\n")
        for fog, visibility, up in itertools.product(
            ("heavy_advection", "moderate_radiation"), (50, 100, 200), (5, 10, 20)
        ):
            phase, towards = phase_table(fog), ray(0.0, up)[0]
            phases, k = np.stack((phase, without_peak(phase))), extinction_from_visibility(visibility)
            fixed = (phases, likely_cosines(phase), STEP, table, LAMPS, -EYE_HEIGHT, 0.1)
            result = road_light(paths, np.random.default_rng(1), k, towards, 400.0, *fixed)
            file.write(f"{fog},{visibility},{up}," + ",".join(f"{n:.4g}" for n in result) + "\n")


def write_airlight(out, photons):
    """Table of the light that arrives at an eye in a plane layer of fog."""
    angle = np.arange(0.0, math.pi + STEP, STEP)
    phases = {fog: phase_table(fog) for fog in ("moderate_radiation", "heavy_advection")}
    phases["henyey_greenstein"] = henyey_greenstein(angle, 0.85)
    with out.open("w", encoding="utf-8") as file:
        file.write("# Radiance at an eye in a layer of fog that absorbs nothing, by elevation [degrees], as parts:\n")
        file.write("# `ground` by a black sky and a ground of luminance 1, `sky` over black ground by a CIE overcast\n")
        file.write("# sky that alone gives a white horizontal surface luminance 1; standard errors. Lengths [m].\n")
        file.write(
            "# `reflectance` of the layer from below, `transmittance` for that sky (g of Henyey-Greenstein: 0.85).\n"
        )
        file.write(f"# Command: python benchmarks/monte_carlo.py airlight {out} --photons {photons}\n")
        file.write("fog,visibility,top,eye,elevation,ground,sky,ground_error,sky_error,reflectance,transmittance\n")
        for (fog, phase), (visibility, top, eye) in itertools.product(phases.items(), LAYERS):
            rng, cosines, k = np.random.default_rng(1), likely_cosines(phase), extinction_from_visibility(visibility)
            flux = from_layer(photons, rng, cosines, k * top, 0.0, 2.0)[:2]
            for look in LOOKS:
                found = from_layer(photons, rng, cosines, k * top, k * eye, math.sin(math.radians(look)))
                numbers = (visibility, top, eye, look, *found, *flux)
                file.write(f"{fog}," + ",".join(f"{n:.5g}" for n in numbers) + "\n")


OPEN, EVEN = (math.inf, 0.0), (math.inf, 0.0, 1.0)
SURROUNDINGS = {
    "open land, even sky": (OPEN, EVEN),
    "trees 5 m high, 10 m from the eye": ((10.0, 5.0), EVEN),
    "trees 15 m high, 30 m from the eye": ((30.0, 15.0), EVEN),
    "trees 15 m high, 10 m from the eye": ((10.0, 15.0), EVEN),
    "trees 15 m high, 5 m from the eye": ((5.0, 15.0), EVEN),
    "clouds of 100 m, under a bright one": (OPEN, (100.0, 0.5, 1.0)),
    "clouds of 100 m, under a dark one": (OPEN, (100.0, 0.5, -1.0)),
    "clouds of 500 m, under a bright one": (OPEN, (500.0, 0.5, 1.0)),
    "clouds of 500 m, under a dark one": (OPEN, (500.0, 0.5, -1.0)),
}
"""Trees (distance, height [m]) and clouds (side [m], how much brighter and darker than the mean, which) by name."""

ALONG = (-10.0, -5.0, -2.0, 0.0, 2.0, 5.0, 10.0, 30.0)


def write_surroundings(out, photons):
    """Table of airlight along a road between trees, and under patchy clouds."""
    cosines, top, eye, rho = likely_cosines(phase_table("moderate_radiation")), 250.0, 1.3, 0.1
    with out.open("w", encoding="utf-8") as file:
        file.write("# Airlight along a road, up to it or out of the layer, over what the path takes, in E / pi,\n")
        file.write("# E being the illuminance of the road; standard errors; E over that of the even sky without fog.\n")
        file.write("# Layer of 250 m, moderate radiation fog, land of albedo 0.1, eye at 1.3 m; black trees on both\n")
        file.write("# sides of it, square clouds 1.5 and 0.5 times as bright as the mean.\n")
        file.write(f"# Command: python benchmarks/monte_carlo.py surroundings {out} --photons {photons}\n")
        file.write("surroundings,visibility,elevation,airlight,error,illuminance\n")
        for (name, (trees, clouds)), visibility in itertools.product(SURROUNDINGS.items(), (50, 100, 400)):
            rng, k = np.random.default_rng(1), extinction_from_visibility(visibility)
            fixed = (photons, rng, cosines, k, top, eye, rho)
            illuminance, _ = between_trees(*fixed, 2.0, trees, clouds)
            for look in ALONG:
                slope = math.sin(math.radians(look))
                distance = eye / -slope if slope < 0 else (top - eye) / max(slope, 1e-6)
                lost = -math.expm1(-k * distance) * illuminance
                found, error = between_trees(*fixed, slope, trees, clouds)
                numbers = (visibility, look, found / lost, error / lost, illuminance)
                file.write(f'"{name}",' + ",".join(f"{n:.4g}" for n in numbers) + "\n")


def write_halo(out, photons):
    """Table of halos."""
    with out.open("w", encoding="utf-8") as file:
        file.write("# Radiance scattered about an isotropic point source in endless fog, times R^2 / I.\n")
        file.write("# Optical depth k R; geometric middle and edges of each bin of angles [degrees].\n")
        file.write("# `single`: photons scattered once. The source's direct light is left out.\n")
        file.write(f"# Command: python benchmarks/monte_carlo.py halo {out} --photons {photons}\n")
        file.write("fog,optical_depth,angle,low_edge,high_edge,single,all\n")
        for seed, fog in enumerate(FOGS):
            rng = np.random.default_rng(seed)
            total, single = halo(photons, rng, likely_cosines(phase_table(fog)), HALO_DEPTHS, HALO_EDGES, HALO_END)
            for j, depth in enumerate(HALO_DEPTHS):
                for b in range(len(HALO_EDGES) - 1):
                    low, high = np.degrees(HALO_EDGES[b : b + 2])
                    numbers = (depth, math.sqrt(low * high), low, high, single[j, b], total[j, b])
                    file.write(f"{fog}," + ",".join(f"{n:.5g}" for n in numbers) + "\n")


def lobe_sources():
    """Lamps by name: intensity over elevation and azimuth [cd], and where the eye is (right, up) [degrees]."""
    right, up = np.linspace(-math.pi, math.pi, 721), np.linspace(-0.5 * math.pi, 0.5 * math.pi, 361)[:, None]
    facing = np.maximum(np.cos(up) * np.cos(right), 0.0)
    h, v = np.degrees(np.broadcast_arrays(np.where(facing > 0, right, math.pi), up))
    front = facing > 1e-9
    low, high = (np.where(front, luminous_intensity(beam(), right, up), 0.0) for beam in (low_beam, high_beam))
    street = np.interp(up + 0.5 * math.pi, STREET_ANGLES, STREET_INTENSITIES) + 0.0 * right
    return {
        "even": (np.ones_like(facing), (0.0, 0.0)),
        "cosine": (facing**4, (0.0, 0.0)),
        "wide": (front * np.exp(-0.5 * ((h / 15.0) ** 2 + (v / 8.0) ** 2)), (0.0, 0.0)),
        "wide_below": (front * np.exp(-0.5 * ((h / 15.0) ** 2 + (v / 8.0) ** 2)), (5.0, 5.0)),
        "narrow": (front * np.exp(-0.5 * ((h / 10.0) ** 2 + (v / 5.0) ** 2)), (0.0, 0.0)),
        "low_beam": (low, (-4.0, 0.7)),
        "low_beam_near": (low, (-12.0, 2.5)),
        "high_beam": (high, (-4.0, 0.7)),
        "street_lamp": (street, (0.0, -15.0)),
    }


def write_lobes(out, photons):
    """Table of halos of lamps that shine unevenly."""
    sources = lobe_sources()
    tables = np.ascontiguousarray(np.stack([table for table, _ in sources.values()]), dtype=np.float32)
    eyes, sides = np.radians([eye for _, eye in sources.values()]), np.array(list(SIDES.values()))
    with out.open("w", encoding="utf-8") as file:
        file.write("# Radiance scattered about lamps that shine unevenly in endless fog, times R^2 [cd].\n")
        file.write("# Lamps: `lobe_sources`; optical depth k R; middle of each bin of angles [degrees]; on which\n")
        file.write("# side of the lamp, as it sees it, the line of sight passes. Its direct light is left out.\n")
        file.write(f"# Command: python benchmarks/monte_carlo.py lobes {out} --photons {photons}\n")
        file.write(f"fog,optical_depth,angle,lamp,{','.join(SIDES)}\n")
        for seed, fog in enumerate(LOBE_FOGS):
            rng, cosines = np.random.default_rng(seed), likely_cosines(phase_table(fog))
            fixed = (LOBE_DEPTHS, LOBE_EDGES, HALO_END, LOBE_STEP, tables, eyes, sides)
            total = lobe_halo(photons, rng, cosines, *fixed)
            for (j, depth), (b, angle), (i, name) in itertools.product(
                enumerate(LOBE_DEPTHS), enumerate(np.degrees(LOBE_EDGES.mean(axis=1))), enumerate(sources)
            ):
                file.write(f"{fog},{depth:g},{angle:g},{name}," + ",".join(f"{n:.4g}" for n in total[j, b, i]) + "\n")


def write_origins(out, photons):
    """Table of where light leaves a lamp that is seen scattered about it."""
    with out.open("w", encoding="utf-8") as file:
        file.write("# How scattered light that an eye sees about a lamp had left it, in endless fog: shares [1e-5].\n")
        file.write(
            "# Optical depth k R; angle of the line of sight off the lamp [degrees], middle of its bin; radiance\n"
        )
        file.write("# there about a lamp that shines alike in all directions, times R^2 / I.\n")
        file.write("# Columns: angle between the way to the eye and where it left (edges: `emitted`), in each the\n")
        file.write("# turn of the latter about the former from the side of the line of sight (edges: `turned`).\n")
        for name, edges in (("seen", ORIGIN_ANGLES), ("emitted", ORIGIN_EMITTED), ("turned", ORIGIN_TURNS)):
            file.write(f"# {name} " + " ".join(f"{angle:g}" for angle in np.degrees(edges)) + "\n")
        file.write(f"# Command: python benchmarks/monte_carlo.py origins {out} --photons {photons}\n")
        count = (len(ORIGIN_EMITTED) - 1) * (len(ORIGIN_TURNS) - 1)
        file.write("fog,optical_depth,angle,glow," + ",".join(f"s{n}" for n in range(count)) + "\n")
        for seed, fog in enumerate(FOGS):
            rng, cosines = np.random.default_rng(100 + seed), likely_cosines(phase_table(fog))
            bins = (ORIGIN_DEPTHS, ORIGIN_ANGLES, ORIGIN_EMITTED, ORIGIN_TURNS, HALO_END)
            weights = origins(photons, rng, cosines, *bins)
            middles = np.degrees(np.sqrt(ORIGIN_ANGLES[1:] * ORIGIN_ANGLES[:-1]))
            for (j, depth), (b, angle) in itertools.product(enumerate(ORIGIN_DEPTHS), enumerate(middles)):
                total = weights[j, b].sum()
                solid = 2 * math.pi * (math.cos(ORIGIN_ANGLES[b]) - math.cos(ORIGIN_ANGLES[b + 1]))
                shares, glow = weights[j, b].reshape(-1) / total, total / (solid * photons)
                file.write(
                    f"{fog},{depth:g},{angle:.4g},{glow:.4g},"
                    + ",".join(f"{1e5 * share:.0f}" for share in shares)
                    + "\n"
                )


def ray(right, up):
    """A direction (forward, left, up) and how far one sees along it [m]: the road, or a target 40 m ahead on it."""
    a, e = math.radians(right), math.radians(up)
    towards = np.array([math.cos(e) * math.cos(a), -math.cos(e) * math.sin(a), math.sin(e)])
    return towards, min(EYE_HEIGHT / -towards[2] if up < 0 else math.inf, 40.0 if up == -2.02 else 400.0)


def write_veil(out, paths):
    """Table of veils."""
    grid = np.linspace(-math.pi / 2, math.pi / 2, 1441)
    beams = {"low": low_beam(), "high": high_beam()}
    rng = np.random.default_rng(1)
    with out.open("w", encoding="utf-8") as file:
        file.write("# Radiance of fog lit by a pair of own head lamps [cd/m^2] (UMTRI median beams), black road.\n")
        file.write("# Eye 1.5 m above the road, lamps 1.8 m ahead of it, 0.6 m aside, 0.65 m above the road.\n")
        file.write("# Angles [degrees], lengths [m]; `single`: light scattered once, and standard errors.\n")
        file.write(f"# Command: python benchmarks/monte_carlo.py veil {out} --photons {paths}\n")
        file.write("fog,beam,visibility,right,up,reach,single,single_error,all,all_error\n")
        for fog in VEIL_FOGS:
            phase = phase_table(fog)
            phases, cosines = np.stack((phase, without_peak(phase))), likely_cosines(phase)
            for name, beam in beams.items():
                table = luminous_intensity(beam, grid, grid[:, None])
                for visibility in VISIBILITIES:
                    k = extinction_from_visibility(visibility)
                    for right, up in DIRECTIONS:
                        towards, reach = ray(right, up)
                        fixed = (phases, cosines, STEP, table, LAMPS, -EYE_HEIGHT, LAMP_SIZES)
                        result = veil(paths, rng, k, towards, reach, *fixed)
                        numbers = (visibility, right, up, reach, *result)
                        file.write(f"{fog},{name}," + ",".join(f"{n:.5g}" for n in numbers) + "\n")


def main():
    """Write a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("airlight", "halo", "lobes", "origins", "road", "surroundings", "veil"))
    parser.add_argument("out", type=Path)
    parser.add_argument("--photons", type=int, default=400_000)
    arguments = parser.parse_args()
    writers = {"halo": write_halo, "lobes": write_lobes, "origins": write_origins}
    writers |= {"airlight": write_airlight, "road": write_road, "veil": write_veil, "surroundings": write_surroundings}
    writers[arguments.what](arguments.out, arguments.photons)


if __name__ == "__main__":
    main()
