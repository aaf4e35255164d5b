"""Night images whose veil and road come from photons: other lamps, droplets, roads and cameras than the model's.

Nothing of `fogsim.atmosphere` but the tables of phase functions, and nothing of `fogsim.lighting`. The veil is single
scattering by quadrature times the ratio of all light to light scattered once, by photons along some rays, smoothed.
The road is lit by photons from the lamps and seen along photons' paths from the eye; what it returns lights the sky.
"""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from monte_carlo import FOGS, phase_table
from numba import njit
from photon_paths import LAMP_SIZES, STEP, likely_cosines, scattered_back, turned, veil, without_peak

from fogsim.atmosphere.lamps.phase_function import henyey_greenstein
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera
from fogsim.values.camera import Response
from fogsim.values.camera_response import respond
from fogsim.values.light import Beam

CAMERAS = (
    Camera(640, 480, 577.3, (319.5, 239.5), 1.38, pitch=0.035, response=Response.SRGB),
    Camera(640, 480, 720.0, (316.0, 232.0), 1.25, pitch=0.02, response=Response.SRGB),
)
SETBACK = 1.8
ELEVATIONS = np.array([14.0, 8.0, 4.0, 2.0, 0.7, -0.7, -2.0, -4.0, -8.0, -12.0])
AZIMUTHS = np.array([0.0, 10.0, 20.0])
"""Where photons' paths begin [degrees]."""

PATHS = 4000
LAMP_HEIGHT, HALF_SPACING = 0.65, 0.6
PHASES = (*FOGS, "two lobes, radiation", "two lobes, advection")
LOBES = {"two lobes, radiation": (0.972, 0.915, -0.564), "two lobes, advection": (0.978, 0.930, -0.522)}
BEAMS = ("halogen", "projector", "regulation", "fitted")
# Measured points of a low beam, FMVSS test report 108-CAN-17-004 (degrees right, up; candela).
HALOGEN = np.array(
    [
        (0, 0, 5384), (-8, 4, 121), (-4, 2, 249), (2, 1.5, 368), (-1.7, 0.5, 1130), (2.9, 0.5, 476), (1, 0.5, 590),
        (-8, 0, 1998), (-4, 0, 3209), (1.3, -0.6, 21004), (-3.5, -0.9, 10314), (0, -0.9, 30683), (2, -1.5, 32467),
        (9, -2, 7206), (-9, -2, 4299), (15, -2, 5632), (-15, -2, 2407), (-20, -4, 2166), (0, -4, 4736), (4, -4, 4493),
        (20, -4, 1043), (0.3, -1.2, 36917),
    ]
)  # fmt: skip
# Taper of a good low beam below its cut-off (isetauto, "Generic Headlamp Light Distribution").
TAPER = np.array(
    [(0, 30000), (-0.5, 60000), (-1, 33000), (-1.5, 19800), (-2, 12600), (-2.5, 8460), (-3.5, 4500), (-4.5, 2730),
     (-5.5, 1800), (-7.5, 930), (-9.5, 570), (-14, 300), (-30, 100)]
)  # fmt: skip


@dataclass(frozen=True)
class Night:
    """What was drawn for an image."""

    visibility: float
    camera: Camera
    beam: str
    illuminance: float
    image: np.ndarray


def beam_named(name: str) -> Beam:
    """Low beam of one lamp, as a vehicle would know it."""
    right = np.unique(np.concatenate((np.arange(-60.0, 61.0, 3.0), np.arange(-10.0, 10.1, 0.5))))
    up = np.unique(np.concatenate((np.arange(-30.0, 31.0, 2.0), np.arange(-6.0, 4.01, 0.1))))
    h, v = right, up[:, None]
    return Beam(np.radians(right), np.radians(up), _intensity(name, h, v))


