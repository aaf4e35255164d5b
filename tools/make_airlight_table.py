"""Make the table of airlight in a plane layer of fog, `fogsim/atmosphere/data/airlight.npz` (two minutes).

    python tools/make_airlight_table.py

Light in a plane layer of fog that absorbs nothing, between a Lambertian ground and an overcast sky (CIE: luminance as
1 + 2 sin γ), has no azimuth. The equation of transfer is solved by lambda iteration for the light of the sky over black
ground, and for that of a shining ground under a black sky; their sum at any albedo follows from them exactly. It shares
nothing with the photon counts that the table is compared to but the phase function.
"""

import math
from pathlib import Path

import numpy as np

from fogsim.atmosphere.lamps.phase_function import Droplets, phase_function

TABLE = Path(__file__).parents[1] / "fogsim" / "atmosphere" / "data" / "airlight.npz"
_NEAR_HORIZON = (0, 0.1, 0.25, 0.5, 0.75, 1, 1.5, 2, 3, 4, 5, 6.5, 8, 10, 12.5, 15, 18, 22, 26)
LOOKS = np.array((*_NEAR_HORIZON, *range(30, 91, 5)), dtype=float)
"""Elevations of lines of sight above and below the horizon [degrees]."""

KEPT = (0, 2, 3, 5, 7, 8, 9, 10, 12, 13, 15, 17, 19, 22, 25, 28, 31)
"""Those of them that the table keeps, above and below."""

THICKNESSES = np.geomspace(0.002, 100.0, 32)
"""Optical thicknesses of the layer [-]."""

PLACES = np.concatenate(([0.0], np.geomspace(0.001, 0.3, 14), np.linspace(0.4, 0.8, 5), [0.86, 0.91, 0.95, 0.98, 1.0]))
"""Heights above the ground in the table, as shares of the thickness [-]."""

ANGLES, TURNS = 1000, 48


def scattering(droplets):
    """Matrix that takes radiance by line of sight to the source function by line of sight; rows of sum 1.

    Lines of sight: below the horizon from 90° to 0°, then above from 0° to 90°. Radiance is linear in the elevation
    between two of them, and may jump at the horizon.
    """
    phase, fine = phase_function(droplets), np.radians(np.arange(0.0, 180.001, 0.02))
    share = np.concatenate(([0.0], np.cumsum(0.5 * np.diff(-np.cos(fine)) * (phase(fine[1:]) + phase(fine[:-1])))))
    angle = np.interp((np.arange(ANGLES) + 0.5) / ANGLES, share / share[-1], fine)[:, None]
    turn = math.pi * (np.arange(TURNS) + 0.5) / TURNS
    count = len(LOOKS)
    out = np.zeros((2 * count, 2 * count))
    for row, look in enumerate(np.concatenate((-LOOKS[::-1], LOOKS))):
        sine, cosine = math.sin(math.radians(look)), math.cos(math.radians(look))
        came = sine * np.cos(angle) + cosine * np.sin(angle) * np.cos(turn)
        elevation = np.degrees(np.arcsin(np.clip(came, -1.0, 1.0))).ravel()
        size = np.abs(elevation)
        left = np.minimum(np.searchsorted(LOOKS, size, side="right") - 1, count - 2)
        right = (size - LOOKS[left]) / (LOOKS[left + 1] - LOOKS[left])
        for node, weight in ((left, 1.0 - right), (left + 1, right)):
            np.add.at(out[row], np.where(elevation < 0, count - 1 - node, count + node), weight / elevation.size)
    return out


def levels(thickness):
    """Optical heights between which the source function is taken to be linear: dense at both boundaries."""
    half = [0.0, min(1e-3, 0.02 * thickness)]
    while half[-1] < 0.5 * thickness:
        half.append(half[-1] + min(0.25 * half[-1], 0.4))
    half = np.array(half) * (0.5 * thickness / half[-1])
    return np.concatenate((half, thickness - half[-2::-1]))


