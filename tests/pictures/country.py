"""Country roads in fog as a phone takes them, drawn by a fourth renderer: textured planes, walls and boxes.

Every ray meets the road, a hedge along it, a box (a vehicle) or the sky; what it meets is looked up in a table of
noise. Luminances are shares of the airlight's straight ahead, lengths in metres.
"""

import math
from dataclasses import dataclass, replace

import cv2
import numpy as np

from fogsim.values import Camera, Response


@dataclass(frozen=True)
class Country:
    """A scene."""

    camera: Camera
    visibility: float
    exposure: float = 200.0  # linear level of the airlight
    asphalt: float = 0.35
    grass: float = 0.2
    half_road: float = 3.6
    aside: float = 1.75  # of the camera to the right of the road's middle
    tracks: float = 0.0  # by how much wheels have darkened it
    repairs: float = 0.0  # by how much patches of new asphalt are darker
    grain: float = 0.03
    marks: float = 0.8  # luminance, 0 for none
    bend: float = 0.0  # [1/m]
    yaw: float = 0.0
    hedge: float = 0.0  # height, 0 for none
    vehicle: tuple[float, float, float] | None = None  # distance, middle to the right of the camera, luminance
    across: float = 0.0  # change of the airlight from left to right, per radian
    upward: float = 0.0  # and of the sky upward
    corners: float = 0.0  # 1 for cos⁴
    bonnet: float | None = None
    dirt: int = 0
    blur: float = 0.5
    electrons: float = 8000.0
    quality: int | None = None


class Noise:
    """Smooth noise of about unit deviation, the same at the same place."""

    def __init__(self, rng):
        self._table = rng.standard_normal((256, 256)).astype(np.float32)

    def __call__(self, a, b, size):
        u, v = (wrapped(one / size).astype(np.float32) for one in (a, b))
        return 1.5 * cv2.remap(self._table, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)


def wrapped(places):
    """Remainder of 256: np.mod says the same to the bit, ten times slower."""
    return places - 256.0 * np.floor(places / 256.0)


def rays(scene, over):
    """Right, down and forward of rays, forward along the road."""
    camera = scene.camera
    u = ((np.arange(camera.width * over) + 0.5) / over - 0.5 - camera.principal_point[0]) / camera.focal_length
    v = ((np.arange(camera.height * over) + 0.5) / over - 0.5 - camera.principal_point[1]) / camera.focal_length
    x, y = np.meshgrid(u, v)
    x, y = x * math.cos(camera.roll) + y * math.sin(camera.roll), y * math.cos(camera.roll) - x * math.sin(camera.roll)
    forward = math.cos(camera.pitch) - y * math.sin(camera.pitch)
    down = math.sin(camera.pitch) + y * math.cos(camera.pitch)
    return x * math.cos(scene.yaw) - forward * math.sin(scene.yaw), down, forward + x * math.sin(scene.yaw)


def ground(scene, ahead, right, noise):
    """Luminance of road and grass."""
    across = right - scene.bend * ahead**2 / 2 + scene.aside
    tone = 1.0 + scene.grain * sum(noise(ahead, across, size) for size in (0.35, 1.3, 5.0)) / math.sqrt(3.0)
    for wheel in (-2.5, -1.0, 1.0, 2.5) if scene.tracks else ():
        tone = tone - scene.tracks * np.exp(-(((across - wheel) / 0.28) ** 2))
    if scene.repairs:
        tone = tone - scene.repairs * (noise(np.floor(ahead / 9.0) + 0.5, np.floor(across / 1.75) + 0.5, 1.0) > 1.3)
    road = scene.asphalt * tone
    dashes = (np.abs(across) < 0.06) & (np.mod(ahead, 9.0) < 3.0)
    painted = scene.marks > 0 and (dashes | (np.abs(np.abs(across) - scene.half_road + 0.25) < 0.06))
    road = np.where(painted, scene.marks * (1 + 0.15 * noise(ahead, across, 0.2)), road)
    grass = scene.grass * (1 + 0.35 * noise(ahead, across, 0.6) + 0.2 * noise(ahead, across, 4.0))
    return np.where(np.abs(across) < scene.half_road, road, np.maximum(grass, 0.02))


def draw(scene, seed, over=2):
    """Colour picture of 8 bits."""
    rng = np.random.default_rng(seed)
    noise, camera = Noise(rng), scene.camera
    right, down, forward = rays(scene, over)
    x, y = right / forward, down / forward
    depth = np.where(y > 1e-6, camera.mount_height / np.maximum(y, 1e-6), np.inf)
    seen = np.minimum(depth, 5e3)
    sky = int(np.isfinite(depth).any(axis=1).argmax())  # rows of nothing else
    light = np.zeros(depth.shape)
    light[sky:] = ground(scene, seen[sky:], (seen * x)[sky:], noise)
    for side in (-1.0, 1.0) if scene.hedge else ():
        wall = (side * (scene.half_road + 1.0) - scene.aside) / np.where(x * side > 1e-6, x, np.nan)
        place = np.nan_to_num(np.minimum(wall, 4e3), nan=4e3)
        top = scene.hedge * (1 + 0.15 * noise(place, np.zeros_like(place), 2.0))
        hit = (wall < depth) & (camera.mount_height - place * y < top)
        leaves = 0.15 * np.maximum(1 + 0.4 * noise(place, place * y, 0.4), 0.1)
        light, depth = np.where(hit, leaves, light), np.where(hit, wall, depth)
    if scene.vehicle is not None:
        distance, middle, paint = scene.vehicle
        height = camera.mount_height - distance * y
        hit = (np.abs(distance * x - middle) < 0.9) & (height > 0.0) & (height < 1.5) & (distance < depth)
        tone = np.where(height < 0.3, 0.05, np.where((height > 0.9) & (height < 1.35), 0.12, paint))
        light = np.where(hit, tone * (1 + 0.25 * noise(distance * x, height, 0.3)), light)
        depth = np.where(hit, distance, depth)
    length = np.minimum(depth, 1e6) * np.sqrt(x**2 + y**2 + 1.0)
    clear = np.exp(-math.log(20.0) / scene.visibility * length)
    air = 1.0 + scene.across * x
    above = air * (1.0 + scene.upward * np.clip(-y, 0.0, 0.4))
    light = np.where(np.isfinite(depth), light * clear + air * (1.0 - clear), above)
    return taken(cv2.resize(light, (camera.width, camera.height), interpolation=cv2.INTER_AREA), scene, rng)