def _intensity(name, h, v):
    h, v = np.broadcast_arrays(h, v)
    if name == "halogen":
        apart = ((h[..., None] - HALOGEN[:, 0]) / 3.0) ** 2 + ((v[..., None] - HALOGEN[:, 1]) / 0.9) ** 2
        weight = 1.0 / (0.02 + apart) ** 1.6
        inside = np.exp((weight * np.log(HALOGEN[:, 2])).sum(axis=-1) / weight.sum(axis=-1))
        beyond = np.hypot(np.maximum(np.abs(h) - 18.0, 0.0), np.maximum(np.maximum(v - 3.0, -4.0 - v), 0.0))
        return inside * 10.0 ** (-0.07 * beyond)
    if name == "fitted":
        # A fit to the median US low beam (UMTRI-2004-23): ../shared/physics.md, section 2.4.
        spot = 26965.0 * np.exp(
            -((np.abs(h - 1.982) / 3.046) ** 1.837) - (np.maximum(-0.279 - v, 0.0) / 1.656) ** 1.844
        )
        near = 7683.0 * np.exp(-((h / 14.82) ** 2) - (np.abs(v + 2.5) / 2.45) ** 1.5)
        below = 1.0 / (1.0 + np.exp(np.clip((v + 0.279) / 0.31, -50, 50)))
        return (spot + near) * below + 601.0 * np.exp(-np.maximum(v, 0.0) / 4.486 - (np.abs(h) / 14.0) ** 1.2) + 1.0
    edge = -0.57 + np.clip(h * math.tan(math.radians(15.0)), 0.0, 1.2)
    if name == "projector":
        below = np.exp(np.interp(edge - v, -TAPER[:, 0], np.log(TAPER[:, 1])))
        lit = 1.0 / (1.0 + np.exp(np.clip((v - edge) / 0.05, -50, 50)))
        return 0.6 * below * np.exp(-((np.abs(h - 0.5) / 9.0) ** 1.3)) * lit + 120.0 * np.exp(-np.abs(v) / 6.0) + 5.0
    lit = 1.0 / (1.0 + np.exp(np.clip((v + 0.57) / 0.2, -50, 50)))
    spot = 15000.0 * np.exp(-(((h - 2.0) / 4.5) ** 2) - np.maximum(-0.6 - v, 0.0) / 1.3)
    wide = 5200.0 * np.exp(-((h / 22.0) ** 2) - np.abs(v + 2.4) / 2.6)
    return (spot + wide) * lit + 450.0 * np.exp(-np.maximum(v, 0.0) / 2.0 - (h / 18.0) ** 2) + 10.0


def phase_named(name):
    """Phase function on the grid of `photon_paths`."""
    if name in FOGS:
        return phase_table(name)
    share, forward, back = LOBES[name]
    angle = np.arange(0.0, math.pi + STEP, STEP)
    return share * henyey_greenstein(angle, forward) + (1.0 - share) * henyey_greenstein(angle, back)


@njit
def _single(rays, reach, k, phase, beam, lamps, start):
    out = np.zeros(len(rays))
    steps = 160
    for i in range(len(rays)):
        end = min(reach[i], 300.0)
        span = math.log(end / start) if end > start else 0.0
        for n in range(steps):
            r = start * math.exp(span * (n + 0.5) / steps)
            x, y, z = r * rays[i, 0], r * rays[i, 1], r * rays[i, 2]
            back = scattered_back(x, y, z, rays[i, 0], rays[i, 1], rays[i, 2], k, phase, STEP, beam, lamps, 0.06)
            out[i] += k * math.exp(-k * r) * back * r * span / steps
    return out


