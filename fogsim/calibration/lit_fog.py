"""Light of the own head lamps in fog and on the road, for draws of what a vehicle does not know about them."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.lamps.glow import glow
from fogsim.atmosphere.lamps.lamp_tables import lamp_table, phase_table
from fogsim.atmosphere.lamps.phase_function import Droplets, PhaseFunction, blurred, phase_function
from fogsim.atmosphere.lamps.road_glow import RoadGlow
from fogsim.atmosphere.lamps.veil import (
    FOLD_DISTANCE,
    INTERVALS,
    PHASE_SPREAD,
    SPREAD,
    LitAir,
    ScatteringPhase,
    VeilRays,
    add_scattered_light,
    integrate_veil,
    ray_pieces,
)
from fogsim.core.linear_algebra import matrix_product
from fogsim.estimators.night.own_light import SUB_ROWS, VISIBILITIES, Cells, OwnLight, cells_of
from fogsim.lighting import LampMount, own_head_lamps
from fogsim.units import extinction_from_visibility
from fogsim.values.camera import Camera
from fogsim.values.fog import FogField
from fogsim.values.light import Beam, HeadLamp, Lamp
from fogsim.values.luminous_intensity import luminous_intensity
from fogsim.values.pinhole import OWN_FRAME

Floats = NDArray[np.float64]
Watch = Callable[[int, int], None]

_DRAWS, _PATTERNS = 150, {True: 30, False: 150}
"""How many draws are made, and how many different beams are among them, by whether the beam is known."""

_PITCH_DEVIATION, _AIM_DEVIATION, _APART_DEVIATION = np.radians((0.1, 0.2, 0.1))
"""Standard deviations of the camera's pitch, of the aim of all lamps and of each lamp's own [rad]."""

_PATTERN_DEVIATION, _HEIGHT_DEVIATION = 0.15, 0.04
"""Standard deviations of ln of a known beam's intensity, over some degrees [-], and of the height of lamps [m]."""

_RETROREFLECTION, _AT = 0.015, 20.0
"""Luminance of dry asphalt over its illuminance across the beam [cd/m² per lx] (gallen2014), at this distance [m]."""

_EXPONENTS, _STARTS = (0.0, 1.1), (0.3, 2.0)
"""Powers of the distance by which that falls, and distances within which the bonnet hides the veil [m]."""

_LOSSES, _KEPT_FORWARD = (0.2, 0.4), (0.7, 1.0)
"""Parts of the extinction that spread light suffers (0.3 fits photons), and that light on its way to the road does."""

_CURVED, _CURVATURE_DEVIATION = 0.5, 2.5e-4
"""Share of the draws whose road curves upward or downward [-], and the standard deviation of that curvature [1/m]."""

_SPREAD_DEVIATION, _GLOW_DEVIATION = 0.3, 0.5
"""Standard deviations of ln of how much light is spread, and of how much the lit road returns into the fog [-]."""


class _Draw(NamedTuple):
    """One draw of the nuisances; angles [rad], lengths [m]."""

    pitch: float
    aims: Floats
    raised: float
    exponent: float
    start: float
    loss: float
    to_road: float
    spread: float
    glow: float
    curvature: float
    phase: ScatteringPhase


