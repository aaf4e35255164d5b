"""Pictures of signs in fog for `sign_detector.py`: FogSim's own, and others that are drawn with Pillow.

The others share nothing with FogSim's renderer: flat figures in supersampled polygons before painted backgrounds (sky,
wood, verge, road, houses with windows, posts), fog by depth, then what cameras do: blur, sharpening, noise, the sRGB
curve, JPEG.
"""

import io
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from fogsim.calibration.staged_road import AIRLIGHT, ILLUMINANCE, foggy_radiance, straight_road
from fogsim.camera import Sensor, expose
from fogsim.render import make_renderer
from fogsim.scene import build_scene
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, CameraPose, Response, Sign, SignMap
from fogsim.values.camera_response import respond

CAMERA = Camera(1400, 600, 1100.0, (699.5, 279.5), 1.3, math.radians(0.5), response=Response.SRGB)
SETBACK = 1.9
"""From the bumper, where the map's distances begin, back to the camera [m]."""
LATERAL, HEIGHT, DIAMETER = -5.5, 2.3, 0.9
"""Of the signs: to the left of the camera, above the road, across the face [m]."""

_FINE = 6  # subpixels along a pixel of a sign
_SKY = 1e4  # [m]
_WIDE, _HIGH = 440, 320  # of pieces of painted pictures [px]

Colour = tuple[float, float, float]
Floats = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Shot:
    """A picture and what is true of it."""

    image: NDArray[np.uint8]  # the picture
    camera: Camera  # the true calibration
    distance: float  # from the bumper to the sign [m]
    u: float  # middle of its face, and half of its diameter [px]
    v: float
    radius: float


def place(
    camera: Camera, distance: float, lateral: float = LATERAL, height: float = HEIGHT
) -> tuple[float, float, float]:
    """Column, row [px] and scale [px/m] of what is so far ahead of the bumper."""
    ahead, up = distance + SETBACK, height - camera.mount_height
    depth = ahead * math.cos(camera.pitch) - up * math.sin(camera.pitch)
    scale = camera.focal_length / depth
    below = ahead * math.sin(camera.pitch) + up * math.cos(camera.pitch)
    return camera.principal_point[0] - scale * lateral, camera.principal_point[1] - scale * below, scale


def fogsim_shots(
    kind: str, distances: Sequence[float], visibility: float, rng: np.random.Generator, *, standing: bool = True
) -> Iterator[Shot]:
    """FogSim's own pictures of the road with a sign in fog; or of the road alone where it should stand."""
    post = Sign("s", kind, 80 / 3.6, (distances[0] + 20.0, LATERAL, HEIGHT), 0.0, DIAMETER)
    scene = build_scene(straight_road(), SignMap((post,) if standing else ()), np.random.default_rng(rng.integers(99)))
    renderer = make_renderer("auto", scene, illuminance=ILLUMINANCE)
    try:
        drawn_at = math.nan
        for distance in distances:
            if distance != drawn_at:
                back = (post.position[0] - distance - SETBACK, 0.0, CAMERA.mount_height)
                pose = CameraPose(back, heading=0.0)
                view = renderer.render((), CAMERA, pose)
                radiance = foggy_radiance(view, pose, CAMERA, extinction_from_visibility(visibility))
                drawn_at = distance
            sensor = Sensor(AIRLIGHT * 255.0 / float(rng.choice((120.0, 200.0, 255.0))))
            image = expose(radiance, sensor, CAMERA.response, rng).astype(np.uint8)
            u, v, scale = place(CAMERA, distance)
            yield Shot(image, CAMERA, distance, u, v, 0.5 * DIAMETER * scale)
    finally:
        renderer.close()


@dataclass(frozen=True, slots=True)
class Background:
    """What is behind a sign: reflected light over that of the fog (rows, cols, 3) and depth (rows, cols) [m]."""

    light: Floats
    depth: Floats


