"""Make `fogsim/vision/data/airlight_slopes.npz` (seconds): how airlight brightens upward and darkens toward the road.

Of the table that `tools/make_airlight_table.py` makes, it keeps what an estimator needs that knows neither layer nor
droplets: their mean, by the optical height of the eye and the elevation of the line of sight. Albedo comes in as one
factor, for the source of scattered light is linear in it.

Usage: python tools/make_airlight_slopes.py
"""

from pathlib import Path

import numpy as np

from fogsim.atmosphere import Droplets
from fogsim.atmosphere.fog.layer_airlight import SlantAirlight, layer_table, path_means, slant_share

TABLE = Path(__file__).parents[1] / "fogsim" / "vision" / "data" / "airlight_slopes.npz"
DEPTHS = np.geomspace(0.002, 0.4, 12)
"""Optical heights of the eye above the ground [-]."""

ANGLES = 0.05 * np.linspace(0.0, 1.0, 41) / (1.05 - np.linspace(0.0, 1.0, 41))
"""Of the line of sight below or above the horizon [rad]."""

FAMILIES = (
    (Droplets.MODERATE_RADIATION,),
    (Droplets.HEAVY_RADIATION,),
    (Droplets.MODERATE_ADVECTION, Droplets.HEAVY_ADVECTION),
)
"""Droplets, small to large, that are distinguished: large ones scatter more narrowly forward."""

THICKNESSES = (3.0, 7.5, 15.0)
"""Optical thicknesses of layers that are averaged [-]."""


def slopes(thickness, depth, droplets):
    """Airlight toward the road and the sky over black ground: how far from the level one, over 1 − that."""
    table = layer_table(droplets)
    log = np.log(table.thickness)
    source = np.array(
        [[np.interp(np.log(thickness), log, cell) for cell in row] for row in table.black.transpose(1, 2, 0)]
    )
    around = SlantAirlight(path_means(table, source, thickness, depth), 1.0)
    level = float(slant_share(around, np.zeros(1), np.ones(1))[0])
    sine = np.maximum(np.sin(ANGLES), 1e-9)
    below = level - slant_share(around, -sine, 1.0 - np.exp(-depth / sine))
    above = slant_share(around, sine, np.ones_like(sine)) - level
    return below / (1.0 - level), above / (1.0 - level)


def family_means(droplets):
    """Means of `slopes` over droplets and layers: (2, depths, angles)."""
    cases = [(thickness, one) for thickness in THICKNESSES for one in droplets]
    means = np.mean([[slopes(thickness, depth, one) for depth in DEPTHS] for thickness, one in cases], axis=0)
    means[:, :, 0] = 0.0
    return means.transpose(1, 0, 2)


def main():
    """Write the table."""
    below, above = np.array([family_means(droplets) for droplets in FAMILIES]).transpose(1, 0, 2, 3)
    np.savez_compressed(
        TABLE,
        about="Airlight over black land, of lines of sight so far below or above the horizon: (level - below) and "
        "(above - level) over 1 - level; by droplets (small to large), optical height of the eye (depth) and "
        "angle [rad]. Command: python tools/make_airlight_slopes.py",
        depth=DEPTHS,
        angle=ANGLES,
        below=below.astype(np.float32),
        above=above.astype(np.float32),
    )


if __name__ == "__main__":
    main()
