"""Pictures as cameras behind windscreens take them, drawn by a renderer that is neither FogSim's nor `flat_road`'s.

Tests and `benchmarks/estimator_targets.py` draw with it. Of fogsim it knows the values that estimators are told.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import count

import cv2
import numba
import numpy as np

from fogsim.values import Camera, Response


@dataclass(frozen=True)
class Scene:
    """A road in fog; lengths in metres, luminances as shares of the airlight."""

    camera: Camera
    visibility: float
    airlight: float  # linear grey levels
    half_road: float = 6.0
    shoulder: float = 0.15
    asphalt: float = 0.3
    mark: float = 0.75
    mark_width: float = 0.15
    lane: float = 3.5
    aside: float = 0.0  # of the camera from its lane's middle
    dash: tuple[float, float] = (4.0, 12.0)
    edge_lines: bool = True
    texture: float = 0.03
    curvature: float = 0.0
    yaw: float = 0.0
    lead: tuple[float, float, float] | None = None  # distance, half width, luminance
    aside_car: tuple[float, float, float] | None = None  # distance, lateral middle, luminance
    trees: float | None = None  # distance of a wood across the view
    roadside: float | None = None  # distance to which woods stand on both sides
    sky_gradient: float = 0.0  # relative change of the sky up to 0.3 rad
    vignette: float = 0.0
    noise: float = 1.0
    jpeg: int | None = None
    bonnet: float | None = None  # luminance of the own bonnet
    stamp: bool = False
    wiper: float | None = None  # its angle [rad]
    mirror: bool = False
    colour: bool = False


@numba.njit(cache=True)
def _hashed(mixed):
    """A number from -0.5 to 0.5 that looks random."""
    mixed ^= mixed >> 13
    mixed *= 1274126177
    mixed ^= mixed >> 16
    return (mixed & 0xFFFF) / 65535.0 - 0.5


@numba.njit(cache=True)
def hash_noise(x, y, seed):
    """Smooth noise of unit deviation at places (n,): uniform hashes of a lattice, and between them."""
    out = np.empty(x.size)
    for index in range(x.size):
        i, j = np.floor(x[index]), np.floor(y[index])
        fx, fy = x[index] - i, y[index] - j
        fx, fy = fx * fx * (3 - 2 * fx), fy * fy * (3 - 2 * fy)
        left, top = np.int64(i) * 73856093, (np.int64(j) * 19349663) ^ (seed * 83492791)
        right, bottom = left + 73856093, ((np.int64(j) + 1) * 19349663) ^ (seed * 83492791)
        near = _hashed(left ^ top) * (1 - fx) + _hashed(right ^ top) * fx
        far = _hashed(left ^ bottom) * (1 - fx) + _hashed(right ^ bottom) * fx
        out[index] = (near * (1 - fy) + far * fy) / 0.17
    return out


def albedo(scene, ahead, right, seed):
    across = right - scene.curvature * ahead**2 / 2 + scene.aside
    paved = np.abs(across) < scene.half_road
    at, beside = ahead[paved], across[paved]
    wear = sum(hash_noise(at / size, beside / (0.5 * size), seed + i) for i, size in enumerate((0.4, 1.7, 6.0)))
    road = scene.asphalt * (1 + scene.texture * wear / np.sqrt(3.0))
    at, beside = ahead[~paved], across[~paved]
    grass = scene.shoulder * (1 + 3 * scene.texture * hash_noise(at / 1.1, beside / 1.1, seed + 5))
    out = np.empty(ahead.shape)
    out[paved], out[~paved] = road, grass
    half = scene.mark_width / 2
    dashed = (np.abs(np.abs(across) - scene.lane / 2) < half) & ((ahead + seed) % scene.dash[1] < scene.dash[0])
    solid = (np.abs(np.abs(across) - scene.half_road + 0.3) < half) & scene.edge_lines
    return np.where((dashed & (scene.mark_width > 0)) | solid, scene.mark, out)


def rays(camera, over):
    """Forward, down and right per unit depth of rays through a finer grid of pixels."""
    step = (np.arange(over) + 0.5) / over - 0.5
    v = (np.arange(camera.height)[:, None] + step).ravel()
    u = (np.arange(camera.width)[:, None] + step).ravel()
    x = (u[None, :] - camera.principal_point[0]) / camera.focal_length
    y = (v[:, None] - camera.principal_point[1]) / camera.focal_length
    cosine, sine = np.cos(camera.roll), np.sin(camera.roll)
    x, y = x * cosine + y * sine, y * cosine - x * sine
    return np.cos(camera.pitch) - y * np.sin(camera.pitch), np.sin(camera.pitch) + y * np.cos(camera.pitch), x


def draw(scene, seed, over=2):
    """8-bit picture of a scene."""
    camera = scene.camera
    forward, down, right = rays(camera, over)
    size = np.sqrt(forward**2 + down**2 + right**2)
    ground = down > 1e-6
    reach = np.where(ground, camera.mount_height / np.where(ground, down, 1.0), np.inf)
    depth = np.where(ground, np.minimum(reach, 1e4), 0.0)
    turned_x = right * np.cos(scene.yaw) - forward * np.sin(scene.yaw)
    turned_z = forward * np.cos(scene.yaw) + right * np.sin(scene.yaw)
    own = np.zeros(reach.shape)
    own[ground] = albedo(scene, (depth * turned_z)[ground], (depth * turned_x)[ground], seed)
    for box in _boxes(scene):
        own, reach = _stand(box, own, reach, (forward, down, right), camera, scene, seed)
    length = np.where(np.isfinite(reach), np.minimum(reach, 1e6) * size, 0.0)
    clear = np.where(np.isfinite(reach), np.exp(-np.log(20.0) / scene.visibility * length), 0.0)
    sky = 1.0 + scene.sky_gradient * np.clip(-down / 0.3, 0.0, 1.0)
    light = np.where(np.isfinite(reach), own * clear + (1 - clear), sky)
    light = light.reshape(camera.height, over, camera.width, over).mean(axis=(1, 3))
    return _taken(light, scene, seed)


def _boxes(scene):
    """Distance, left and right side, height and luminance of what stands up, the nearest last."""
    if scene.trees is not None:
        yield scene.trees, -1e3, 1e3, 9.0, 0.12
    if scene.roadside is not None:
        for distance in np.geomspace(scene.roadside, 12.0, 9):
            shift = scene.curvature * distance**2 / 2
            yield distance, -1e3, shift - scene.half_road - 3.0, 10.0, 0.12
            yield distance, shift + scene.half_road + 3.0, 1e3, 10.0, 0.12
    if scene.aside_car is not None:
        distance, middle, paint = scene.aside_car
        yield distance, middle - 0.9, middle + 0.9, 1.5, paint
    if scene.lead is not None:
        distance, half, paint = scene.lead
        yield distance, -half, half, 1.6 * half, paint


def _stand(box, own, reach, directions, camera, scene, seed):
    distance, left, right_side, top, paint = box
    forward, down, right = directions
    depth = distance / forward
    height, side = camera.mount_height - depth * down, depth * right
    # No outline is twice as high, so hashes are only needed there.
    inside = (side > left) & (side < right_side) & (height > 0) & (height < 2 * top) & (depth < reach)
    height, side = height[inside], side[inside]
    ragged = top * (1 + 0.3 * hash_noise(side / 4.0, np.zeros_like(side), seed + 9)) if top > 5 else top
    tone = np.where(height < 0.25, 0.04, np.where((height > 0.6 * top) & (height < 0.9 * top), 0.06, paint))
    if top > 5:
        tone = paint * (1 + 0.3 * hash_noise(side / 1.5, height / 1.5, seed + 11))
    within = height < ragged
    inside[inside] = within
    own[inside], reach[inside] = tone[within], np.broadcast_to(depth, reach.shape)[inside]
    return own, reach


def _taken(light, scene, seed):
    """What optics, windscreen, sensor and file make of relative luminances."""
    camera, rng = scene.camera, np.random.default_rng(seed + 77)
    rows, cols = light.shape
    v, u = np.mgrid[:rows, :cols]
    apart = np.hypot((v - rows / 2) / rows, (u - cols / 2) / cols) ** 2
    light = light * (1 - 2 * scene.vignette * apart)
    if scene.bonnet is not None:
        edge = rows * (0.9 + 0.08 * ((u - cols / 2) / (cols / 2)) ** 2)
        light = np.where(v > edge, scene.bonnet * (1 + 0.3 * (u / cols - 0.5)), light)
    if scene.mirror:
        light = np.where((v < 0.12 * rows) & (np.abs(u - 0.55 * cols) < 0.12 * cols), 0.05, light)
    if scene.wiper is not None:
        away = (u - 0.3 * cols) * np.sin(scene.wiper) - (rows - v) * np.cos(scene.wiper)
        cover = np.clip(1.5 - np.abs(away) / (0.012 * cols), 0.0, 1.0)
        light = light * (1 - cover) + 0.05 * cover
    linear = np.clip(light * scene.airlight / 255.0, 0.0, 1.0)
    share = linear
    if camera.response is Response.GAMMA:
        share = linear ** (1 / 2.2)
    elif camera.response is Response.SRGB:
        share = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    grey = 255.0 * share + rng.normal(0.0, scene.noise, share.shape)
    image = np.clip(np.rint(grey), 0, 255).astype(np.uint8)
    if scene.stamp:
        for where, size in (((0.03, 0.95), 1.0), ((0.6, 0.06), 0.8)):
            place = (int(where[0] * cols), int(where[1] * rows))
            scale = size * rows / 500
            cv2.putText(image, "2026-11-03 07:41:22", place, cv2.FONT_HERSHEY_SIMPLEX, scale, 255, max(1, rows // 250))
    if scene.jpeg is not None:
        image = cv2.imdecode(cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, scene.jpeg])[1], 0)
    return np.repeat(image[:, :, None], 3, axis=2) if scene.colour else image


def random_scene(seed):
    """A scene of everything that may be, and the camera as it is told: its pitch and roll are a little off."""
    rng = np.random.default_rng(seed)
    width, height = [(160, 120), (320, 240), (640, 480), (688, 515), (800, 450), (1024, 600), (1400, 600)][
        rng.integers(7)
    ]
    focal = float(np.clip(width * rng.uniform(0.6, 2.2), 130, 2200))
    pitch = float(np.clip(np.radians(rng.uniform(-1, 5)), -0.3 * height / focal, 0.25 * height / focal))
    camera = Camera(
        width, height, focal, ((width - 1) / 2 + rng.normal(0, 3), (height - 1) / 2 + rng.normal(0, 3)),
        float(rng.uniform(1.0, 2.5)), pitch, response=list(Response)[rng.integers(3)],
    )  # fmt: skip
    roll = np.radians(rng.choice([0.0, 0.0, 1.0, -1.0]))
    camera = replace(camera, roll=float(roll))
    true = replace(camera, pitch=camera.pitch + float(np.radians(rng.normal(0, 0.1))))

    def maybe(chance, value):
        return value if rng.random() < chance else None

    scene = Scene(
        camera=true,
        visibility=float(np.exp(rng.uniform(np.log(25), np.log(1500)))),
        airlight=float(rng.uniform(120, 265)),
        half_road=float(rng.uniform(3.2, 8.0)),
        shoulder=float(rng.choice([0.05, 0.15, 0.25, 0.45])),
        asphalt=float(rng.uniform(0.15, 0.5)),
        mark=float(rng.uniform(0.55, 0.95)),
        mark_width=float(rng.choice([0.0, 0.12, 0.15, 0.3])),
        lane=float(rng.uniform(3.0, 3.75)),
        aside=float(rng.normal(0, 0.3)),
        dash=[(4.0, 12.0), (3.0, 9.0), (6.0, 18.0), (3.0, 4.5)][rng.integers(4)],
        edge_lines=bool(rng.random() < 0.6),
        texture=float(rng.choice([0.01, 0.03, 0.06])),
        curvature=float(rng.choice([0.0, 0.0, 1.0]) * rng.normal(0, 1 / 800)),
        yaw=float(np.radians(rng.normal(0, 0.6))),
        lead=maybe(
            0.3, (float(rng.uniform(8, 60)), float(rng.choice([0.9, 1.25])), float(rng.choice([0.08, 0.3, 0.9])))
        ),
        aside_car=maybe(
            0.3, (float(rng.uniform(8, 60)), float(rng.choice([-3.5, 3.5])), float(rng.choice([0.1, 0.8])))
        ),
        trees=maybe(0.3, float(rng.uniform(60, 400))),
        roadside=maybe(0.3, float(rng.uniform(60, 250))),
        sky_gradient=float(rng.choice([0.0, 0.0, -0.15, 0.15, 0.4])),
        vignette=float(rng.choice([0.0, 0.0, 0.05, 0.1])),
        noise=float(rng.choice([0.5, 1.0, 2.0, 4.0])),
        jpeg=maybe(0.4, int(rng.integers(60, 95))),
        bonnet=maybe(0.25, float(rng.choice([0.03, 0.3, 0.7]))),
        stamp=bool(rng.random() < 0.25),
        wiper=maybe(0.1, float(rng.uniform(0.3, 2.8))),
        mirror=bool(rng.random() < 0.15),
        colour=bool(rng.random() < 0.3),
    )  # fmt: skip
    return scene, camera


def small_scenes(first: int) -> Iterator[tuple[int, Scene, Camera]]:
    """Random scenes that are quickly drawn, without end: the seed, what is seen, and the camera as it is told."""
    for seed in count(first):
        scene, told = random_scene(seed)
        if told.width <= 688:
            yield seed, scene, told


PLAIN = Scene(Camera(640, 480, 800.0, (319.5, 239.5), 1.3, np.radians(1.5)), 150.0, 200.0)

IN_THE_WAY = (
    {"bonnet": 0.03},
    {"bonnet": 0.7},
    {"trees": 120.0, "visibility": 300.0},
    {"trees": 70.0},
    {"roadside": 150.0, "visibility": 400.0},
    {"stamp": True, "mirror": True},
    {"wiper": 1.0},
    {"sky_gradient": 0.4, "visibility": 60.0},
    {"sky_gradient": -0.15},
    {"half_road": 2.5, "shoulder": 0.05, "edge_lines": False},
    {"half_road": 2.5, "shoulder": 0.5, "asphalt": 0.2, "mark_width": 0.0, "edge_lines": False},
    {"curvature": 1 / 400},
    {"yaw": np.radians(1.5)},
    {"jpeg": 60},
    {"aside_car": (15.0, -3.5, 0.8)},
    {"lead": (12.0, 1.25, 0.9), "visibility": 80.0},
)
"""Changes of the plain scene, each of which has misled some estimator."""