def painted_background(camera: Camera, rng: np.random.Generator) -> Background:
    """Sky, wood, verge, road, houses and posts, with textures of all sizes."""
    rows, cols = np.mgrid[: camera.height, : camera.width].astype(np.float32)
    horizon = camera.horizon_row
    light = np.empty((camera.height, camera.width, 3), np.float32)
    depth = np.full((camera.height, camera.width), _SKY, np.float32)
    light[:] = np.array([0.85, 0.92, 1.0]) * rng.uniform(0.7, 1.05)
    ground = rows > horizon + 1.0
    depth[ground] = camera.row_distance / (rows[ground] - horizon)
    grass = _texture(rng, camera, 1.2)
    light[ground] = (np.array([0.16, 0.2, 0.09]) * rng.uniform(0.6, 1.6) * np.exp(0.35 * grass)[..., None])[ground]
    aside = (cols - camera.principal_point[0]) * depth / camera.focal_length
    road = ground & (aside > -7.5) & (aside < 4.0)
    light[road] = (0.17 + 0.015 * _texture(rng, camera, 0.6))[road][:, None]
    light[road & (np.abs(np.abs(aside) - 1.75) < 0.08)] = 0.6
    for _ in range(int(rng.integers(2, 5))):
        _paint_wood(light, depth, camera, rng)
    for _ in range(int(rng.integers(0, 5))):
        _paint_house(light, depth, camera, rng)
    for _ in range(int(rng.integers(0, 6))):
        left, far = rng.uniform(0, camera.width), rng.uniform(15.0, 120.0)
        _paint(
            light,
            depth,
            (left, -99.0, left + 0.15 * camera.focal_length / far, horizon + 40.0),
            far,
            rng.uniform(0.03, 0.4),
        )
    return Background(light, depth)


def _texture(rng: np.random.Generator, camera: Camera, slope: float) -> Floats:
    """Noise with a power spectrum like those of photographs, of standard deviation 1: (rows, cols) float32."""
    rows, cols = camera.height, camera.width
    across = np.hypot(np.fft.fftfreq(rows)[:, None], np.fft.rfftfreq(cols)[None, :])
    shape = 1.0 / np.maximum(across, 1.0 / cols) ** slope
    noise = np.fft.irfft2(np.fft.rfft2(rng.normal(size=(rows, cols))) * shape, s=(rows, cols))
    return ((noise - noise.mean()) / noise.std()).astype(np.float32)


def _paint_wood(light: Floats, depth: Floats, camera: Camera, rng: np.random.Generator) -> None:
    far, texture = rng.uniform(25.0, 250.0), _texture(rng, camera, rng.uniform(0.5, 1.3))
    tops = camera.horizon_row - camera.focal_length / far * (8.0 + 3.0 * _texture(rng, camera, 1.0)[0])
    ends = np.sort(rng.uniform(0, camera.width, 2))
    rows, cols = np.mgrid[: camera.height, : camera.width].astype(np.float32)
    foot = camera.horizon_row + camera.row_distance / far
    wood = (rows > tops[None, :] + 4.0 * texture) & (rows < foot) & (cols > ends[0]) & (cols < ends[1]) & (depth > far)
    leaf = np.array([0.06, 0.09, 0.04], np.float32) * rng.uniform(0.6, 2.0)
    light[wood] = (leaf * np.exp(rng.uniform(0.2, 0.7) * texture)[..., None])[wood]
    depth[wood] = far


def _paint_house(light: Floats, depth: Floats, camera: Camera, rng: np.random.Generator) -> None:
    far, left = rng.uniform(25.0, 150.0), rng.uniform(0, camera.width)
    scale, foot = camera.focal_length / far, camera.horizon_row + camera.row_distance / far
    wide, high = rng.uniform(6.0, 14.0) * scale, rng.uniform(3.0, 8.0) * scale
    _paint(light, depth, (left, foot - high, left + wide, foot), far, rng.uniform(0.2, 0.7))
    size = rng.uniform(0.8, 1.5) * scale
    for row in np.arange(foot - high + 0.7 * size, foot - 1.3 * size, 2.2 * size):
        for col in np.arange(left + 0.6 * size, left + wide - 1.2 * size, 2.0 * size):
            _paint(light, depth, (col, row, col + size, row + 1.3 * size), far, rng.uniform(0.03, 0.12))


def _paint(light: Floats, depth: Floats, box: tuple[float, float, float, float], far: float, grey: float) -> None:
    left, top, right, bottom = (max(round(edge), 0) for edge in box)
    seen = depth[top:bottom, left:right] >= far
    light[top:bottom, left:right][seen] = grey
    depth[top:bottom, left:right][seen] = far


@dataclass(frozen=True, slots=True)
class Look:
    """What a camera makes of light."""

    blur: float = 0.6  # standard deviation of the lens's blur [px]
    sharpening: float = 0.0  # how much of what a blur of 1.2 px takes away is added [-]
    noise: float = 1.5  # standard deviation of the noise of a white pixel [grey levels]
    level: float = 200.0  # linear pixel value of the airlight, of 255
    quality: int = 90  # of JPEG, 0 … 100; 0 for none

    def __call__(self, light: Floats, rng: np.random.Generator) -> NDArray[np.uint8]:
        """Picture of light relative to that of the fog."""
        seen = cv2.GaussianBlur(light, (0, 0), self.blur) * (self.level / 255.0)
        noise = rng.standard_normal(seen.shape, np.float32) * np.sqrt(np.maximum(seen, 0.02)) * (self.noise / 255.0)
        grey = 255.0 * respond(np.clip(seen + noise, 0.0, 1.0).astype(np.float64), Response.SRGB)
        if self.sharpening:
            grey += self.sharpening * (grey - cv2.GaussianBlur(grey, (0, 0), 1.2))
        image = np.clip(np.round(grey), 0, 255).astype(np.uint8)
        if not self.quality:
            return image
        packed = io.BytesIO()
        Image.fromarray(image).save(packed, "JPEG", quality=self.quality)
        return np.array(Image.open(packed))