def lit_fog(
    camera: Camera,
    lamps: Lamp,
    setback: float,
    *,
    mount: LampMount | None = None,
    known: bool = True,
    watch: Watch | None = None,
) -> OwnLight:
    """Compute what a camera sees of own lamps; with ``known`` false the pattern of the low beam is drawn, too."""
    cells, rng = cells_of(camera), np.random.default_rng(47)
    where = mount or LampMount()
    lit = own_head_lamps(lamps, camera.mount_height, setback, where)
    veil = np.zeros((_DRAWS, len(VISIBILITIES), len(cells.box)), np.float32)
    road, depth = np.zeros_like(veil), np.zeros((_DRAWS, len(cells.box)), np.float32)
    returned, low_beam = _road_glow(camera, cells, lit), where.beams.get(Lamp.LOW_BEAM)
    shown: list[HeadLamp] = []
    # A Latin hypercube: of as many independent draws the posterior would depend by a seventh on chance.
    places = (rng.permuted(np.tile(np.arange(_DRAWS), (len(_Draw._fields) + 1, 1)), axis=1) + 0.5) / _DRAWS
    for number in range(_DRAWS):
        if number % (_DRAWS // _PATTERNS[known]) == 0:
            shown = _redrawn(lit, rng, None if known else low_beam)
        draw = _draw(rng, iter(places[:, number].tolist()), len(lit))
        veil[number], road[number], depth[number] = _light(camera, cells, shown, draw)
        veil[number] += draw.glow * returned
        if watch is not None:
            watch(number + 1, _DRAWS)
    return OwnLight(veil, road, depth)


def _draw(rng: np.random.Generator, place: Iterator[float], lamps: int) -> _Draw:
    """One draw, by its places (0 … 1) in the distributions of all but the lamps' own aims and the droplets."""

    def normal() -> float:
        return NormalDist().inv_cdf(next(place))

    def between(least: float, most: float) -> float:
        return least + (most - least) * next(place)

    kinds = [phase_function(kind) for kind in Droplets]
    share = rng.dirichlet(np.full(len(kinds), 0.5))
    value = sum(part * kind(kinds[0].angle) for part, kind in zip(share, kinds, strict=True))
    mixed = PhaseFunction(kinds[0].angle, np.asarray(value))
    phase = ScatteringPhase(phase_table(mixed), phase_table(blurred(mixed, PHASE_SPREAD)), SPREAD)
    return _Draw(
        pitch=_PITCH_DEVIATION * normal(),
        aims=_AIM_DEVIATION * np.array((normal(), normal())) + _APART_DEVIATION * rng.standard_normal((lamps, 2)),
        raised=_HEIGHT_DEVIATION * normal(),
        exponent=between(*_EXPONENTS),
        start=math.exp(between(*np.log(_STARTS).tolist())),
        loss=between(*_LOSSES),
        to_road=between(*_KEPT_FORWARD),
        spread=math.exp(_SPREAD_DEVIATION * normal()),
        glow=math.exp(_GLOW_DEVIATION * normal()),
        curvature=_CURVATURE_DEVIATION * normal() * (next(place) < _CURVED),
        phase=phase,
    )


def _redrawn(lit: Sequence[HeadLamp], rng: np.random.Generator, unknown: Beam | None) -> list[HeadLamp]:
    """The lamps with a beam that may be theirs; in place of the unknown one any low beam."""
    drawn: dict[Beam, Beam] = {}
    for lamp in lit:
        if lamp.beam not in drawn:
            drawn[lamp.beam] = _any_low_beam(rng) if lamp.beam is unknown else _changed(lamp.beam, rng)
    return [replace(lamp, beam=drawn[lamp.beam]) for lamp in lit]


def _changed(beam: Beam, rng: np.random.Generator) -> Beam:
    """A beam whose intensity is not quite that of the table, by some smooth waves of a few degrees."""
    right, up = np.meshgrid(beam.azimuth, beam.elevation)
    log = np.zeros(beam.intensity.shape)
    waves = 6
    for _ in range(waves):
        across, along = rng.normal(0.0, 1.0 / math.radians(6.0)), rng.normal(0.0, 1.0 / math.radians(2.5))
        log += math.sqrt(2.0 / waves) * np.cos(across * right + along * up + rng.uniform(0.0, 2.0 * math.pi))
    return Beam(beam.azimuth, beam.elevation, beam.intensity * np.exp(_PATTERN_DEVIATION * log))


def _any_low_beam(rng: np.random.Generator) -> Beam:
    """A low beam as cars have them: hot spot, foreground, cut-off that may rise to the right, and stray light."""
    azimuth = np.linspace(-40.0, 40.0, 81)
    elevation = np.unique(np.concatenate((np.arange(-20.0, 20.1, 1.0), np.arange(-3.0, 3.01, 0.1))))
    h, v = azimuth, elevation[:, None]
    aside, wide, deep = rng.normal(1.0, 1.0), rng.uniform(2.5, 6.0), rng.uniform(0.6, 2.2)
    foreground, wider = math.exp(rng.uniform(*np.log((0.03, 0.5)))), rng.uniform(10.0, 20.0)
    edge = rng.normal(-0.5, 0.12) + (rng.random() < 0.7) * np.clip(h * math.tan(math.radians(15.0)), 0.0, 1.0)
    sharpness = math.exp(rng.uniform(*np.log((0.08, 0.4))))
    stray = math.exp(rng.uniform(*np.log((0.002, 0.03))))
    spot = np.exp(-(np.abs((h - aside) / wide) ** 1.7) - (np.maximum(edge - 0.2 - v, 0.0) / deep) ** 1.6)
    near = foreground * np.exp(-((h / wider) ** 2) - (np.abs(v + 2.5) / 2.5) ** 1.5)
    below = 1.0 / (1.0 + np.exp(np.clip((v - edge) / sharpness, -50.0, 50.0)))
    above = stray * np.exp(-np.maximum(v, 0.0) / 4.5 - (np.abs(h) / 14.0) ** 1.2)
    return Beam(np.radians(azimuth), np.radians(elevation), 22_000.0 * ((spot + near) * below + above) + 1.0)


def _turned(pitch: float, yaw: float = 0.0) -> Floats:
    """Matrix that turns (forward, left, up) upward by `pitch` and to the right by `yaw`, small angles [rad]."""
    return np.array(((1.0, yaw, -pitch), (-yaw, 1.0, 0.0), (pitch, 0.0, 1.0)))


def _light(
    camera: Camera, cells: Cells, lit: Sequence[HeadLamp], draw: _Draw
) -> tuple[NDArray[np.float32], NDArray[np.float32], Floats]:
    """Veil and lit road of one draw (visibilities, cells), and the distance to the road (cells) [m]."""
    rays = matrix_product(cells.rays.reshape(-1, 3), _turned(draw.pitch).T)
    rays /= np.sqrt((rays**2).sum(axis=1, keepdims=True))
    is_sky = np.repeat(cells.is_sky, SUB_ROWS)
    reach = np.where(is_sky, np.inf, _reach(rays, camera.mount_height, draw.curvature))
    at, length = ray_pieces()
    length = np.where(at < draw.start, 0.0, length)
    shape = (len(rays), len(at))
    air = LitAir(*(np.zeros(shape, np.float32) for _ in range(3)))
    road, way = np.zeros(len(rays)), np.zeros(len(rays))
    for lamp, aim in zip(lit, draw.aims, strict=True):
        # A lamp that is aimed lower by an angle lights what it would otherwise light that much higher.
        back = _turned(-float(aim[0]), -float(aim[1]))
        offset = np.array(lamp.offset) + np.array((0.0, 0.0, draw.raised))
        turned = np.ascontiguousarray(matrix_product(rays, back.T), dtype=np.float32)
        seen = VeilRays((1, len(rays)), turned, at, length)
        moved = matrix_product(back, offset[:, None])[:, 0]
        add_scattered_light(seen, np.ascontiguousarray(moved), lamp_table(lamp.beam), draw.phase, air)
        lights, away = _lit_road(rays, reach, offset, back, lamp.beam, draw.exponent)
        road += lights
        way += away / len(lit)
    air.path[:] = air.path / np.maximum(air.straight + air.turned, np.float32(1e-30)) + at.astype(np.float32)
    air.turned[:] *= np.float32(draw.spread)
    extinctions = [extinction_from_visibility(one) for one in VISIBILITIES.tolist()]
    veils = np.array([_veil_up_to(air, extinction, reach, draw.loss) for extinction in extinctions])
    ways = draw.to_road * way + np.where(is_sky, 0.0, reach)
    roads = road * np.exp(-np.array(extinctions)[:, None] * ways)
    veil, lit_road = (one.reshape(len(extinctions), -1, SUB_ROWS).mean(axis=2) for one in (veils, roads))
    depth = 1.0 / np.maximum((1.0 / reach).reshape(-1, SUB_ROWS).mean(axis=1), 1e-9)
    return veil.astype(np.float32), lit_road.astype(np.float32), depth


def _reach(rays: Floats, height: float, curvature: float) -> Floats:
    """Distance along rays to a road that curves upward [m]; inf beyond the crest of one that curves downward."""
    down = np.maximum(-rays[:, 2], 1e-3)
    square = down**2 + 2.0 * height * curvature * (1.0 - rays[:, 2] ** 2)
    return np.where(square < 0.0, np.inf, 2.0 * height / (down + np.sqrt(np.maximum(square, 0.0))))


def _lit_road(
    rays: Floats, reach: Floats, offset: Floats, back: Floats, beam: Beam, exponent: float
) -> tuple[Floats, Floats]:
    """Luminance of the road that a lamp lights, in clear air [cd/m²], and the distance from the lamp [m]."""
    on_road = np.isfinite(reach)
    there = matrix_product(rays[on_road] * reach[on_road, None] - offset, back.T)
    away = np.sqrt((there**2).sum(axis=1))
    intensity = luminous_intensity(beam, np.arctan2(-there[:, 1], there[:, 0]), np.arcsin(there[:, 2] / away))
    lights, distance = np.zeros(len(rays)), np.zeros(len(rays))
    lights[on_road] = _RETROREFLECTION * intensity / away**2 * (_AT / away) ** exponent
    distance[on_road] = away
    return lights, distance


def _veil_up_to(air: LitAir, extinction: float, reach: Floats, loss: float) -> Floats:
    """Veil before the road or the sky [cd/m²]."""
    veil = np.empty((len(reach), INTERVALS + 1), np.float32)
    k = np.full((1, 1), extinction, np.float32)
    integrate_veil(air, k, k, np.float32(loss), veil)
    folded = np.where(np.isfinite(reach), 1.0 / (1.0 + FOLD_DISTANCE / reach), 1.0) * INTERVALS
    low = np.minimum(folded.astype(np.int64), INTERVALS - 1)
    rows, part = np.arange(len(reach)), folded - low
    before, after = veil[rows, low], veil[rows, low + 1]
    return np.asarray(before + (after - before) * part)


def _road_glow(camera: Camera, cells: Cells, lit: tuple[HeadLamp, ...]) -> NDArray[np.float32]:
    """Light that the lit road returns and the fog scatters to the eye (visibilities, cells) [cd/m²]."""
    rays = cells.rays[:, SUB_ROWS // 2]
    reach = np.where(cells.is_sky, np.inf, camera.mount_height / np.maximum(-rays[:, 2], 1e-3))
    pose, patches = OWN_FRAME, RoadGlow()
    found = np.zeros((len(VISIBILITIES), len(rays)))
    for row, visibility in enumerate(VISIBILITIES.tolist()):
        extinction = extinction_from_visibility(visibility)
        sources = patches.sources(lit, camera, pose, FogField(extinction, (0.0, 0.0, 0.0)))
        away = np.sqrt((sources.position**2).sum(axis=1))
        cosine = (rays[:, None] * sources.position).sum(axis=2) / away
        # Pieces of road are wide: before its middle each glows no more than at its edge.
        angle = np.maximum(np.arccos(np.clip(cosine, -1.0, 1.0)), np.sqrt(sources.area / math.pi) / away)
        depth = extinction * away
        # What droplets send to the eye has left the road in all directions, not toward the eye alone.
        upward = sources.intensity / np.maximum(-sources.position[:, 2] / away, 0.01)
        bright = upward * np.maximum(-sources.position[:, 2] / away, 0.3) / away**2
        shone = np.stack([glow(one, angle[:, i], Droplets.MODERATE_RADIATION) for i, one in enumerate(depth)], axis=1)
        found[row] = (bright * shone * np.minimum(1.0, reach[:, None] / away)).sum(axis=1)
    return found.astype(np.float32)
