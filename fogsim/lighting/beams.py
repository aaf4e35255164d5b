"""Beams of head lamps and front fog lamps, from published tables and the limits of regulations."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.values import Beam, HeadLamp, Lamp
from fogsim.values.light import Side, burning
from fogsim.values.luminous_intensity import checked_beam, luminous_intensity

FRONT_FOG_PEAK = 4000.0
"""Largest intensity of the front fog lamp [cd]; class F3 may have up to 8600 … 12000 cd."""


@cache
def low_beam() -> Beam:
    """Median low beam of US cars of 2004, one lamp (UMTRI-2004-23, table 4)."""
    return _packaged("umtri_low_beam.csv")


@cache
def high_beam() -> Beam:
    """Median high beam of US cars of 2001, one lamp (UMTRI-2001-19, table 6)."""
    return _packaged("umtri_high_beam.csv")


@cache
def front_fog_beam() -> Beam:
    """Wide, flat beam of a front fog lamp with a horizontal cut-off, one lamp.

    No measured table stands behind it: a peak of `FRONT_FOG_PEAK` 2.2° down, half of it 18° to either side, and at most
    some hundred candela above the horizontal, as UNECE R19 class F3 asks (limits from memory).
    """
    right = np.radians(np.linspace(-60.0, 60.0, 61))
    up = np.radians(np.concatenate((np.arange(-20.0, -5.0, 1.0), np.arange(-5.0, 0.5, 0.1), np.arange(0.5, 10.1, 0.5))))
    sideways = np.exp(-math.log(2.0) * (np.abs(np.degrees(right)) / 18.0) ** 1.6)
    depth = np.degrees(up) + 2.2
    height = np.exp(-np.where(depth > 0, (depth / 1.2) ** 2, np.abs(depth / 4.0) ** 1.3))
    stray = 150.0 * np.exp(-np.maximum(np.degrees(up), 0.0) / 4.0)
    return checked_beam(Beam(right, up, np.maximum(FRONT_FOG_PEAK * height, stray)[:, None] * sideways + 5.0))


def scaled_beam(beam: Beam, factor: float) -> Beam:
    """The same beam, brighter or dimmer."""
    return checked_beam(Beam(beam.azimuth, beam.elevation, beam.intensity * factor), f"beam times {factor!r}")


def read_beam(text: str, name: str) -> Beam:
    """Beam from a table."""
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    if len(lines) < 3:
        raise InputError(f"{name}: a beam table needs a row of azimuths and two or more rows of intensities")
    cells = [line.split(",") for line in lines]
    width = len(cells[0])
    for row, line in enumerate(cells):
        if len(line) != width:
            raise InputError(f"{name}: row {row} has {len(line)} cells, the first row has {width}")
    right = [_number(cell, name, 0, column) for column, cell in enumerate(cells[0]) if column]
    body = np.array([[_number(cell, name, r + 1, c) for c, cell in enumerate(row)] for r, row in enumerate(cells[1:])])
    beam = Beam(np.radians(np.array(right)), np.radians(body[:, 0]), np.ascontiguousarray(body[:, 1:]))
    return checked_beam(beam, name)


def _number(cell: str, name: str, row: int, column: int) -> float:
    try:
        return float(cell)
    except ValueError:
        raise InputError(f"{name}: row {row}, column {column} must hold a number, got {cell!r}") from None


def _packaged(name: str) -> Beam:
    return read_beam((files("fogsim.lighting") / "data" / name).read_text(encoding="utf-8"), name)


def luminous_flux(beam: Beam, right: tuple[float, float], up: tuple[float, float]) -> float:
    """Flux through a window of directions [lm] (`right`, `up` [rad])."""
    azimuth, elevation = _middles(*right, 900), _middles(*up, 240)
    solid_angle = np.cos(elevation) * (right[1] - right[0]) * (up[1] - up[0]) / (len(azimuth) * len(elevation))
    return float(np.sum(luminous_intensity(beam, azimuth, elevation[:, None]) * solid_angle[:, None]))


def _middles(start: float, end: float, count: int) -> NDArray[np.float64]:
    return start + (end - start) * (np.arange(count) + 0.5) / count


def _beams() -> dict[Lamp, Beam]:
    return {Lamp.LOW_BEAM: low_beam(), Lamp.HIGH_BEAM: high_beam(), Lamp.FRONT_FOG: front_fog_beam()}


@dataclass(frozen=True, slots=True)
class LampMount:
    """Where a car's front lamps are, and what they shine.

    Attributes
    ----------
    behind_bumper : float
        Distance of the lamps behind the front bumper [m].
    half_spacing : float
        Distance of each head lamp from the middle of the car [m].
    height : float
        Height of the head lamps above the road [m].
    fog_half_spacing, fog_height : float
        The same of the front fog lamps [m].
    beams : mapping of Lamp to Beam
        Beam of one lamp of each pair.
    """

    behind_bumper: float = 0.1
    half_spacing: float = 0.6
    height: float = 0.65
    fog_half_spacing: float = 0.65
    fog_height: float = 0.35
    beams: Mapping[Lamp, Beam] = field(default_factory=_beams)


def own_head_lamps(
    lamps: Lamp, mount_height: float, setback: float = 1.9, mount: LampMount | None = None
) -> tuple[HeadLamp, ...]:
    """Lit lamps that shine ahead.

    Parameters
    ----------
    lamps : Lamp
        Lit lamps; of these only low beam, high beam and front fog lamps throw light ahead.
    mount_height : float
        Height of the camera above the road [m].
    setback : float
        Distance of the camera behind the front bumper [m].
    mount : LampMount or None
        Where the lamps are; None for a car's.
    """
    where = mount or LampMount()
    lit = []
    for lamp, beam in where.beams.items():
        if lamp in lamps:
            fog = lamp is Lamp.FRONT_FOG
            aside = where.fog_half_spacing if fog else where.half_spacing
            up = (where.fog_height if fog else where.height) - mount_height
            offsets = [
                offset for side, offset in ((Side.LEFT, aside), (Side.RIGHT, -aside)) if burning(lamps, side) & lamp
            ]
            lit += [HeadLamp((setback - where.behind_bumper, offset, up), beam) for offset in offsets]
    return tuple(lit)
