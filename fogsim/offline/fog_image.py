"""Fog on images from disk: Koschmieder's law on linear light, with a depth map."""

from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere import Droplets, slant_airlight, slant_share
from fogsim.errors import InputError
from fogsim.offline.image_files import (
    DepthMap,
    Pixels,
    read_distance,
    read_image,
    refuse_unwritable_image,
    write_image,
)
from fogsim.offline.rectification import RoadPlane
from fogsim.offline.video_source import VideoFile, VideoWriter, refuse_unfit_video
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, CameraPose, FogField
from fogsim.values.camera_response import exposure_of, respond
from fogsim.values.fog import airlight_share
from fogsim.values.pinhole import ray_from_pixel
from fogsim.vision.restoration.picture import largest_value

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class FogLayer:
    """Fog between land of an albedo [-] and an overcast sky, up to a height [m]."""

    ground_albedo: float
    height: float

    def __post_init__(self) -> None:
        """Raise InputError if a number is out of range."""
        if not 0.0 <= self.ground_albedo <= 1.0:
            raise InputError(f"--ground-albedo must lie within 0 … 1, got {self.ground_albedo!r}")
        if not 0.0 < self.height < np.inf:
            raise InputError(f"--layer-height must be a positive length in metres, got {self.height!r}")

    @property
    def level(self) -> float:
        """Airlight seen level over the luminance of the sky above, on the mean that of a white surface below it [-]."""
        return airlight_share(self.ground_albedo)

    def light(self, distance: Floats, sine: Floats, visibility: float, mount_height: float) -> tuple[Floats, Floats]:
        """Share of the fog-free light that is left, and added airlight over its level value [-], both (rows, cols).

        From distance along the ray [m] (``inf`` for sky), sine of its elevation, V_met and camera height [m]. The sky's
        share includes what makes it brighter above fog than without. InputError if the camera is above the layer or the
        fog is too dense.
        """
        extinction = extinction_from_visibility(visibility)
        field = FogField(extinction, (0.0, 0.0, 0.0), top=self.height, ground_albedo=self.ground_albedo)
        around = slant_airlight(field, mount_height, Droplets.MODERATE_RADIATION)
        out_of_fog = (self.height - mount_height) / np.maximum(sine, 1e-9)
        lost = -np.expm1(-extinction * np.minimum(distance, out_of_fog))
        kept = (1.0 - lost) * np.where(np.isinf(distance), around.sky, 1.0)
        return kept, lost * slant_share(around, sine, lost)


def _elevation_sines(camera: Camera) -> Floats:
    """Sines of the elevations of a pinhole's rays, (rows, cols)."""
    rows, columns = np.indices((camera.height, camera.width), dtype=np.float64)
    rays = ray_from_pixel(camera, CameraPose((0.0, 0.0, camera.mount_height), 0.0))
    x, y, z = (rays[axis, 0] * columns + rays[axis, 1] * rows + rays[axis, 2] for axis in range(3))
    return np.asarray(z / np.sqrt(x * x + y * y + z * z))


_LEAST_SKY = 0.001
"""Least share of sky in an image from which its airlight is taken; otherwise, the brightest such share is used."""


BRIGHTEST_ABOVE_ROAD = 0.2
"""Share of the area above the horizon for the airlight of a road without depth map, since woods are darker."""


def fog_image(
    image: Pixels,
    distance: NDArray[np.float64],
    visibility: float,
    camera: Camera,
    airlight: NDArray[np.float64],
    layer: FogLayer | None = None,
    sines: NDArray[np.float64] | None = None,
) -> Pixels:
    """Add homogeneous fog to an image, L = L0 e^(−k d) + L∞ (1 − e^(−k d)) with k = ln 20 / V_met (Koschmieder 1924).

    `distance` (rows, cols) is along the ray [m], ``inf`` for sky. Pixel values become light by the inverse of the
    camera's response, and pixel values again behind the fog; a fourth channel is opacity and is kept. `airlight`
    (channels,) is in pixel values. With a layer it is the level airlight, and `sines` are of the elevations of the
    pixels' rays (None for those of the pinhole).
    """
    if not visibility > 0:
        raise InputError(f"--visibility must be a positive length in metres, got {visibility!r}")
    extinction = extinction_from_visibility(visibility)
    if extinction == 0:
        return image.copy()
    full = _full_scale(image, camera)
    colours = image.reshape(*image.shape[:2], -1)
    channels = min(colours.shape[2], 3)
    if layer is None:
        kept = np.exp(-extinction * distance)
        added = 1.0 - kept
    else:
        slopes = _elevation_sines(camera) if sines is None else sines
        kept, added = layer.light(distance, slopes, visibility, camera.mount_height)
    light = exposure_of(colours[..., :channels] / full, camera.response, camera.black_level)
    air = exposure_of(airlight[:channels] / full, camera.response, camera.black_level)
    fogged = respond(light * kept[..., None] + air * added[..., None], camera.response, camera.black_level)
    out = colours.copy()
    out[..., :channels] = np.rint(np.clip(fogged, 0.0, 1.0) * full)
    return out.reshape(image.shape)


def _full_scale(image: Pixels, camera: Camera) -> float:
    """Largest pixel value of an image, by its type and the camera's bit depth."""
    if image.dtype == np.uint16 and camera.bits > 8:
        return float(2**camera.bits - 1)
    return float(np.iinfo(image.dtype).max)