def solved(matrix, thickness, ground, sky):
    """Source function and radiance (levels, lines of sight) between a ground and a sky of given luminances.

    Parameters: luminance of the ground, and of the sky for each elevation of `LOOKS`.
    """
    heights = levels(thickness)
    sine = np.maximum(np.sin(np.radians(LOOKS)), 1e-12)
    steps = np.diff(heights)[:, None] / sine
    lost = np.exp(-steps)
    near = 1.0 + np.expm1(-steps) / steps
    far = -np.expm1(-steps) / steps - lost
    count, last = len(LOOKS), len(heights) - 1
    radiance = np.full((last + 1, 2 * count), 0.5 * (ground + sky.mean()))
    source = radiance.copy()
    change = previous = 1.0
    for _ in range(200_000):
        radiance[0, :count], radiance[last, count:] = ground, sky
        for n in range(last):
            down = source[:, count - 1 :: -1]
            radiance[n + 1, count - 1 :: -1] = (
                radiance[n, count - 1 :: -1] * lost[n] + down[n + 1] * near[n] + down[n] * far[n]
            )
            m = last - 1 - n
            radiance[m, count:] = radiance[m + 1, count:] * lost[m]
            radiance[m, count:] += source[m, count:] * near[m] + source[m + 1, count:] * far[m]
        found = radiance @ matrix.T
        change, previous = np.max(np.abs(found - source)), change
        source = found
        # What is still to come is a geometric series.
        ratio = min(change / previous, 0.999999)
        if change / (1.0 - ratio) < 1e-5:
            return heights, source, radiance
    raise RuntimeError(f"no convergence in a layer of optical thickness {thickness:g}")


def half_flux(radiance):
    """Flux of the radiance by elevation of `LOOKS` through a horizontal surface, over that of an even radiance of 1."""
    square = np.sin(np.radians(LOOKS)) ** 2
    return float(np.sum(0.5 * (radiance[1:] + radiance[:-1]) * np.diff(square)))


def vertical_light(ground, above):
    """Light of a vertical surface near the ground, over that of one which sees luminance 1 everywhere.

    Parameters: luminance of the ground, and of what is above, for each elevation of `LOOKS`.
    """
    elevation = np.linspace(0.0, 0.5 * math.pi, 9001)
    seen = np.interp(np.degrees(elevation), LOOKS, above) * np.cos(elevation) ** 2
    return 0.5 * ground + 2.0 / math.pi * float(np.trapezoid(seen, elevation))


def layer(matrix, thickness):
    """Reflectance of the layer from below, its transmittance of the sky's light, and source functions.

    The latter (levels, lines of sight) over E / π, E that on the ground: over black ground, and what an albedo of 1
    adds. They are linear in the albedo, for the light between ground and layer is a geometric series. So is the light
    of a vertical surface over E, the last two.
    """
    count = len(LOOKS)
    overcast = 3.0 / 7.0 * (1.0 + 2.0 * np.sin(np.radians(LOOKS)))
    heights, by_ground, radiance = solved(matrix, thickness, 1.0, np.zeros(count))
    reflectance, upright_by_ground = half_flux(radiance[0, count:]), vertical_light(1.0, radiance[0, count:])
    _, by_sky, radiance = solved(matrix, thickness, 0.0, overcast)
    transmittance = half_flux(radiance[0, count:])
    black, upright = by_sky / transmittance, vertical_light(0.0, radiance[0, count:]) / transmittance
    more = by_ground - reflectance * black, upright_by_ground - reflectance * upright
    return heights, reflectance, transmittance, (black, more[0]), (upright, more[1])


def main():
    """Write the table."""
    found = {}
    for droplets in Droplets:
        found |= {f"{droplets}_{name}": values for name, values in table_of(droplets).items()}
        print(f"done: {droplets}", flush=True)  # noqa: T201
    np.savez_compressed(
        TABLE,
        about="Source function of airlight in a plane layer of fog under a CIE overcast sky, over E / pi, E of the "
        "ground: black + albedo * per_albedo, by thickness (optical), place (share of it above the ground), elevation "
        "[degrees]. vertical: light of a vertical surface near the ground, over E, likewise. Albedo 0 to 1. "
        "Command: python tools/make_airlight_table.py",
        thickness=THICKNESSES,
        place=PLACES,
        elevation=np.concatenate((-LOOKS[list(KEPT[:0:-1])], LOOKS[list(KEPT)])),
        **found,
    )


def table_of(droplets):
    """Arrays of the table for droplets: `black`, `per_albedo` (float16), and for each thickness four numbers."""
    matrix, count = scattering(droplets), len(LOOKS)
    kept = [count - 1 - n for n in KEPT[:0:-1]] + [count + n for n in KEPT]
    names = ("black", "per_albedo", "reflectance", "transmittance", "vertical_black", "vertical_per_albedo")
    rows = {name: [] for name in names}
    for thickness in THICKNESSES:
        heights, back, through, sources, upright = layer(matrix, thickness)
        for source, name in zip(sources, ("black", "per_albedo"), strict=True):
            at = [np.interp(thickness * PLACES, heights, column) for column in source[:, kept].T]
            rows[name].append(np.array(at, dtype=np.float16).T)
        for light, name in zip(upright, ("vertical_black", "vertical_per_albedo"), strict=True):
            rows[name].append(light)
        rows["reflectance"].append(back)
        rows["transmittance"].append(through)
    return {name: np.array(values) for name, values in rows.items()}


if __name__ == "__main__":
    main()
