"""Kernels make no index of NaN, of an infinite or of a huge number: what they read lies within their tables."""

import math
from collections.abc import Callable

import numpy as np

from fogsim.atmosphere.lamps import halo_lamps, lobe_kernels
from fogsim.render.cpu import occlusion
from fogsim.render.shading import lines, pavement
from fogsim.vision.restoration import light_kernels
from fogsim.vision.strips import joint_kernels

LEVELS = 10
TABLE = np.linspace(0.0, 1.0, LEVELS)
Places = Callable[[float], tuple[float, ...]]

PLACES: dict[str, Places] = {
    "level of an eye": lambda x: (joint_kernels.eye_level(x, 1.0, LEVELS)[0],),
    "entry of a lamp's table": lambda x: (lobe_kernels._place(x, 1.0, 0.1, LEVELS)[0],),
    "row of a glow's table": lambda x: (halo_lamps._row_of(x, TABLE)[0],),
    "pixels of a box": lambda x: occlusion._pixels(x, x, 1.0, 1.0, 0.0, 0, LEVELS - 1),
    "pixels of a line": lambda x: lines.columns_near(x, x, 1.0, LEVELS - 1),
}
"""What each kernel reads at, which must lie within 0 … LEVELS − 1."""

VALUES: dict[str, Places] = {
    "reflectance": lambda x: (pavement.reflectance_at(TABLE, x),),
    "brightness": lambda x: (pavement.mean_of_stretches(np.zeros(pavement.PERIOD + 1), x, 1.0),),
}
"""What kernels read, which comes from within their tables where it is a number at all."""

WRONG = [math.nan, math.inf, -math.inf, 1e40, -1e40]


def test_places_are_within_the_table_and_values_from_it() -> None:
    for wrong in WRONG:
        for name, place in PLACES.items():
            assert all(0 <= index < LEVELS for index in place(wrong)), name
    for wrong in WRONG:
        for name, value in VALUES.items():
            assert all(math.isnan(read) or 0.0 <= read <= 1.0 for read in value(wrong)), name


def test_restored_pixels_are_values_of_their_table() -> None:
    for through in [0.0, math.nan, math.inf, 1e-38, -1.0]:
        nothing = np.empty((0, 0), np.float32)
        smoothing = light_kernels.Smoothing(nothing, nothing, nothing, np.float32(0.0), np.float32(0.0))
        pixels = np.arange(12, dtype=np.uint8).reshape(2, 2, 3)
        tables = np.tile(np.linspace(0.0, 2.0, 256, dtype=np.float32), (3, 1))
        scale, values = np.full(3, 9.0, np.float32), np.arange(7, 17, dtype=np.uint8)
        transmission = np.full((2, 2), through, np.float32)
        made = light_kernels.restored_pixels(pixels, tables, transmission, smoothing, scale, values)
        assert ((made >= 7) & (made <= 16)).all()
