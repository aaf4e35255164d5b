"""Airlight by elevation under several conditions: when it is far from even, and when it is not."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fogsim.atmosphere import Droplets, fogged_radiance
from fogsim.reproduce.result import Cell, TitledTable
from fogsim.units import extinction_from_visibility
from fogsim.values import FogField, View
from fogsim.values.fog import AIRLIGHT_SHARE, airlight_share

ELEVATIONS = (-10.0, -5.0, -2.0, 0.0, 2.0, 5.0, 10.0, 30.0)
"""Of the lines of sight [degrees]."""

ALBEDOS = (0.0, 0.05, 0.1, 0.2, 0.4, 0.8, 1.0)


@dataclass(frozen=True, slots=True)
class Condition:
    """Albedo of the land (None for Koschmieder's fog), and V_met, heights of the layer and of the eye [m]."""

    name: str
    albedo: float | None = 0.1
    visibility: float = 100.0
    top: float = 250.0
    eye: float = 1.3
    droplets: Droplets = Droplets.MODERATE_RADIATION


_USUAL = Condition("V_met 100 m, layer 250 m, eye 1.3 m, small droplets")
_CONDITIONS = (
    _USUAL,
    replace(_USUAL, name="V_met 30 m", visibility=30.0),
    replace(_USUAL, name="V_met 400 m", visibility=400.0),
    replace(_USUAL, name="V_met 2000 m", visibility=2000.0),
    replace(_USUAL, name="layer 20 m", top=20.0),
    replace(_USUAL, name="layer 1000 m", top=1000.0),
    replace(_USUAL, name="eye 2.5 m", eye=2.5),
    replace(_USUAL, name="eye 6 m", eye=6.0),
    replace(_USUAL, name="large droplets (heavy advection fog)", droplets=Droplets.HEAVY_ADVECTION),
)
"""What is varied over land of albedo 0.1, one thing at a time."""


def airlight(condition: Condition, elevation: float, distance: float | None = None) -> float:
    """Airlight up to the road, or to a distance [m], over the path's loss, in E / π, by elevation [degrees]."""
    slope = math.sin(math.radians(elevation))
    if distance is None:
        distance = condition.eye / -slope if slope < 0 else (condition.top - condition.eye) / max(slope, 1e-6)
    level = (AIRLIGHT_SHARE if condition.albedo is None else airlight_share(condition.albedo),) * 3
    extinction = extinction_from_visibility(condition.visibility)
    field = FogField(extinction, level, top=condition.top, ground_albedo=condition.albedo)
    ray = np.zeros((3, 3))
    ray[:, 2] = math.cos(math.radians(elevation)), 0.0, slope
    black = View(np.zeros((1, 1, 3), np.float32), np.full((1, 1), distance, np.float32), np.zeros((1, 1), np.int32))
    seen = fogged_radiance(black, field, (0.0, 0.0, condition.eye), ray, condition.droplets)
    return float(seen[0, 0, 1]) / -math.expm1(-extinction * distance)


def conditions() -> tuple[list[Mapping[str, Cell]], tuple[TitledTable, TitledTable]]:
    """Airlight by albedo, and by what else there may be."""
    lands = [replace(_USUAL, name=f"albedo {albedo:g}", albedo=albedo) for albedo in ALBEDOS]
    records: list[Mapping[str, Cell]] = []
    tables = []
    for title, kinds in (
        (f"Airlight over E/π by elevation: {_USUAL.name}", lands),
        ("The same over land of albedo 0.1, with one thing changed", list(_CONDITIONS)),
    ):
        rows = [("", *(f"{elevation:g}°" for elevation in ELEVATIONS))]
        for kind in kinds:
            found = [airlight(kind, elevation) for elevation in ELEVATIONS]
            rows.append((kind.name, *(f"{one:.3f}" for one in found)))
            records += [
                {"paper": "airlight", "condition": kind.name, "elevation_deg": elevation, "airlight": one}
                for elevation, one in zip(ELEVATIONS, found, strict=True)
            ]
        tables.append(TitledTable(title, tuple(rows)))
    return records, (tables[0], tables[1])