def airlight_of(image: Pixels, distance: NDArray[np.float64], share: float = 1.0) -> NDArray[np.float64]:
    """Pixel values (channels,) of the airlight, three at most, estimated from an image itself.

    It is the median of the sky or of its brightest `share`; without sky, the mean of the brightest thousandth.
    """
    colours = image.reshape(-1, 1 if image.ndim == 2 else image.shape[2])[:, :3].astype(np.float64)
    sky = np.isinf(distance).reshape(-1)
    if sky.mean() >= _LEAST_SKY:
        above = colours[sky]
        above = above[np.argsort(above.sum(axis=1))[-max(1, round(share * len(above))) :]] if share < 1.0 else above
        return np.asarray(np.median(above, axis=0))
    brightest = np.argsort(colours.sum(axis=1))[-max(1, round(_LEAST_SKY * len(colours))) :]
    return np.asarray(colours[brightest].mean(axis=0))


def _in_layer(
    airlight: NDArray[np.float64], image: Pixels, camera: Camera, layer: FogLayer | None
) -> NDArray[np.float64]:
    """Pixel values of the level airlight in a layer, from those of a uniform one."""
    if layer is None:
        return airlight
    full = _full_scale(image, camera)
    light = layer.level * exposure_of(airlight / full, camera.response, camera.black_level)
    return np.asarray(full * respond(light, camera.response, camera.black_level))


def fog_file(
    image: Path,
    depth: DepthMap | RoadPlane,
    visibility: float,
    camera: Camera,
    out: Path,
    airlight: tuple[float, ...] | None = None,
    *,
    layer: FogLayer | None = None,
    overwrite: bool = False,
) -> NDArray[np.float64]:
    """Write an image file with homogeneous fog of V_met [m]; return the airlight in pixel values, red first.

    `airlight` has one pixel value or red, green and blue; None estimates it from the image (`airlight_of`).
    """
    read = (image, depth.path) if isinstance(depth, DepthMap) else (image,)
    refuse_unwritable_image(out, "--out", overwrite=overwrite, read=read)
    pixels = read_image(image)
    _refuse_other_size(image, (pixels.shape[1], pixels.shape[0]), camera)
    try:
        largest_value(pixels if pixels.ndim == 2 else pixels[..., :3], camera)
    except InputError as error:
        raise InputError(f"{image}: {error}") from error
    if isinstance(depth, DepthMap):
        distance, share, sines = read_distance(depth, camera), 1.0, None
    else:
        distance, share, sines = depth.distance(), BRIGHTEST_ABOVE_ROAD, depth.sines()
    colours = min(3, 1 if pixels.ndim == 2 else pixels.shape[2])
    if airlight is None:
        air = _in_layer(airlight_of(pixels, distance, share), pixels, camera, layer)
    else:
        air = _given_airlight(airlight, colours, pixels, camera)
    write_image(out, fog_image(pixels, distance, visibility, camera, air, layer, sines))
    return air[::-1]


def _refuse_other_size(path: Path, size: tuple[int, int], camera: Camera) -> None:
    """Raise InputError if images have another size (columns, rows) than their camera's."""
    if size != (camera.width, camera.height):
        raise InputError(
            f"{path}: the image has {size[0]} × {size[1]} pixels, the camera {camera.width} × {camera.height}; "
            "they must be the same"
        )


def _given_airlight(airlight: tuple[float, ...], colours: int, pixels: Pixels, camera: Camera) -> NDArray[np.float64]:
    """A user's airlight as pixel values, blue first as images are stored; InputError if number or range do not fit."""
    full = _full_scale(pixels, camera)
    if len(airlight) not in (1, colours):
        raise InputError(f"--airlight must be one pixel value or {colours}, got {len(airlight)}")
    if not all(0 <= value <= full for value in airlight):
        given = ", ".join(f"{value:g}" for value in airlight)
        raise InputError(f"--airlight must lie within 0 … {full:g}, the pixel values of this image, got {given}")
    return np.broadcast_to(np.array(airlight[::-1], dtype=np.float64), (colours,)).copy()


def fog_video(
    video: VideoFile,
    road: RoadPlane,
    visibility: float,
    out: Path,
    airlight: tuple[float, ...] | None = None,
    *,
    layer: FogLayer | None = None,
    overwrite: bool = False,
) -> Generator[NDArray[np.float64]]:
    """Write a video of a flat road with homogeneous fog of V_met [m]; yield the airlight, red first, after each frame.

    `airlight` has one pixel value or red, green and blue; None estimates it from the first frame's sky, once for all
    frames to avoid flicker. The file has its final name only when complete.
    """
    camera = road.calibration.camera
    refuse_unfit_video(out, video.paths, camera, kind="fogged", overwrite=overwrite)
    _refuse_other_size(video.path, video.size, camera)
    distance, sines = road.distance(), road.sines()
    air: NDArray[np.float64] | None = None
    damage = ""
    with VideoWriter(out) as writer:
        for picture in video.pictures():
            if picture.image is None:
                damage = damage or picture.error
                continue
            if air is None:
                air = _airlight(picture.image, distance, camera, airlight, layer)
            fogged = fog_image(picture.image, distance, visibility, camera, air, layer, sines)
            writer.write(fogged, picture.time)
            yield air
    if damage:
        raise InputError(f"{damage}; {out} has what could be read")


def _airlight(
    first: NDArray[np.uint8] | NDArray[np.uint16],
    distance: NDArray[np.float64],
    camera: Camera,
    given: tuple[float, ...] | None,
    layer: FogLayer | None,
) -> NDArray[np.float64]:
    """Airlight of a video, given or from the sky of its first frame, red first."""
    if given is not None:
        return np.asarray(_given_airlight(given, 3, first, camera)[::-1])
    return _in_layer(airlight_of(first, distance, BRIGHTEST_ABOVE_ROAD), first, camera, layer)
