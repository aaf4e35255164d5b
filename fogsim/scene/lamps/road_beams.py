"""Head lamps of other vehicles as what lights the road."""

import math
from collections.abc import Mapping, Sequence
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.vehicles import bodies, body_names
from fogsim.values.light import Beam, Lamp, RoadBeams, Side, burning
from fogsim.values.luminous_intensity import (
    LOBE_AZIMUTHS,
    LOBE_ELEVATIONS,
    SIGNAL_SHARES,
    SignalLobe,
    luminous_intensity,
)
from fogsim.values.scene import Surface
from fogsim.values.traffic import TrafficState, with_pieces

FULL = 1000.0
"""Intensity of the lobes of signal lamps along their axes [cd], so that they are never as dark as beams may be."""


def _lobe(shares: tuple[tuple[float, ...], ...]) -> Beam:
    table = np.array(shares)
    azimuth, elevation = (np.concatenate((-axis[:0:-1], axis)) for axis in (LOBE_AZIMUTHS, LOBE_ELEVATIONS))
    upper = np.concatenate((table[:, :0:-1], table), axis=1)
    return Beam(azimuth, elevation, FULL * np.concatenate((upper[:0:-1], upper)))


SIGNAL_LOBES: tuple[Beam, ...] = tuple(_lobe(SIGNAL_SHARES[kind]) for kind in SignalLobe)
"""How signal lamps shine that give `FULL` along their axes, by `SignalLobe`."""

STREET_ANGLES = np.radians([0.0, 30.0, 50.0, 60.0, 65.0, 70.0, 75.0, 80.0, 85.0, 90.0])
"""Angles from straight down to which `STREET_INTENSITIES` belong [rad]."""

STREET_INTENSITIES = np.array([1500.0, 1800.0, 2400.0, 2900.0, 3000.0, 2900.0, 2000.0, 1000.0, 500.0, 0.0])
"""Intensity of a street lamp on a mast of 8 m, a large one: 12.3 klm, alike in all directions about the mast [cd]."""


def _street_lobe() -> Beam:
    below = np.radians(np.arange(0.0, 90.1, 1.0))
    column = np.interp(below, STREET_ANGLES, STREET_INTENSITIES)
    return Beam(np.array([-math.pi, math.pi]), below - 0.5 * math.pi, np.repeat(column[:, None], 2, axis=1))


STREET_LOBE: Beam = _street_lobe()
"""The same as a beam, whatever its axis."""


def signal_shares() -> NDArray[np.float64]:
    """Ln of the share of its axial intensity that each kind of signal lamp shines (kinds, elevations, azimuths)."""
    return np.asarray(np.log(np.array([SIGNAL_SHARES[kind] for kind in SignalLobe])))


@lru_cache(maxsize=64)
def sum_of_beams(beams: tuple[Beam, ...]) -> Beam:
    """What lamps in one housing shine together."""
    if len(beams) == 1:
        return beams[0]
    azimuth, elevation = (
        np.unique(np.concatenate([getattr(beam, name) for beam in beams])) for name in ("azimuth", "elevation")
    )
    each = np.stack([luminous_intensity(beam, azimuth, elevation[:, None]) for beam in beams])
    return Beam(azimuth, elevation, each.sum(axis=0))


FARTHEST, _MOST = 150.0, 4
"""Distance beyond which beams on the road are left out [m], and how many vehicles' are drawn, the nearest."""

_HEIGHT_STEP = 0.05
"""Heights of lamps are rounded to this [m], so that few patterns are computed."""

_FOG_HEIGHT = 0.55
"""Height of front fog lamps over that of the head lamps [-]."""


def road_beams(
    state: TrafficState,
    skip: int | None,
    eye: Sequence[float] | NDArray[np.float64],
    beams: Mapping[Lamp, Beam],
    sky_illuminance: float,
) -> RoadBeams | None:
    """Lit head lamps and front fog lamps near a camera, whichever way they shine; None if there are none.

    Takes `eye` (3,) [m], `sky_illuminance` [lx].
    """
    state, _ = with_pieces(state, skip)
    shining = sum(map(int, beams))
    away = np.hypot(*(state.position[:, :2] - np.asarray(eye, np.float64)[:2]).T)
    lit = np.flatnonzero(((state.lamps & shining) != 0) & (away < FARTHEST))
    nearest = [row for row in lit[np.argsort(away[lit], kind="stable")].tolist() if row != skip][:_MOST]
    names, kinds = body_names(state), tuple(map(int, beams))
    found: list[tuple[int, float, int, float]] = []
    for row in nearest:
        for kind, share, count in _lit_kinds(int(state.lamps[row]), kinds):
            height = _head_lamp_height(names[row]) * float(state.height[row]) * share
            found.append((row, max(round(height / _HEIGHT_STEP), 1) * _HEIGHT_STEP, kind, count))
    if not found:
        return None
    rows, heights, numbers, scales = (np.array(column) for column in zip(*found, strict=True))
    position = state.position[rows]
    position[:, 2] += heights
    return RoadBeams(
        position=position,
        heading=state.heading[rows],
        grade=state.grade[rows],
        height=heights,
        kinds=tuple(beams.values()),
        kind=numbers.astype(np.int64),
        scale=scales,
        sky_illuminance=sky_illuminance,
    )


@lru_cache(64)
def _lit_kinds(lamps: int, kinds: tuple[int, ...]) -> tuple[tuple[int, float, float], ...]:
    """Number of each lit kind of lamp, its height over that of the head lamps [-], and how many are lit."""
    left, right = (burning(lamps, side) for side in (Side.LEFT, Side.RIGHT))
    counts = [bool(left & lamp) + bool(right & lamp) for lamp in kinds]
    return tuple(
        (kind, _FOG_HEIGHT if kinds[kind] == int(Lamp.FRONT_FOG) else 1.0, float(count))
        for kind, count in enumerate(counts)
        if count
    )


@cache
def _head_lamp_height(body: str) -> float:
    """Height of a body's head lamps over its own [-]."""
    heights = [
        float(lamp.centre[2]) for lamp in bodies()[body].lamps if lamp.front and lamp.surface is Surface.LAMP_HEAD
    ]
    return sum(heights) / len(heights) if heights else 0.4
