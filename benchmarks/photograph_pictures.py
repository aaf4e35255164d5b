"""Roads as photographs have them, drawn for `photograph_roads.py`: as little like FogSim's own as one can draw them.

What is drawn is a clear photograph of a flat open road: asphalt that brightens towards the horizon, tyre tracks,
joints, repairs, stains, sun and shade, verge and woods, a sky with clouds; then an exposure, a tone curve that is no
sRGB, gains that differ by channel, noise and JPEG. Fog is laid on it by the functions of `fogsim fog --road-plane`.
"""

import math
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "pictures"))

from windscreen import hash_noise, rays

from fogsim.offline.camera_file import Calibration
from fogsim.offline.fog_image import BRIGHTEST_ABOVE_ROAD, airlight_of, fog_image
from fogsim.offline.rectification import RoadPlane
from fogsim.values import Camera, Response

Floats = NDArray[np.float64]
Image = NDArray[np.uint8]

CAMERAS = (
    (
        Camera(640, 480, 620.0, (319.5, 239.5), 1.35, math.radians(2.0), response=Response.SRGB),
        Camera(800, 450, 900.0, (399.5, 224.5), 1.5, math.radians(1.0), response=Response.SRGB),
        Camera(640, 360, 480.0, (319.5, 179.5), 1.25, math.radians(0.5), response=Response.SRGB),
    ),
    (
        Camera(640, 480, 760.0, (319.5, 239.5), 1.45, math.radians(1.5), response=Response.SRGB),
        Camera(768, 432, 700.0, (383.5, 215.5), 1.3, math.radians(0.8), response=Response.SRGB),
        Camera(720, 480, 560.0, (359.5, 239.5), 1.6, math.radians(2.5), response=Response.SRGB),
    ),
)
"""Of pool 0 and of pool 1."""

PITCH_DEVIATION = 0.1  # of the true pitch about the told one [deg]
OVER = 2  # rays across a pixel


@dataclass(frozen=True)
class Photograph:
    """A clear photograph: pixels (red first), the camera that took it, the stated one, and whether by sun."""

    image: Image
    taken_by: Camera
    told: Camera
    is_sunny: bool
    light: Floats

    def fogged(self, visibilities: tuple[float, ...]) -> list[Image]:
        """Lay even fog on it, as `fogsim fog --road-plane` does."""
        distance = RoadPlane(Calibration(self.taken_by)).distance()
        air = airlight_of(self.image, distance, BRIGHTEST_ABOVE_ROAD)
        laid = [fog_image(self.image, distance, one, self.taken_by, air) for one in visibilities]
        return [one.astype(np.uint8, copy=False) for one in laid]


def photograph(pool: int, number: int) -> Photograph:
    """One photograph of a pool, always the same."""
    rng = np.random.default_rng([20, pool, number])
    told = CAMERAS[pool][number % len(CAMERAS[pool])]
    camera = replace(told, pitch=told.pitch + math.radians(rng.normal(0.0, PITCH_DEVIATION)))
    forward, down, right = rays(camera, OVER)
    road = down > 1e-6
    depth = np.where(road, camera.mount_height / np.where(road, down, 1.0), 0.0)
    ahead, across = (depth * forward)[road], (depth * right)[road]
    sine = (down / np.sqrt(forward**2 + down**2 + right**2))[road]
    light = np.empty((*down.shape, 3))
    light[~road] = _sky(-down[~road], (right / forward * np.ones_like(down))[~road], rng)
    light[road], is_sunny = _ground(ahead, across, sine, rng)
    mean = light.reshape(camera.height, OVER, camera.width, OVER, 3).mean(axis=(1, 3))
    return Photograph(_developed(mean, rng), camera, told, is_sunny, mean)


def _noise(ahead: Floats, across: Floats, sides: tuple[float, float], rng: np.random.Generator) -> Floats:
    """Smooth noise of unit deviation in squares of so many metres along and across."""
    return np.asarray(hash_noise(ahead / sides[0] + 900.0, across / sides[1] + 900.0, int(rng.integers(1, 9000))))


