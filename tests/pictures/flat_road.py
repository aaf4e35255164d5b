"""A renderer of foggy roads that shares nothing with FogSim's own: the estimators' independent judge.

Tests and `benchmarks/estimator_targets.py` draw with it. Of fogsim it knows the values that estimators are told.
"""

from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from fogsim.values import Camera, Response


@dataclass(frozen=True)
class Road:
    """What stands on the flat world, all luminances in linear grey levels 0 … 255, all lengths in metres."""

    visibility: float = 100.0
    airlight: float = 200.0
    asphalt: float = 60.0
    mark: float = 150.0
    terrain: float = 45.0
    sky: float | None = None  # luminance of the sky, the airlight if None
    patch_contrast: float = 0.03
    drift: float = 0.0  # albedo wanders by as much within 40 m
    noise: float = 1.0  # pixel values
    lead_distance: float | None = None
    lead_paint: float = 30.0
    lead_brakes: bool = False
    marks: bool = True
    verge: bool = False  # in place of the lane on the right, beyond a solid line: it brightens with distance
    bend: float = 0.0  # curvature, positive to the left [1/m]
    sag: float = 0.0  # vertical curvature, negative over a crest [1/m]
    curved_from: float = 0.0  # from where on the road bends and sags; up to there it is straight and level
    camera: Camera = field(
        default_factory=lambda: Camera(640, 480, 577.0, (319.5, 239.5), 1.38, np.radians(2.0), response=Response.LINEAR)
    )

    def but(self, **changes) -> "Road":
        return replace(self, **changes)


def ground(road: Road, ahead: np.ndarray, left: np.ndarray, seed: int) -> np.ndarray:
    """Luminance of the ground without fog."""
    out = np.empty(ahead.shape)
    paved = np.abs(left) < 5.4
    at = ahead[paved], left[paved]
    out[paved] = road.asphalt * (1.0 + road.patch_contrast * patches(*at, seed) + road.drift * drift(at[0], seed))
    at = ahead[~paved], left[~paved]
    out[~paved] = road.terrain * (1.0 + 3 * road.patch_contrast * patches(*at, seed + 7))
    if road.marks:
        solid = np.abs(np.abs(left) - 5.25) < 0.075
        dashed = (np.abs(np.abs(left) - 1.75) < 0.075) & ((ahead % 12.0) < 4.0)
        out = np.where(solid | dashed, road.mark, out)
    if road.verge:
        out = np.where(left < -1.85, road.asphalt * (1.0 + 0.6 * np.clip(ahead / 60.0, 0.0, 1.0)), out)
        out = np.where(np.abs(left + 1.75) < 0.1, road.mark, out)
    return out


def drift(ahead: np.ndarray, seed: int) -> np.ndarray:
    """A slow change along the road: uniform within ±1 at every 40 m, straight in between."""
    knots = np.random.default_rng(seed + 400).uniform(-1.0, 1.0, 64)
    return np.interp(ahead % 2520.0, 40.0 * np.arange(64), knots)


def patches(ahead: np.ndarray, left: np.ndarray, seed: int) -> np.ndarray:
    """Blocky noise of unit deviation with cells of 0.3 to 7.7 m."""
    rng = np.random.default_rng(seed)
    sizes = (0.3, 1.1, 2.9, 7.7)
    total = np.zeros(ahead.shape)
    for size in sizes:
        table = rng.standard_normal((64, 64))
        total += table[(ahead / size).astype(np.int32) & 63, np.floor(left / size).astype(np.int32) & 63]
    return total / np.sqrt(len(sizes))


