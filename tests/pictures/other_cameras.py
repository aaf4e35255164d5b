"""What other cameras and other light make of the flat road: film curves, tone mapping, files, wet and bright roads.

The luminances are those of `flat_road`; the camera is described as one of sRGB, and pitched a little otherwise.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import cv2
import numpy as np
from flat_road import Road, fogged, scan

from fogsim.values import Camera, Response

CAMERA = Camera(640, 400, 560.0, (319.5, 199.5), 1.35, np.radians(1.5), response=Response.SRGB)


@dataclass(frozen=True)
class Light:
    """Relative luminance of an image: 1 is full scale."""

    linear: np.ndarray
    below: np.ndarray  # angle below the true horizon [rad], a column
    mirrored: np.ndarray  # what fog leaves of the sky that a wet road mirrors, a column
    rng: np.random.Generator


def srgb(p: np.ndarray) -> np.ndarray:
    p = np.clip(p, 0.0, 1.0)
    return np.where(p <= 0.0031308, 12.92 * p, 1.055 * np.maximum(p, 1e-9) ** (1 / 2.4) - 0.055)


def film(strength: float) -> Callable[[np.ndarray], np.ndarray]:
    """S-curve over sRGB: shadows deeper, highlights rolled off."""

    def curve(p: np.ndarray) -> np.ndarray:
        c = srgb(p)
        return c + strength * (c * c * (3.0 - 2.0 * c) - c)

    return curve


def shoulder(p: np.ndarray) -> np.ndarray:
    """A dash-cam's curve: steep in the dark, with a soft shoulder."""
    return srgb(1.0 - np.exp(-2.2 * p)) / srgb(np.array(1.0 - np.exp(-2.2)))


def noisy(code: np.ndarray, rng: np.random.Generator, sigma: float = 1.0) -> np.ndarray:
    return np.clip(np.rint(255.0 * code + rng.normal(0.0, sigma, code.shape)), 0, 255).astype(np.uint8)


def plain(light: Light) -> np.ndarray:
    return noisy(srgb(light.linear), light.rng)


def locally_toned(light: Light) -> np.ndarray:
    """Local contrast: the picture over its own blurred luminance, in logarithms."""
    log = np.log(np.maximum(light.linear, 1e-3))
    base = cv2.GaussianBlur(log, (0, 0), 0.12 * log.shape[1])
    return noisy(srgb(np.exp(0.65 * base + 1.15 * (log - base) + 0.35 * np.log(0.5))), light.rng)


def equalised(light: Light) -> np.ndarray:
    return cv2.createCLAHE(1.6, (4, 4)).apply(plain(light))


def sharpened_jpeg(light: Light) -> np.ndarray:
    image = plain(light).astype(float)
    sharp = np.clip(image + 0.8 * (image - cv2.GaussianBlur(image, (0, 0), 1.2)), 0, 255).astype(np.uint8)
    return cv2.imdecode(cv2.imencode(".jpg", sharp, [cv2.IMWRITE_JPEG_QUALITY, 80])[1], 0)


def vignetted(light: Light) -> np.ndarray:
    rows, cols = light.linear.shape
    v, u = np.mgrid[:rows, :cols]
    square = ((v - rows / 2) ** 2 + (u - cols / 2) ** 2) / CAMERA.focal_length**2
    return plain(replace(light, linear=light.linear / (1.0 + square) ** 2))


def wet(light: Light) -> np.ndarray:
    """A mirror of the sky by Fresnel's law for water, seven tenths of the road covered; no road marks shine."""
    sine = np.sin(np.maximum(light.below, 0.0))
    root = np.sqrt(1.33**2 - 1.0 + sine**2)
    across, along = ((sine - root) / (sine + root)) ** 2, ((1.77 * sine - root) / (1.77 * sine + root)) ** 2
    mirror = np.where(light.below > 0.0, 0.7 * 0.5 * (across + along), 0.0)
    return plain(replace(light, linear=light.linear + mirror * light.mirrored))


def bonnet(light: Light) -> np.ndarray:
    rows, cols = light.linear.shape
    v, u = np.mgrid[:rows, :cols]
    edge = rows * (0.80 + 0.1 * ((u - cols / 2) / (cols / 2)) ** 2)
    dull = 0.35 + 0.25 * (v - 0.8 * rows) / rows
    return plain(replace(light, linear=np.where(v > edge, dull, light.linear)))


def dirty(light: Light) -> np.ndarray:
    rows, cols = light.linear.shape
    v, u = np.mgrid[:rows, :cols]
    linear = light.linear
    for _ in range(5):
        row, col = light.rng.uniform(0.3, 0.55) * rows, light.rng.uniform(0.2, 0.8) * cols
        blob = 0.4 * np.exp(-((v - row) ** 2 + (u - col) ** 2) / (0.05 * cols) ** 2)
        linear = linear * (1.0 - blob) + 0.35 * blob
    return plain(replace(light, linear=linear))


def glaring(light: Light) -> np.ndarray:
    """The sun 7° up and 4° aside, and the veil of the windscreen, which falls off with the square of the angle."""
    column = CAMERA.principal_point[0] + 0.07 * CAMERA.focal_length
    across, up = (np.arange(CAMERA.width) - column) / CAMERA.focal_length, light.below + np.radians(7.0)
    veil = 0.003 / np.maximum(across**2 + up**2, 1e-5)
    return plain(replace(light, linear=light.linear + veil))