def _regular(sides: int, turn: float = 0.0, radius: float = 1.0) -> list[tuple[float, float]]:
    angles = [turn + 2 * math.pi * k / sides for k in range(sides)]
    return [(radius * math.cos(a), radius * math.sin(a)) for a in angles]


_WHITE, _RED, _YELLOW, _BLUE, _BLACK, _GREEN = (
    (0.75, 0.75, 0.73), (0.45, 0.03, 0.03), (0.75, 0.52, 0.03),
    (0.02, 0.09, 0.38), (0.03, 0.03, 0.03), (0.02, 0.2, 0.09)
)  # fmt: skip
_DISC, _OCTAGON = _regular(60), _regular(8, math.pi / 8, 1.082)
_SQUARE, _DIAMOND = _regular(4, math.pi / 4, math.sqrt(2.0)), _regular(4)
_WARNING = [(0.0, -0.866), (1.0, 0.866), (-1.0, 0.866)]
_YIELD = [(x, -y) for x, y in _WARNING]
_BAR = [(-0.7, -0.17), (0.7, -0.17), (0.7, 0.17), (-0.7, 0.17)]
_ARROW = [(-0.12, 0.6), (-0.12, -0.1), (-0.4, -0.1), (0.0, -0.6), (0.4, -0.1), (0.12, -0.1), (0.12, 0.6)]

Layer = tuple[Sequence[tuple[float, float]], float, Colour | None]
"""A polygon, its size, and its colour: None for words."""

FIGURES: dict[str, tuple[tuple[Layer, ...], str]] = {
    "limit": (((_DISC, 1.0, _RED), (_DISC, 0.76, _WHITE)), "80"),
    "limit, white rim": (((_DISC, 1.0, _WHITE), (_DISC, 0.95, _RED), (_DISC, 0.72, _WHITE)), "100"),
    "limit, yellow": (((_DISC, 1.0, _RED), (_DISC, 0.74, _YELLOW)), "60"),
    "no entry": (((_DISC, 1.0, _WHITE), (_DISC, 0.95, _RED), (_BAR, 1.0, _WHITE)), ""),
    "straight on": (((_DISC, 1.0, _WHITE), (_DISC, 0.94, _BLUE), (_ARROW, 1.0, _WHITE)), ""),
    "stop": (((_OCTAGON, 1.0, _WHITE), (_OCTAGON, 0.93, _RED)), "STOP"),
    "diamond": (((_DIAMOND, 1.0, _BLACK), (_DIAMOND, 0.93, _YELLOW)), "!"),
    "priority": (((_DIAMOND, 1.0, _WHITE), (_DIAMOND, 0.72, _YELLOW)), ""),
    "parking": (((_SQUARE, 1.0, _WHITE), (_SQUARE, 0.93, _BLUE)), "P"),
    "way": (((_SQUARE, 1.0, _GREEN), (_SQUARE, 0.9, _GREEN)), "A7"),
    "warning": (((_WARNING, 1.0, _RED), (_WARNING, 0.68, _WHITE)), "!"),
    "warning, yellow": (((_WARNING, 1.0, _RED), (_WARNING, 0.7, _YELLOW)), "!"),
    "yield": (((_YIELD, 1.0, _RED), (_YIELD, 0.62, _WHITE)), ""),
}
"""Faces by kind: polygons of half width 1, and words."""
TRIANGLES = ("warning", "warning, yellow", "yield")


