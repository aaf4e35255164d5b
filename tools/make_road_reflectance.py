"""Write the reflectance of roads by the angle at which they are seen: ``python tools/make_road_reflectance.py``.

Of a road under a sky of even luminance L, the luminance towards an eye at the elevation γ is R(γ) L. By reciprocity
R(γ) is the share of light from that direction that the road reflects at all. The road is taken for a diffuse body under
a rough surface of facets: R(γ) = ρ + ∫ f_s cos θ dω with f_s = D G F / (4 cos θ sin γ), Trowbridge and Reitz's
distribution D of facets (1975), Smith's masking and shadowing G (height-correlated, Heitz 2014) and Fresnel's F of
bitumen and stone (n = 1.5) or of a film of water (1.33). Light that facets throw on one another is left out.

Its two unknowns, the albedo ρ and the roughness, follow from two measures that CIE gives of each standard surface (CIE
144:2001; S1 [M: from memory, within the classes' limits]), both of an eye at γ = 1°: the average luminance coefficient
Q0 over the directions in which lamps are, and the specular factor S1 = r(0, tan ε = 2) / r(0, 0), r = q cos³ ε. For the
wet one (W1, CIE 47-1979) ρ is that of the dry one times 0.6, as water between the grains darkens [M: Lekner & Dorf
1988], and Q0 gives the roughness.

Held against what was not used: R(90°) comes out at 0.07 … 0.1 for R2 … R4, where asphalt has an albedo of 0.05 when
new and 0.1 … 0.15 when old, and the luminance coefficient in diffuse light Qd = R / π at 1° is 0.05 … 0.055
cd m⁻² lx⁻¹. Of 18 roads measured at 1° … 10° Qd falls with the angle as well (Lighting Res. Technol. 2026, COLUROUTE2,
doi:10.1177/14771535261452156).
"""

import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, fsolve

TABLE = Path(__file__).parents[1] / "fogsim" / "render" / "data" / "road_reflectance.csv"
NODES = 33
"""Rows of the table: √(sin γ) in even steps from 0 to 1, since most happens near the horizon."""

STONE, WATER = 1.5, 1.33
DARKER_WET = 0.6
EYE, ABOVE = math.radians(1.0), math.pi / 2 - 1e-6
LEAST_SINE = 1e-5

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Road:
    """Albedo of the body [-], roughness of the surface [-] and its refractive index [-]."""

    albedo: float
    roughness: float
    index: float = STONE

    def luminance_coefficient(self, elevation: float, tangent: Floats, azimuth: Floats) -> Floats:
        """Q [1/sr] of light from ahead (azimuth 0) at an angle of incidence ε with tan ε."""
        cosine = 1.0 / np.sqrt(1.0 + tangent**2)
        return self.albedo / math.pi + facets(self, elevation, cosine, azimuth)

    def reflectance(self, elevation: float) -> float:
        """R(γ) [-]."""
        # Nodes lie densely where light grazes, and where it comes from right ahead.
        share = (np.arange(600) + 0.5) / 600
        cosine, azimuth = (share**2)[:, None], math.pi * share**2
        weight = (2.0 * share / 600)[:, None] * (2.0 * math.pi * share / 600)
        specular = 2.0 * np.sum(facets(self, elevation, cosine, azimuth) * cosine * weight)
        return self.albedo + float(specular)


def facets(road: Road, elevation: float, cosine: Floats, azimuth: Floats) -> Floats:
    """f_s of facets; the light's azimuth is 0 if it comes from where the eye looks to."""
    up, level, square = math.sin(elevation), math.cos(elevation), road.roughness**2
    sine = np.sqrt(1.0 - cosine**2)
    x, y, z = level - sine * np.cos(azimuth), sine * np.sin(azimuth), up + cosine
    length = np.sqrt(x * x + y * y + z * z)
    normal, toward = z / length, (level * x + up * z) / length
    density = square / (math.pi * (normal**2 * (square - 1.0) + 1.0) ** 2)
    seen = 1.0 / (1.0 + shadow(np.array(up), square) + shadow(cosine, square))
    return density * seen * fresnel(toward, road.index) / (4.0 * cosine * up)


def shadow(cosine: Floats, square: float) -> Floats:
    """Smith's Λ of Trowbridge and Reitz's facets."""
    return 0.5 * (np.sqrt(1.0 + square * (1.0 - cosine**2) / cosine**2) - 1.0)


def fresnel(cosine: Floats, index: float) -> Floats:
    """Reflectance of a smooth facet for unpolarised light."""
    g = np.sqrt(index * index - 1.0 + cosine**2)
    return (
        0.5
        * ((g - cosine) / (g + cosine)) ** 2
        * (1.0 + ((cosine * (g + cosine) - 1) / (cosine * (g - cosine) + 1)) ** 2)
    )