def _ground(ahead: Floats, across: Floats, sine: Floats, rng: np.random.Generator) -> tuple[Floats, bool]:
    """Light (n, 3) of the ground under a sky of luminance 1, by the sine of the eye's elevation; whether in sun."""
    lane, aside = float(rng.uniform(2.9, 3.75)), float(rng.normal(0.0, 0.3))
    half_road = float(rng.choice([1.0, 1.0, 1.5])) * lane + float(rng.uniform(0.1, 2.0))
    side = across + aside + float(rng.choice([0.0, 0.5])) * lane
    asphalt = float(np.exp(rng.uniform(math.log(0.06), math.log(0.2)))) * (1.0 + rng.normal(0.0, 0.04, 3))
    road = _texture(ahead, side, lane, rng) * _works(ahead, side, lane, rng) * _brightening(sine, rng)
    out = asphalt * road[:, None]
    verge = np.array([0.07, 0.085, 0.04]) * float(rng.uniform(0.6, 2.2))
    beyond = np.abs(side) > half_road
    grass = 1.0 + 0.25 * _noise(ahead, side, (1.3, 0.6), rng) + 0.15 * _noise(ahead, side, (9.0, 3.0), rng)
    out[beyond] = verge * np.clip(grass[beyond], 0.2, None)[:, None]
    out[np.abs(side) > half_road + float(rng.uniform(3.0, 30.0))] = np.array([0.03, 0.035, 0.02])
    if rng.random() < 0.85:
        out = _marked(out, ahead, side, (lane, half_road), rng)
    is_sunny = rng.random() >= 0.5
    return out * (_sunlight(ahead, side, half_road, rng) if is_sunny else 1.0), is_sunny


def _brightening(sine: Floats, rng: np.random.Generator) -> Floats:
    """Growth of the reflectance towards grazing angles, 1 for an eye above.

    CIE's standard surfaces R1 … R4 (CIE 144:2001) have about 1.35, 1.8, 2.1 and 2.1 at 1° by the fit of
    `tools/make_road_reflectance.py`; a low sun makes it more, a sun behind the camera less.
    """
    return 1.0 + float(rng.uniform(0.0, 1.5)) / (1.0 + sine / float(rng.uniform(0.08, 0.25)))


def _texture(ahead: Floats, side: Floats, lane: float, rng: np.random.Generator) -> Floats:
    """Grain, mottling, long waves along the road, tyre tracks and the oil between them."""
    total = np.ones(ahead.shape)
    for sides, most in (((0.25, 0.12), 0.08), ((1.6, 0.8), 0.05), ((8.0, 2.5), 0.06), ((45.0, 9.0), 0.08)):
        total += float(rng.uniform(0.01, most)) * _noise(ahead, side, sides, rng)
    from_middle = np.abs((side / lane + 0.5) % 1.0 - 0.5) * lane
    track, width = float(rng.uniform(0.65, 0.85)), float(rng.uniform(0.2, 0.4))
    worn = float(rng.uniform(-0.15, 0.15)) * (1.0 + 0.3 * _noise(ahead, side, (20.0, 6.0), rng))
    oil = float(rng.uniform(0.0, 0.12))
    tracks = worn * np.exp(-(((from_middle - track) / width) ** 2)) - oil * np.exp(-((from_middle / 0.35) ** 2))
    return np.clip(total + tracks, 0.3, None)


def _works(ahead: Floats, side: Floats, lane: float, rng: np.random.Generator) -> Floats:
    """Joints, repairs, cracks and stains."""
    out = np.ones(ahead.shape)
    if rng.random() < 0.3:
        gap, width = float(rng.uniform(4.0, 15.0)), float(rng.uniform(0.02, 0.08))
        out[((ahead + 3.0) % gap) < width] *= float(rng.uniform(0.4, 0.9))
    seam = np.abs(side / lane - np.rint(side / lane + 0.5) + 0.5) * lane
    out[seam < 0.03] *= float(rng.uniform(0.6, 1.0))
    for _ in range(rng.poisson(3.0)):
        start, length = float(rng.uniform(4.0, 120.0)), float(np.exp(rng.uniform(math.log(1.0), math.log(60.0))))
        left = float(rng.uniform(-1.5, 1.0)) * lane
        inside = (np.abs(ahead - start - length / 2) < length / 2) & (side > left)
        out[inside & (side < left + float(rng.uniform(0.4, 1.2)) * lane)] *= float(rng.uniform(0.7, 1.25))
    if rng.random() < 0.5:
        crack = np.abs(side - 0.6 * _noise(ahead, np.zeros_like(side), (3.0, 1.0), rng) - float(rng.uniform(-2, 2)))
        out[crack < 0.025] *= 0.55
    stains = _noise(ahead, side, (2.2, 1.1), rng)
    return np.where(stains > float(rng.uniform(1.6, 2.6)), out * float(rng.uniform(0.7, 0.95)), out)


