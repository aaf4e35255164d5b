"""Glow about lamps that do not shine alike in all directions.

Of the scattered light that an eye sees at an angle γ off a lamp, each part had left the lamp in some direction: light
scattered once at the angle Θ − γ from the way to the eye, on the side on which the line of sight passes; light
scattered more often about there, too, but spread. How much left where was counted on photons, once for all lamps
(`benchmarks/monte_carlo.py origins`): the glow of a lamp is that of one that shines alike in all directions
(`fogsim.atmosphere.lamps.glow`), with the mean of the lamp's intensity over those directions in place of its intensity,
times what photons give of that glow.
"""

import math
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogsim.atmosphere.lamps.glow import glow
from fogsim.atmosphere.lamps.halo_lamps import SIDES
from fogsim.atmosphere.lamps.phase_function import Droplets
from fogsim.values import Beam
from fogsim.values.luminous_intensity import luminous_intensity

AZIMUTH_FOLD, ELEVATION_FOLD = 0.12, 0.06
"""Angles off a lamp's axis that lie half-way in a table [rad]: tables are fine near the axis, where cut-offs are."""

AZIMUTHS, ELEVATIONS = 21, 17
"""Directions to the eye in a table."""

_GLOWS = 6  # angles in each bin of them at which the glow is computed
_HALVES = 2  # directions in each bin of emitted angles


@dataclass(frozen=True, slots=True)
class Origins:
    """Where scattered light had left the lamp about which it is seen."""

    log_depth: NDArray[np.float64]  # (t,): ln τ of the lamp
    angle: NDArray[np.float64]  # (g,): Angles of lines of sight off the lamp [rad]
    # (e + 1,): Edges of the bins of angles between the way to the eye and where the light left [rad]
    emitted: NDArray[np.float64]
    # (m,): Middles of the bins of turns of where it left from the side on which the line of sight passes, about the way
    # to the eye [rad]
    turned: NDArray[np.float64]
    # (t, g, e, m): Of the light, what left in each bin; adds up to 1 for each depth and angle
    share: NDArray[np.float64]
    # (t, g): Luminance about a lamp that shines alike in all directions, over that of `fogsim.atmosphere.lamps.glow`
    # [-]
    excess: NDArray[np.float64]


@cache
def light_origins(droplets: Droplets) -> Origins:
    """Where light that fog scatters had left its lamp, by photons."""
    lines = (files("fogsim.atmosphere") / "data" / "light_origins.csv").read_text(encoding="utf-8").splitlines()
    seen, emitted, turned = (_edges(lines, name) for name in ("seen", "emitted", "turned"))
    rows = [line.split(",", 1)[1] for line in lines if line.startswith(f"{Droplets(droplets)},")]
    table = np.array([[float(cell) for cell in row.split(",")] for row in rows])
    depths = np.unique(table[:, 0])
    share = table[:, 3:].reshape(len(depths), len(seen) - 1, len(emitted) - 1, len(turned) - 1)
    share /= share.sum(axis=(2, 3), keepdims=True)
    return Origins(
        np.log(depths),
        np.sqrt(seen[1:] * seen[:-1]),
        emitted,
        0.5 * (turned[1:] + turned[:-1]),
        share,
        table[:, 2].reshape(len(depths), -1) / _mean_glow(depths, seen, droplets),
    )


def _mean_glow(depths: NDArray[np.float64], seen: NDArray[np.float64], droplets: Droplets) -> NDArray[np.float64]:
    """Glow (t, g) at optical depths, the mean over bins of angles by their solid angle."""
    part = (np.arange(_GLOWS) + 0.5) / _GLOWS
    angle = seen[:-1, None] + (seen[1:] - seen[:-1])[:, None] * part
    luminance = glow(depths[:, None], angle.reshape(-1), droplets).reshape(len(depths), *angle.shape)
    return np.asarray((luminance * np.sin(angle)).sum(axis=2) / np.sin(angle).sum(axis=1))


def _edges(lines: list[str], name: str) -> NDArray[np.float64]:
    """Edges of bins, read from a comment of the table [rad]."""
    words = next(line for line in lines if line.startswith(f"# {name} ")).split()[2:]
    return np.radians([float(edge) for edge in words])