@njit
def _photons_on_road(photons, rng, k, cosines, cumulative, shape, lamps, ground, edges):
    """Photons of the lamps that fall on the road ahead, by distance: all, and those that were not scattered."""
    total, direct = np.zeros(len(edges) - 1), np.zeros(len(edges) - 1)
    for n in range(photons):
        cell = np.searchsorted(cumulative, rng.random() * cumulative[-1])
        v = ((cell // shape[1]) + rng.random()) / shape[0] * math.pi - 0.5 * math.pi
        h = ((cell % shape[1]) + rng.random()) / shape[1] * math.pi - 0.5 * math.pi
        x, y, z = lamps[n % len(lamps)]
        dx, dy, dz = math.cos(v) * math.cos(h), -math.cos(v) * math.sin(h), math.sin(v)
        for flight in range(30):
            length = -math.log(1.0 - rng.random()) / k
            if z + length * dz < ground:
                t = (ground - z) / dz
                b = np.searchsorted(edges, x + t * dx) - 1
                if abs(y + t * dy) < 2.5 and 0 <= b < len(total):
                    total[b] += 1.0
                    direct[b] += 1.0 if flight == 0 else 0.0
                break
            x, y, z = x + length * dx, y + length * dy, z + length * dz
            dx, dy, dz = turned(dx, dy, dz, cosines[int(rng.random() * len(cosines))], 2 * math.pi * rng.random())
    return total, direct


@njit
def _direct_road(x, y, k, beam, lamps, ground, exponent):
    """Luminance of the road by unscattered light, for an asphalt of 15 mcd/(lx m²) at 20 m."""
    total = 0.0
    for i in range(len(lamps)):
        lx, ly, lz = x - lamps[i, 0], y - lamps[i, 1], ground - lamps[i, 2]
        if lx <= 0.5:
            continue
        square = lx * lx + ly * ly + lz * lz
        s = math.sqrt(square)
        h = (math.atan2(-ly, lx) / math.pi + 0.5) * (beam.shape[1] - 1)
        v = (math.asin(lz / s) / math.pi + 0.5) * (beam.shape[0] - 1)
        total += 0.015 * (20.0 / s) ** exponent * beam[int(v + 0.5), int(h + 0.5)] / square * math.exp(-k * s)
    return total


@njit
def _scattered_road(paths, rng, ray, end, k, cosines, beam, lamps, ground, exponent, edges, ratio):
    """Light of the lit road that reaches the eye by scattering [cd/m²]; every path is scattered at least once."""
    total = 0.0
    near = 0.3
    span = math.log(end / near)
    for _ in range(paths):
        r = near * math.exp(span * rng.random())
        weight = k * math.exp(-k * r) * r * span
        x, y, z = r * ray[0], r * ray[1], r * ray[2]
        dx, dy, dz = ray
        for _ in range(20):
            dx, dy, dz = turned(dx, dy, dz, cosines[int(rng.random() * len(cosines))], 2 * math.pi * rng.random())
            length = -math.log(1.0 - rng.random()) / k
            if dz < 0.0 and z + length * dz < ground:
                t = (ground - z) / dz
                px, py = x + t * dx, y + t * dy
                b = min(max(np.searchsorted(edges, px) - 1, 0), len(ratio) - 1)
                away = math.sqrt(px * px + py * py + ground * ground)
                # Asphalt sends light back toward the lamps, and otherwise about alike in all directions.
                cosine = (px * dx + py * dy + ground * dz) / away
                back = math.exp(-((math.acos(min(1.0, max(-1.0, cosine))) / 0.15) ** 2))
                lit = min(_direct_road(px, py, k, beam, lamps, ground, exponent), 20.0) * ratio[b]
                total += weight * lit * max(back, min(0.14 * 0.65 / max(px - lamps[0, 0], 0.65) * 15.0, 1.0) * 0.3)
                break
            x, y, z = x + length * dx, y + length * dy, z + length * dz
            if k * math.sqrt(x * x + y * y + z * z) > 20.0:
                break
    return total / paths


@njit
def _road_of(rays, reach, k, beam, lamps, ground, exponent):
    out = np.zeros(len(rays))
    for i in range(len(rays)):
        if reach[i] < 1e5:
            x, y = reach[i] * rays[i, 0], reach[i] * rays[i, 1]
            out[i] = _direct_road(x, y, k, beam, lamps, ground, exponent)
    return out


def _smooth(values, rays):
    """Cubic polynomial in elevation and azimuth through ln of values at `ELEVATIONS` and `AZIMUTHS`."""
    powers = [(i, j) for i in range(4) for j in (0, 2) if i + j < 4]
    at = np.tile(ELEVATIONS, len(AZIMUTHS)) / 10.0, np.repeat(AZIMUTHS, len(ELEVATIONS)) / 20.0
    up, aside = np.degrees(np.arcsin(rays[:, 2])), np.abs(np.degrees(np.arctan2(rays[:, 1], rays[:, 0])))
    where = np.clip(up, -13.0, 15.0) / 10.0, np.minimum(aside, 25.0) / 20.0
    found = np.linalg.lstsq(np.stack([at[0] ** i * at[1] ** j for i, j in powers], axis=1), np.log(values), rcond=None)[
        0
    ]
    return np.exp(sum(f * where[0] ** i * where[1] ** j for f, (i, j) in zip(found, powers, strict=True)))


def _fine_rays(camera, pitch, step):
    rows, cols = (
        np.arange(0, camera.height, step) + 0.5 * (step - 1),
        np.arange(0, camera.width, step) + 0.5 * (step - 1),
    )
    across = (cols - camera.principal_point[0]) / camera.focal_length
    down = (rows[:, None] - camera.principal_point[1]) / camera.focal_length
    cosine, sine = math.cos(pitch), math.sin(pitch)
    ahead, left, up = np.broadcast_arrays(cosine - down * sine, -across, -down * cosine - sine)
    rays = np.stack((ahead, left, up), axis=-1).reshape(-1, 3)
    return rays / np.linalg.norm(rays, axis=1)[:, None], (len(rows), len(cols))


@cache
def _table(beam):
    grid = np.linspace(-90.0, 90.0, 1441)
    return np.maximum(_intensity(beam, grid, grid[:, None]), 1.0)


def _aimed(beam, up, right):
    """Intensity in steps of 1/8 degree over the half-space ahead, of a lamp whose aim is off by some degrees [cd]."""
    table = _table(beam)
    for axis, angle in enumerate((up, right)):
        whole = math.floor(8.0 * angle)
        part = 8.0 * angle - whole
        table = (1.0 - part) * np.roll(table, whole, axis) + part * np.roll(table, whole + 1, axis)
    return table


def _look(up, right):
    up, right = math.radians(up), math.radians(right)
    return np.array([math.cos(up) * math.cos(right), -math.cos(up) * math.sin(right), math.sin(up)])


def radiance(camera, visibility, beam, phase, rng, *, exponent, start, pitch, aim, level):
    """Veil (rows, cols) and road without texture (rows, cols) [cd/m²] in every second pixel, and where it is [m]."""
    rays, shape = _fine_rays(camera, pitch, 2)
    ground, k = -camera.mount_height, max(extinction_from_visibility(visibility), 1e-6)
    lamps = np.array([[SETBACK, side * HALF_SPACING, LAMP_HEIGHT + ground] for side in (1, -1)])
    lit = level * _aimed(beam, *aim), lamps, ground
    reach = _reach(rays, ground)
    road = _road_of(rays, reach, k, *lit, exponent) * np.exp(-k * np.minimum(reach, 1e5))
    if not math.isfinite(visibility):
        return np.zeros(shape), road.reshape(shape), (rays, reach, k)
    cosines = likely_cosines(phase)
    edges = np.geomspace(3.0, 150.0, 12)
    line = _forward_light(rng, k, cosines, lit, edges)
    road *= np.exp(np.maximum(np.polyval(line, np.log(np.clip(reach * rays[:, 0], 3.0, 150.0))), 0.0))
    ratio = np.exp(np.maximum(np.polyval(line, np.log(np.sqrt(edges[1:] * edges[:-1]))), 0.0))
    looks = [_look(up, right) for right in AZIMUTHS for up in ELEVATIONS]
    ends = [min(ground / ray[2] if ray[2] < 0 else 400.0, 400.0) for ray in looks]
    phases, every, returned = np.stack((phase, without_peak(phase))), [], []
    for ray, end in zip(looks, ends, strict=True):
        once, _, all_of_it, _ = veil(PATHS, rng, k, ray, end, phases, cosines, STEP, *lit, LAMP_SIZES)
        every.append(max(all_of_it / max(once, 1e-12), 1.0))
        returned.append(max(_scattered_road(PATHS, rng, ray, end, k, cosines, *lit, exponent, edges, ratio), 1e-9))
    # The veil on a coarser grid: it is smooth.
    coarse, small = _fine_rays(camera, pitch, 8)
    single = _single(coarse, _reach(coarse, ground), k, phase, *lit[:2], start)
    veil_map = single * np.maximum(_smooth(every, coarse), 1.0) + _smooth(returned, coarse)
    return _enlarged(veil_map.reshape(small), shape), road.reshape(shape), (rays, reach, k)


def _reach(rays, ground):
    return np.where(rays[:, 2] < -1e-4, ground / np.minimum(rays[:, 2], -1e-4), 1e6)


def _forward_light(rng, k, cosines, lit, edges):
    """Line in ln of the distance through ln of all light on the road over that which was not scattered."""
    table, lamps, ground = lit
    weight = (table * np.cos(np.linspace(-math.pi / 2, math.pi / 2, len(table)))[:, None]).ravel()
    shape = np.array(table.shape)
    total, direct = _photons_on_road(60_000, rng, k, cosines, np.cumsum(weight), shape, lamps, ground, edges)
    good, middle = direct > 30, np.sqrt(edges[1:] * edges[:-1])
    if good.sum() < 3:
        return np.zeros(2)
    return np.polyfit(np.log(middle[good]), np.log(total[good] / direct[good]), 1)


def _enlarged(small, shape):
    """A map of every eighth pixel as one of every second, linear in the logarithm."""
    rows, cols = (
        np.clip((2.0 * np.arange(n) - 3.0) / 8.0, 0.0, m - 1.001) for n, m in zip(shape, small.shape, strict=True)
    )
    i, j = rows.astype(int), cols.astype(int)
    down, right, log = (rows - i)[:, None], cols - j, np.log(np.maximum(small, 1e-12))
    tall = [log[i][:, n] * (1.0 - down) + log[i + 1][:, n] * down for n in (j, j + 1)]
    return np.exp(tall[0] * (1.0 - right) + tall[1] * right)


def photograph(night_radiance, camera, rng, illuminance=0.0):
    """An image (rows, cols, 3) uint8 with pavement texture, marks, daylight, glare, noise and a dark offset."""
    veil_map, road, (rays, reach, k) = night_radiance
    shape = veil_map.shape
    ahead, left = (reach * rays[:, 0]).reshape(shape), (reach * rays[:, 1]).reshape(shape)
    on_road = reach.reshape(shape) < 1e5
    along, across = (
        np.floor(np.clip(part, -300, 1000) / size).astype(int) for part, size in ((ahead, 1.5), (left, 0.7))
    )
    patch = rng.standard_normal(4096)[(along * 31 + across * 17) % 4096]
    texture = np.exp(0.1 * patch + 0.05 * rng.standard_normal(shape))
    dashed = (np.abs(np.abs(left) - 1.75) < 0.07) & ((left < 0) | ((ahead + rng.uniform(0, 12)) % 12 < 4))
    texture = np.where(dashed, rng.uniform(2.0, 5.0), texture)
    verge = np.where(np.abs(left) > rng.uniform(3.5, 6.0), rng.uniform(0.5, 2.0), 1.0)
    light = veil_map + road * np.where(on_road, texture * verge, 0.0) * rng.uniform(0.7, 1.3)
    if illuminance > 0.0:
        air = rng.uniform(0.5, 1.0) * illuminance / math.pi
        clear = np.exp(-k * np.where(on_road, reach.reshape(shape), np.inf))
        upward = np.arcsin(rays[:, 2]).reshape(shape)
        brighter = 1.0 + rng.uniform(-0.2, 0.6) * np.clip(upward / 0.3, 0.0, 1.5)
        light = light + air * (1.0 - clear) * np.where(on_road, 1.0, brighter)
        light = light + rng.uniform(0.06, 0.2) * illuminance / math.pi * clear * np.where(on_road, texture, 0.0)
    saturation = np.quantile(light, 0.995) / 0.8 * rng.uniform(0.7, 1.6)
    share = light / saturation
    share = share + 0.004 * share.mean() + 4e-4 * abs(rng.standard_normal())
    share = share.repeat(2, axis=0).repeat(2, axis=1)[: camera.height, : camera.width]
    electrons = 1500.0
    noisy = rng.poisson(electrons * np.clip(share, 0, 3)) / electrons + 3.0 / electrons * rng.standard_normal(
        share.shape
    )
    value = np.round(255 * respond(np.clip(noisy, 0.0, 1.0), camera.response, camera.black_level)).astype(np.uint8)
    return np.repeat(value[:, :, None], 3, axis=2)


def drawn_nights(pool, count, visibilities, lux=(0.0,)):
    """Images of nights: for each visibility so many radiances, each photographed at every illuminance [lx]."""
    for number, visibility in enumerate(visibilities):
        for index in range(count):
            rng = np.random.default_rng((pool, number, index, 47))
            # The last beam is kept for pools from which no constants are chosen.
            beams = BEAMS if pool else BEAMS[:-1]
            camera, beam = CAMERAS[index % len(CAMERAS)], beams[index // 2 % len(beams)]
            phase = PHASES[int(rng.integers(len(PHASES)))]
            seen = radiance(
                camera,
                visibility,
                beam,
                phase_named(phase),
                rng,
                exponent=rng.uniform(0.5, 1.0),
                start=(0.3, 1.5)[int(rng.integers(2))],
                pitch=camera.pitch + math.radians(0.1) * rng.standard_normal(),
                aim=tuple(0.2 * rng.standard_normal(2)),
                level=rng.uniform(0.7, 1.3),
            )
            for illuminance in lux:
                yield Night(visibility, camera, beam, illuminance, photograph(seen, camera, rng, illuminance))