def lamp_measures(road: Road) -> tuple[float, float]:
    """Q0 [1/sr] and S1 [-] of CIE 144, by lamps up to 12 mounting heights ahead, 4 behind and 3 aside."""
    ahead, aside = np.meshgrid((np.arange(320) + 0.5) / 20.0 - 4.0, (np.arange(120) + 0.5) / 20.0 - 3.0)
    tangent = np.hypot(ahead, aside)
    solid_angle = (1.0 + tangent**2) ** -1.5
    q = road.luminance_coefficient(EYE, tangent, np.arctan2(aside, ahead))
    below, before = (float(road.luminance_coefficient(EYE, np.array(t), np.array(0.0))) for t in (0.0, 2.0))
    return float(np.sum(q * solid_angle) / np.sum(solid_angle)), before * 5.0**-1.5 / below


def of_standard(q0: float, s1: float) -> Road:
    """The road that has a standard surface's measures."""

    def off(unknown: Floats) -> list[float]:
        found = lamp_measures(Road(float(unknown[0]), math.exp(unknown[1])))
        return [found[0] / q0 - 1.0, found[1] / s1 - 1.0]

    albedo, roughness = fsolve(off, (0.1, math.log(0.6)))
    return Road(float(albedo), math.exp(roughness))


def wet(dry: Road, q0: float) -> Road:
    """A road under a film of water."""
    albedo = DARKER_WET * dry.albedo

    def off(logarithm: float) -> float:
        return lamp_measures(Road(albedo, math.exp(logarithm), WATER))[0] / q0 - 1.0

    return Road(albedo, math.exp(brentq(off, math.log(0.08), 0.0)), WATER)


def roads() -> Iterator[tuple[str, str, Road]]:
    """Names of surfaces, CIE's standard surfaces that they are, and their models."""
    dry = of_standard(0.07, 0.58)
    yield "dry", "R2: Q0 0.07, S1 0.58", dry
    yield "worn", "R4: Q0 0.08, S1 1.55", of_standard(0.08, 1.55)
    yield "wet", "W1: Q0 0.114", wet(dry, 0.114)


def compared(name: str, standard: str, road: Road) -> str:
    """What there is to compare with others' figures."""
    down, grazing = road.reflectance(ABOVE), road.reflectance(EYE)
    ratios = " ".join(f"{road.reflectance(math.radians(angle)) / down:.2f}" for angle in (1.0, 3.0, 8.0, 20.0))
    told = f"{name + ' (' + standard + ')':30}{road.albedo:8.3f}{road.roughness:10.3f}{lamp_measures(road)[1]:7.2f}"
    return f"{told}{down:8.3f}{grazing:8.3f}{grazing / math.pi:8.3f}   {ratios}\n"


def main() -> None:
    """Write the table, and print what there is to compare with."""
    made = list(roads())
    others = [
        ("", "R1: Q0 0.10, S1 0.25", of_standard(0.1, 0.25)),
        ("", "R3: Q0 0.07, S1 1.11", of_standard(0.07, 1.11)),
    ]
    heading = ("albedo", 8), ("roughness", 10), ("S1", 7), ("R down", 8), ("R(1°)", 8), ("Qd(1°)", 8)
    told = "".join(f"{title:>{width}}" for title, width in heading)
    sys.stdout.write(f"{'surface':30}{told}   R(1°, 3°, 8°, 20°) / R down\n")
    sys.stdout.writelines(compared(*one) for one in made + others)
    # At the horizon, where the sine is 0, values are those of the least angle at which road is seen.
    root = np.linspace(0.0, 1.0, NODES)
    elevations = np.arcsin(np.clip(root**2, LEAST_SINE, math.sin(ABOVE)))
    down = made[0][2].reflectance(ABOVE)
    columns = [[road.reflectance(float(angle)) / down for angle in elevations] for _, _, road in made]
    with TABLE.open("w", encoding="utf-8") as file:
        file.write("# Reflectance of roads by the elevation of the eye over that of the dry one seen from above.\n")
        file.write(f"# CIE's standard surfaces: {'; '.join(f'{name} {standard}' for name, standard, _ in made)}.\n")
        file.write("# Command: python tools/make_road_reflectance.py\n")
        file.write(f"root_of_sine,{','.join(name for name, _, _ in made)}\n")
        for place, *values in zip(root.tolist(), *columns, strict=True):
            file.write(f"{place:.5f},{','.join(f'{value:.5f}' for value in values)}\n")


if __name__ == "__main__":
    main()