def taken(light, scene, rng):
    """What dirt, lens, sensor and file make of it."""
    camera = scene.camera
    rows, cols = light.shape
    v, u = np.mgrid[:rows, :cols]
    if scene.bonnet is not None:
        light = np.where(v > rows * (0.93 + 0.2 * ((u - cols / 2) / cols) ** 2), scene.bonnet, light)
    for _ in range(scene.dirt):
        place, size = rng.uniform((0, 0), (rows, cols)), rng.uniform(0.006, 0.03) * cols
        blob = 0.35 * np.exp(-((v - place[0]) ** 2 + (u - place[1]) ** 2) / size**2)
        light = light * (1 - blob) + 0.5 * blob
    off = np.hypot(u - camera.principal_point[0], v - camera.principal_point[1]) / camera.focal_length
    light = light * (1 - scene.corners + scene.corners / (1 + off**2) ** 2)
    light = cv2.GaussianBlur(light, (0, 0), scene.blur) * scene.exposure / 255.0
    colour = light[:, :, None] * (1.0 + rng.normal(0, 0.01, 3))
    colour += rng.standard_normal(colour.shape) * np.sqrt(np.maximum(colour, 0.0) / scene.electrons)
    linear = np.clip(colour, 0.0, 1.0)
    share = linear
    if camera.response is Response.GAMMA:
        share = linear ** (1 / 2.2)
    elif camera.response is Response.SRGB:
        share = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    image = np.clip(np.rint(255 * share + rng.normal(0, 0.7, share.shape)), 0, 255).astype(np.uint8)
    if scene.quality is not None:
        image = cv2.imdecode(cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, scene.quality])[1], 1)
    return image


def random_country(seed):
    """A scene of everything that may be, and its camera as told: pitch and roll are a little off."""
    rng = np.random.default_rng(seed)
    focal, pitch, roll = 560.0 * rng.uniform(0.8, 1.6), rng.uniform(-0.5, 4.0), rng.choice([0.0, 0.0, 1.0, -1.0])
    told = Camera(
        560, 400, float(focal), (279.5, 199.5), float(rng.uniform(1.1, 1.7)), math.radians(pitch),
        roll=math.radians(roll), response=list(Response)[rng.integers(3)],
    )  # fmt: skip
    pitch, roll = pitch + rng.normal(0, 0.1), roll + rng.normal(0, 0.1)
    scene = Country(
        camera=replace(told, pitch=math.radians(pitch), roll=math.radians(roll)),
        visibility=float(np.exp(rng.uniform(math.log(30), math.log(1000)))),
        exposure=float(rng.uniform(130, 240)),
        asphalt=float(rng.uniform(0.2, 0.45)),
        grass=float(rng.uniform(0.1, 0.35)),
        half_road=float(rng.uniform(3.2, 5.5)),
        aside=float(rng.uniform(1.4, 1.9)),
        tracks=float(rng.uniform(0, 0.1)),
        repairs=float(rng.choice([0.0, 0.1, 0.2])),
        grain=float(rng.choice([0.02, 0.04, 0.06])),
        marks=float(rng.choice([0.0, 0.7, 0.9])),
        bend=float(rng.choice([0.0, 0.0, 1.0]) * rng.normal(0, 1 / 900)),
        yaw=math.radians(rng.normal(0, 0.5)),
        hedge=float(rng.choice([0.0, 0.0, 0.8, 2.0, 5.0])),
        vehicle=(float(rng.uniform(12, 70)), float(rng.choice([0.0, -3.4])), float(rng.choice([0.1, 0.3, 0.8])))
        if rng.random() < 0.5
        else None,
        across=float(rng.choice([0.0, 1.0]) * rng.normal(0, 0.07)),
        upward=float(rng.choice([0.0, 1.0]) * rng.uniform(-0.2, 0.5)),
        corners=float(rng.choice([0.0, 0.5, 1.0])),
        bonnet=float(rng.choice([0.05, 0.4])) if rng.random() < 0.2 else None,
        dirt=int(rng.choice([0, 0, 4])),
        blur=float(rng.uniform(0.3, 1.0)),
        electrons=float(rng.choice([2000, 8000, 20000])),
        quality=int(rng.integers(60, 96)) if rng.random() < 0.5 else None,
    )
    return scene, told