def seen(road: Road, rows: np.ndarray, cols: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Luminance without fog and length of the ray at image points, infinite to the sky: flat road, box."""
    camera = road.camera
    x = (cols - camera.principal_point[0]) / camera.focal_length
    y = (rows - camera.principal_point[1]) / camera.focal_length
    x, y = (x * np.cos(camera.roll) + y * np.sin(camera.roll), -x * np.sin(camera.roll) + y * np.cos(camera.roll))
    forward = np.cos(camera.pitch) - y * np.sin(camera.pitch)
    down = np.sin(camera.pitch) + y * np.cos(camera.pitch)
    ahead = road_distance(road, down / forward)
    hits = np.isfinite(ahead)
    depth = np.where(hits, ahead / forward, 0.0)
    ahead = depth * forward
    left = -depth * x - 0.5 * road.bend * np.maximum(ahead - road.curved_from, 0.0) ** 2
    intrinsic = np.zeros(depth.shape)
    intrinsic[hits] = ground(road, ahead[hits], left[hits], seed)
    length = np.where(hits, depth * np.sqrt(x**2 + forward**2 + down**2), np.inf)
    if road.lead_distance is not None:
        plane = road.lead_distance / forward
        height, side = camera.mount_height - plane * down, plane * x
        box = (np.abs(side) < 0.9) & (height > 0.0) & (height < 1.5) & ((plane < depth) | ~hits)
        intrinsic = np.where(box, np.where(height < 0.3, 8.0, road.lead_paint), intrinsic)
        glass = box & (height > 0.95) & (height < 1.4) & (np.abs(side) < 0.7)
        intrinsic = np.where(glass, 12.0, intrinsic)
        if road.lead_brakes:
            lamps = box & (np.abs(height - 0.8) < 0.09) & (np.abs(np.abs(side) - 0.72) < 0.12)
            intrinsic = np.where(lamps, 900.0, intrinsic)
        length = np.where(box, plane * np.sqrt(x**2 + 1.0 + y**2), length)
    return intrinsic, length


def road_distance(road: Road, fall: np.ndarray) -> np.ndarray:
    """How far ahead rays that fall by so much per metre meet the road; infinite if they do not."""
    start, height = road.curved_from, road.camera.mount_height
    level = fall > 1e-9
    ahead = np.where(level, height / np.where(level, fall, 1.0), np.inf)
    if road.sag == 0.0:
        return ahead
    # Behind the start, above the level by e there: e − fall w = sag w² / 2.
    above = height - fall * start
    square = fall**2 + 2.0 * road.sag * above
    slope = fall + np.sqrt(np.maximum(square, 0.0))
    meets = (square >= 0.0) & (slope > 1e-9)
    behind = np.where(meets, start + 2.0 * above / np.where(meets, slope, 1.0), np.inf)
    return np.where(above <= 0.0, ahead, behind)


def fogged(road: Road, intrinsic: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Linear luminance by Koschmieder's law."""
    transmission = np.exp(-3.0 * np.where(np.isfinite(length), length, 0.0) / road.visibility)
    sky = road.airlight if road.sky is None else road.sky
    return np.where(np.isfinite(length), intrinsic * transmission + road.airlight * (1 - transmission), sky)


def encode(linear: np.ndarray, response: Response) -> np.ndarray:
    share = np.clip(linear / 255.0, 0.0, 1.0)
    if response is Response.GAMMA:
        return 255.0 * share ** (1 / 2.2)
    if response is Response.SRGB:
        return 255.0 * np.where(share <= 0.0031308, 12.92 * share, 1.055 * share ** (1 / 2.4) - 0.055)
    return 255.0 * share


def scan(road: Road, seed: int, samples: int) -> tuple[np.ndarray, np.ndarray]:
    """What `seen` tells at as many points of each pixel, squared: fog, noise and exposure are not in it."""
    linear = replace(road.camera, response=Response.LINEAR)
    return _scanned(road.but(visibility=0.0, airlight=0.0, sky=0.0, noise=0.0, camera=linear), seed, samples)


@lru_cache(maxsize=12)
def _scanned(road: Road, seed: int, samples: int) -> tuple[np.ndarray, np.ndarray]:
    camera = road.camera
    offsets = (np.arange(samples) + 0.5) / samples - 0.5
    rows = (np.arange(camera.height)[:, None] + offsets).ravel()
    cols = (np.arange(camera.width)[:, None] + offsets).ravel()
    return seen(road, *np.meshgrid(rows, cols, indexing="ij"), seed)


def photograph(road: Road, fine: tuple[np.ndarray, np.ndarray], seed: int) -> np.ndarray:
    """One 8-bit image of what was scanned, in the road's fog and light."""
    camera = road.camera
    samples = fine[0].shape[0] // camera.height
    linear = fogged(road, *fine).reshape(camera.height, samples, camera.width, samples).mean(axis=(1, 3))
    noise = np.random.default_rng(seed + 1000).normal(0.0, road.noise, linear.shape) if road.noise else 0.0
    return np.clip(np.rint(encode(linear, camera.response) + noise), 0, 255).astype(np.uint8)