def mean_intensity(
    lobe: Beam, azimuth: NDArray[np.float64], elevation: NDArray[np.float64], droplets: Droplets
) -> NDArray[np.float64]:
    """Mean intensity of a lamp over the directions in which what is seen of its glow had left it.

    It is what the closed glow is to be multiplied by, and so also holds what photons give over that, 0.7 … 1.2.

    Returns Intensity [cd], over depths and angles of `light_origins` and the side of the lamp on which the line of
    sight passes, as the lamp sees it: right, right above, above …. Takes `azimuth`, `elevation` (n,) [rad].
    """
    origins = light_origins(droplets)
    edges, bins = origins.emitted, len(origins.emitted) - 1
    part = (np.arange(_HALVES) + 0.5) / _HALVES
    emitted = (edges[:-1, None] + (edges[1:] - edges[:-1])[:, None] * part).reshape(-1)
    # Light may have left on both sides of that on which the line of sight passes.
    turned = np.stack((origins.turned, -origins.turned), axis=1).reshape(-1)
    turn = (2.0 * math.pi * np.arange(SIDES)[:, None] / SIDES + turned).reshape(-1)
    # One direction at a time, as all of them together do not fit in a processor's cache.
    ways = zip(azimuth[:, None], elevation[:, None], strict=True)
    shone = np.concatenate([_shone_about(lobe, right, up, emitted, turn) for right, up in ways])
    weight = np.sin(emitted).reshape(bins, _HALVES)
    weight /= weight.sum(axis=1, keepdims=True)
    in_bins = np.einsum("nehamb,eh->neam", shone.reshape(len(shone), bins, _HALVES, SIDES, -1, 2), 0.5 * weight)
    mean = np.einsum("tgem,neam->ntga", origins.share, in_bins)
    return np.asarray(mean * origins.excess[..., None])


def _shone_about(
    lobe: Beam,
    azimuth: NDArray[np.float64],
    elevation: NDArray[np.float64],
    emitted: NDArray[np.float64],
    turn: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Intensity (n, emitted, turn) in directions at angles about those to the eye, turned from the right to above."""
    along, across = np.cos(emitted)[:, None], np.sin(emitted)[:, None] * np.cos(turn)
    rise = np.sin(emitted)[:, None] * np.sin(turn)
    cosine, sine = np.cos(elevation)[:, None, None], np.sin(elevation)[:, None, None]
    level, up = along * cosine - rise * sine, along * sine + rise * cosine
    right = np.arctan2(np.broadcast_to(across, level.shape), level) + azimuth[:, None, None]
    right -= 2.0 * math.pi * np.round(right / (2.0 * math.pi))
    return luminous_intensity(lobe, right, np.arcsin(np.clip(up, -1.0, 1.0)))


def lobe_glow(
    depth: float, angle: ArrayLike, lobe: Beam, eye: tuple[float, float], droplets: Droplets
) -> NDArray[np.float64]:
    """Luminance scattered about a lamp, times R² [cd].

    Returns by the side of the lamp on which the line of sight passes, like `mean_intensity`. Takes `angle` (n,) [rad],
    `eye` [rad].
    """
    origins, gamma = light_origins(droplets), np.asarray(angle, dtype=np.float64)
    mean = mean_intensity(lobe, np.array([eye[0]]), np.array([eye[1]]), droplets)[0]
    row = np.clip(np.interp(math.log(depth), origins.log_depth, np.arange(len(mean))), 0, len(mean) - 1.001)
    at_depth = mean[int(row)] * (1.0 - row % 1.0) + mean[int(row) + 1] * (row % 1.0)
    by_side = [np.interp(np.log(gamma), np.log(origins.angle), column) for column in at_depth.T]
    return np.asarray(glow(depth, gamma, droplets)[:, None] * np.stack(by_side, axis=1))


def table_directions() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Azimuths and elevations (AZIMUTHS, ELEVATIONS) to the eye at which tables describe a lamp's glow.

    Azimuths a lie evenly over a / (|a| + AZIMUTH_FOLD), from straight back to straight back, and elevations, too.
    """
    azimuth, elevation = np.meshgrid(
        _unfolded(AZIMUTHS, math.pi, AZIMUTH_FOLD), _unfolded(ELEVATIONS, 0.5 * math.pi, ELEVATION_FOLD), indexing="ij"
    )
    return azimuth, elevation


def _unfolded(count: int, end: float, fold: float) -> NDArray[np.float64]:
    folded = np.linspace(-1.0, 1.0, count) * end / (end + fold)
    return np.asarray(fold * folded / (1.0 - np.abs(folded)))