def walled(light: Light) -> np.ndarray:
    """A wall of a third of the sky's light across the road, 65 m ahead and higher than the image."""
    behind = light.below[:, 0] < CAMERA.mount_height / 65.0
    wall = light.linear[0, 0] - 0.65 * light.mirrored[np.argmin(behind)]
    return plain(replace(light, linear=np.where(behind[:, None], wall, light.linear)))


def convex(share: float) -> Callable[[np.ndarray], np.ndarray]:
    """Skies that are level above 0.16 rad and darken down to the horizon by a share a 120th of a radian."""
    return lambda above: (1.0 - share) ** (-120.0 * np.minimum(np.maximum(above, 0.0), 0.16))


@dataclass(frozen=True)
class Kind:
    """How a picture is taken, and what of the scene is changed."""

    taken: Callable[[Light], np.ndarray] = plain
    asphalt: float = 0.25  # shares of the airlight
    airlight: float = 0.55  # share of full scale
    sky: Callable[[np.ndarray], np.ndarray] | None = None


KINDS = {
    "plain": Kind(),
    "film .5": Kind(lambda light: noisy(film(0.5)(light.linear), light.rng)),
    "film 1": Kind(lambda light: noisy(film(1.0)(light.linear), light.rng)),
    "gamma 2.5": Kind(lambda light: noisy(np.clip(light.linear, 0, 1) ** (1 / 2.5), light.rng)),
    "dash-cam": Kind(lambda light: noisy(np.clip(shoulder(light.linear), 0, 1), light.rng)),
    "local tone": Kind(locally_toned),
    "clahe": Kind(equalised),
    "jpeg sharp": Kind(sharpened_jpeg),
    "overexposed": Kind(airlight=1.25),
    "bright road .45": Kind(asphalt=0.45),
    "bright road .65": Kind(asphalt=0.65),
    "vignetting": Kind(vignetted),
    "wet": Kind(wet),
    "bonnet": Kind(bonnet),
    "dirt": Kind(dirty),
    "glare": Kind(glaring),
    "wall": Kind(walled),
    "convex sky 1": Kind(sky=convex(0.01), airlight=0.35),
    "convex sky 2": Kind(sky=convex(0.02), airlight=0.25),
    "convex sky 3": Kind(sky=convex(0.03), airlight=0.2),
    "overcast over dark land, clipped": Kind(sky=lambda above: 1.0 + 1.2 * above, airlight=0.85),
}


def draw(name: str, visibility: float, seed: int) -> np.ndarray:
    """Grey image of a kind of camera, whose pitch is off by about a tenth of a degree."""
    kind, rng = KINDS[name], np.random.default_rng(seed + 50)
    camera = replace(CAMERA, pitch=CAMERA.pitch + float(rng.normal(0.0, np.radians(0.1))))
    level = 255.0 * kind.airlight
    scene = Road(visibility, level, kind.asphalt * level, 0.75 * level, 0.2 * level, camera=camera, patch_contrast=0.05)
    plain_light = replace(scene, camera=replace(camera, response=Response.LINEAR))
    fine = scan(plain_light, seed, 2)
    linear = fogged(scene, *fine).reshape(camera.height, 2, camera.width, 2).mean(axis=(1, 3)) / 255.0
    below = np.arctan((np.arange(camera.height)[:, None] - camera.horizon_row) / camera.focal_length)
    if kind.sky is not None:
        linear = np.where(below < 0.0, linear * kind.sky(-below), linear)
    length = camera.mount_height / np.maximum(np.sin(np.maximum(below, 1e-4)), 1e-4)
    return kind.taken(Light(linear, below, kind.airlight * np.exp(-3.0 * length / visibility), rng))


def views(name: str, seed: int) -> np.ndarray:
    """Grey image of something ahead that is no lane in fog, in clear air."""
    rng, camera = np.random.default_rng(seed + 9), CAMERA
    v, u = np.mgrid[: camera.height, : camera.width].astype(float)
    apart, below = np.abs(u - camera.principal_point[0]), v - camera.horizon_row
    scene = Road(1e9, 140.0, 35.0, 105.0, 28.0, camera=replace(camera, response=Response.LINEAR), patch_contrast=0.05)
    light = fogged(scene, *scan(scene, seed, 2)).reshape(camera.height, 2, camera.width, 2).mean(axis=(1, 3)) / 255.0
    hills = (below < 0.0) & (below > -20.0 - 15.0 * np.sin(u / 60.0 + seed))
    if name == "arch":
        light = np.full(light.shape, 0.6)
        light[(apart < 180.0) & ~((apart < rng.uniform(60, 110)) & (below > -40.0)) & (v > 60.0)] = 0.38
        light[360:] = 0.06
    elif name == "bonnet":
        light = np.where(hills, 0.12, light)
        edge = camera.height * (0.62 + 0.02 * seed) + 18.0 * (apart / 320.0) ** 2
        shine = 0.33 - 0.25 * (v - edge) / camera.height + 0.1 * np.exp(-np.maximum(v - edge, 0.0) / 30.0)
        light = np.where(v > edge, shine, light)
    elif name == "tower":
        light = np.where((apart < 70.0) & (v > 40.0), 0.25, np.where(below > 30.0, 0.12, 0.7))
    elif name == "trees":
        covered = (below < 2.0) & (below > -110.0 - 20.0 * np.sin(u / 40.0)) & (apart > 14.0)
        light = np.where(covered, 0.03 + 0.02 * rng.random(light.shape), light)
    elif name == "wall":
        light = np.where(below < 40.0, 0.75 - 0.001 * v, 0.3 * (1.0 + 0.1 * rng.standard_normal(light.shape)))
    return noisy(srgb(light), rng)