def _marked(out: Floats, ahead: Floats, side: Floats, road: tuple[float, float], rng: np.random.Generator) -> Floats:
    """Paint, worn in places."""
    lane, half_road = road
    dash, period = ((3.0, 9.0), (3.0, 12.0), (6.0, 18.0), (3.0, 4.3))[int(rng.integers(4))]
    width = float(rng.choice([0.1, 0.12, 0.15, 0.2]))
    border = np.abs(side / lane - np.rint(side / lane - 0.5) - 0.5) * lane
    dashed = (border < width / 2) & (np.abs(side) < half_road)
    dashed &= ((ahead + float(rng.uniform(0.0, period))) % period) < dash
    solid = (np.abs(np.abs(side) - half_road + 0.25) < width / 2) & (rng.random() < 0.7)
    worn = np.clip(0.8 + 0.25 * _noise(ahead, side, (0.5, 0.1), rng), 0.2, 1.0)[:, None]
    paint = float(rng.uniform(0.3, 0.6)) * np.ones(3)
    return np.where((dashed | solid)[:, None], out + worn * (paint - out), out)


def _sunlight(ahead: Floats, side: Floats, half_road: float, rng: np.random.Generator) -> Floats:
    """Illumination (n, 3) of the ground by sky and sun with shadows of what stands next to the road; 1 if overcast."""
    sun = float(rng.uniform(1.0, 5.0)) * np.array([1.05, 1.0, 0.92])
    sky = float(rng.uniform(0.5, 0.9)) * np.array([0.85, 0.97, 1.15])
    slant, reach = float(rng.uniform(-2.0, 2.0)), float(rng.uniform(-1.0, 2.5)) * half_road
    along = ahead + slant * side
    crowns = reach - half_road + 2.5 * hash_noise(along / float(rng.uniform(4.0, 15.0)), np.ones_like(along), 77)
    leaves = _noise(along, side, (1.0, 0.5), rng)
    inside = crowns - float(rng.choice([-1.0, 1.0])) * side + 0.5 * leaves
    shade = 0.5 + 0.5 * np.tanh(inside / 0.6)
    return sky + (1.0 - shade)[:, None] * sun


def _sky(up: Floats, aside: Floats, rng: np.random.Generator) -> Floats:
    """Light (n, 3) of the sky and of the woods and hills before it."""
    clouds = hash_noise(aside * 6.0 + 50.0, up * 14.0 + 50.0, int(rng.integers(1, 9000)))
    level = 1.0 + float(rng.uniform(-0.3, 0.3)) * np.clip(up / 0.3, 0.0, 1.0) + float(rng.uniform(0.0, 0.12)) * clouds
    light = np.clip(level, 0.3, None)[:, None] * (1.0 + float(rng.uniform(-0.05, 0.2)) * np.array([-1.0, 0.0, 1.0]))
    ragged = hash_noise(aside * 60.0 + 700.0, np.ones_like(aside), int(rng.integers(1, 9000)))
    height = float(rng.uniform(0.0, 0.06)) + float(rng.uniform(0.0, 0.5)) * np.clip(np.abs(aside) - 0.08, 0.0, None)
    light[up < height * (1.0 + 0.3 * ragged)] = np.array([0.05, 0.06, 0.04]) * float(rng.uniform(0.6, 2.0))
    return light


def _developed(light: Floats, rng: np.random.Generator) -> Image:
    """What a camera makes of light: exposure, gains, tone curve, noise, JPEG."""
    exposed = light * float(rng.uniform(0.55, 0.95)) * (1.0 + rng.normal(0.0, 0.04, 3))
    # A road in the sun is brighter than the sky: exposed so that not more than a thousandth burns out.
    exposed /= max(float(np.quantile(exposed, 0.999)), 1.0)
    share = np.clip(exposed, 0.0, 1.0) ** (1.0 / float(rng.uniform(1.8, 2.6)))
    bent = share * share * (3.0 - 2.0 * share)
    toned = share + float(rng.uniform(0.0, 0.5)) * (bent - share)
    grey = 255.0 * toned + rng.normal(0.0, float(rng.uniform(0.5, 2.5)), toned.shape)
    pixels = np.clip(np.rint(grey), 0, 255).astype(np.uint8)
    quality = [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(60, 96))]
    coded = cv2.imencode(".jpg", np.ascontiguousarray(pixels[..., ::-1]), quality)[1]
    return np.ascontiguousarray(cv2.imdecode(coded, cv2.IMREAD_COLOR)[..., ::-1]).astype(np.uint8, copy=False)