def painted_shot(
    kind: str | None, distance: float, visibility: float, background: Background, look: Look, rng: np.random.Generator
) -> Shot:
    """Part of a picture about a sign in fog that FogSim did not draw; without a kind, about where it might stand."""
    u, v, scale = place(CAMERA, distance)
    radius, k = 0.5 * DIAMETER * scale, extinction_from_visibility(visibility)
    left, top = max(round(u) - _WIDE // 2, 0), max(round(v) - _HIGH // 2, 0)
    piece = (slice(top, min(top + _HIGH, CAMERA.height)), slice(left, min(left + _WIDE, CAMERA.width)))
    depth = background.depth[piece].copy()
    # What rises behind the sign is behind it.
    rising = slice(0, max(math.ceil(CAMERA.horizon_row) - top, 0))
    depth[rising] = np.maximum(depth[rising], 1.1 * (distance + SETBACK))
    through = np.exp(-k * depth)[..., None]
    light = background.light[piece] * through + (1.0 - through)
    u, v = u - left, v - top
    if kind is not None:
        here = math.exp(-k * (distance + SETBACK))
        foot = CAMERA.horizon_row - top + CAMERA.row_distance / (distance + SETBACK)
        light[round(v) : round(foot), round(u - 0.03 * scale) : round(u + 0.03 * scale) + 1] = 0.25 * here + 1.0 - here
        _add_sign(light, here, _drawn_sign(kind, (u, v), radius, rng))
    rows, cols = light.shape[:2]
    corner = (CAMERA.principal_point[0] - left, CAMERA.principal_point[1] - top)
    camera = replace(CAMERA, width=cols, height=rows, principal_point=corner)
    return Shot(look(light.astype(np.float32), rng), camera, distance, u, v, radius)


def _add_sign(light: Floats, transmittance: float, drawn: tuple[Floats, Floats, int, int]) -> None:
    face, cover, left, top = drawn
    rows, cols = slice(max(-top, 0), light.shape[0] - top), slice(max(-left, 0), light.shape[1] - left)
    face, cover = face[rows, cols], cover[rows, cols]
    behind = light[max(top, 0) :, max(left, 0) :][: cover.shape[0], : cover.shape[1]]
    behind += cover[..., None] * (face * transmittance + 1.0 - transmittance - behind)


def _drawn_sign(
    kind: str, middle: tuple[float, float], radius: float, rng: np.random.Generator
) -> tuple[Floats, Floats, int, int]:
    """Reflectance and coverage (size, size[, 3]) of a sign, a little turned, and its first column and row."""
    size = 2 * math.ceil(1.3 * radius) + 5
    left, top = math.floor(middle[0]) - size // 2, math.floor(middle[1]) - size // 2
    layers, words = FIGURES[kind]
    roll, narrow, shade = (
        rng.normal(0.0, math.radians(2.0)),
        math.cos(rng.normal(0.0, math.radians(12.0))),
        rng.uniform(0.6, 1.1),
    )
    x0, y0 = (middle[0] - left + 0.5) * _FINE, (middle[1] - top + 0.5) * _FINE

    def corners(polygon: Sequence[tuple[float, float]], part: float) -> list[tuple[float, float]]:
        turned = [
            (x * math.cos(roll) - y * math.sin(roll), x * math.sin(roll) + y * math.cos(roll)) for x, y in polygon
        ]
        # Triangles grow about the middle of the circle in them.
        low = {"w": 0.289, "y": -0.289}.get(kind[0], 0.0) * (kind in TRIANGLES) * (1.0 - part)
        return [(x0 + radius * _FINE * part * narrow * x, y0 + radius * _FINE * (part * y + low)) for x, y in turned]

    side = size * _FINE
    face, mask = Image.new("RGB", (side, side)), Image.new("L", (side, side))
    pen = ImageDraw.Draw(face)
    ImageDraw.Draw(mask).polygon(corners(layers[0][0], 1.0), fill=255)
    for polygon, part, colour in layers:
        pen.polygon(corners(polygon, part), fill=tuple(round(255 * c) for c in colour or _BLACK))
    if words:
        ink = _BLACK if layers[-1][2] in {_WHITE, _YELLOW} else _WHITE
        high = 0.75 * radius * _FINE / max(len(words) / 2, 1.0)
        pen.text(
            (x0, y0 + (0.25 * radius * _FINE if kind in TRIANGLES else 0.0)),
            words,
            fill=tuple(round(255 * c) for c in ink),
            font_size=max(high * 1.4, 1.0),
            anchor="mm",
        )
    parts = [np.asarray(part, np.float32) / 255.0 for part in (face, mask)]
    colour, cover = (cv2.resize(part, (size, size), interpolation=cv2.INTER_AREA) for part in parts)
    return colour * shade, cover, left, top


def looks(rng: np.random.Generator) -> Look:
    """Draw a camera's look."""
    return Look(
        blur=float(rng.uniform(0.45, 0.9)),
        sharpening=float(rng.choice((0.0, 0.4, 0.9))),
        noise=float(rng.uniform(0.8, 4.0)),
        level=float(rng.uniform(120.0, 245.0)),
        quality=int(rng.choice((0, 60, 75, 90))),
    )
