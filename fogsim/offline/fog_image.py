"""Fog on images from disk: Koschmieder's law on what the pixel values stand for, over a depth map."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.offline.image_files import (
    DepthMap,
    Pixels,
    read_distance,
    read_image,
    refuse_unwritable_image,
    write_image,
)
from fogsim.offline.layered_fog import FogLayer, elevation_sines
from fogsim.offline.road_plane import RoadPlane
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera
from fogsim.values.camera_response import exposure_of, respond

LEAST_SKY = 0.001
"""Share of the image that must be sky for the airlight to be taken from it; the brightest such share is taken else."""


BRIGHTEST_ABOVE_ROAD = 0.2
"""Share of what is above the horizon of a road without depth map that its airlight is taken from: woods are darker."""


def fog_image(
    image: Pixels,
    distance: NDArray[np.float64],
    visibility: float,
    camera: Camera,
    airlight: NDArray[np.float64],
    layer: FogLayer | None = None,
    sines: NDArray[np.float64] | None = None,
) -> Pixels:
    """Put homogeneous fog on an image, L = L0 e^(−k d) + L∞ (1 − e^(−k d)) with k = ln 20 / V_met (Koschmieder 1924).

    Pixel values become light by the inverse of the camera's response and pixel values again behind the fog.

    Parameters
    ----------
    image : (rows, cols) or (rows, cols, channels) uint8 or uint16
        Pixel values; a fourth channel is opacity and is kept.
    distance : (rows, cols) float64
        Distance along the ray [m]; ``inf`` for the sky.
    visibility : float
        Meteorological visibility V_met [m]; ``inf`` gives the image back.
    camera : Camera
        Its response and, for images of 16 bits, its bit depth.
    airlight : (channels,) float64
        Pixel values of the airlight; with a layer, of what of it is seen level.
    layer : FogLayer or None
        Airlight by elevation and path; None for one that is the same everywhere.
    sines : (rows, cols) float64 or None
        Of the elevations of the pixels' rays, for a layer; None for those of the pinhole.

    Returns
    -------
    array like `image`
        Fogged pixel values.

    Raises
    ------
    InputError
        If the visibility is not positive, or the layer is not known.
    """
    if not visibility > 0:
        raise InputError(f"--visibility must be a positive length in metres, got {visibility!r}")
    extinction = extinction_from_visibility(visibility)
    if extinction == 0:
        return image.copy()
    full = full_scale(image, camera)
    colours = image.reshape(*image.shape[:2], -1)
    channels = min(colours.shape[2], 3)
    if layer is None:
        kept = np.exp(-extinction * distance)
        added = 1.0 - kept
    else:
        slopes = elevation_sines(camera) if sines is None else sines
        kept, added = layer.light(distance, slopes, visibility, camera.mount_height)
    light = exposure_of(colours[..., :channels] / full, camera.response, camera.black_level)
    air = exposure_of(airlight[:channels] / full, camera.response, camera.black_level)
    fogged = respond(light * kept[..., None] + air * added[..., None], camera.response, camera.black_level)
    out = colours.copy()
    out[..., :channels] = np.rint(np.clip(fogged, 0.0, 1.0) * full)
    return out.reshape(image.shape)


def full_scale(image: Pixels, camera: Camera) -> float:
    """Largest pixel value that an image can have.

    Parameters
    ----------
    image : (rows, cols[, channels]) uint8 or uint16
        Pixel values.
    camera : Camera
        Its bit depth, for images of 16 bits.
    """
    if image.dtype == np.uint16 and camera.bits > 8:
        return float(2**camera.bits - 1)
    return float(np.iinfo(image.dtype).max)


def airlight_of(image: Pixels, distance: NDArray[np.float64], share: float = 1.0) -> NDArray[np.float64]:
    """Pixel values that an image itself suggests for its airlight.

    The median of the sky, or of its brightest part; of an image without sky, the mean of its brightest thousandth.

    Parameters
    ----------
    image : (rows, cols) or (rows, cols, channels) uint8 or uint16
        Pixel values.
    distance : (rows, cols) float64
        Distances [m]; ``inf`` for the sky.
    share : float
        Share of the sky, the brightest, whose median is taken [-].

    Returns
    -------
    (channels,) float64
        Pixel values, three at most.
    """
    colours = image.reshape(-1, 1 if image.ndim == 2 else image.shape[2])[:, :3].astype(np.float64)
    sky = np.isinf(distance).reshape(-1)
    if sky.mean() >= LEAST_SKY:
        above = colours[sky]
        above = above[np.argsort(above.sum(axis=1))[-max(1, round(share * len(above))) :]] if share < 1.0 else above
        return np.asarray(np.median(above, axis=0))
    brightest = np.argsort(colours.sum(axis=1))[-max(1, round(LEAST_SKY * len(colours))) :]
    return np.asarray(colours[brightest].mean(axis=0))


def in_layer(
    airlight: NDArray[np.float64], image: Pixels, camera: Camera, layer: FogLayer | None
) -> NDArray[np.float64]:
    """Pixel values of the airlight seen level in a layer, from those of an even one.

    Parameters
    ----------
    airlight : (channels,) float64
        Pixel values.
    image : (rows, cols[, channels]) uint8 or uint16
        The image.
    camera : Camera
        Its response.
    layer : FogLayer or None
        None for an even airlight, which it stays.
    """
    if layer is None:
        return airlight
    full = full_scale(image, camera)
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
    """Put homogeneous fog on an image file.

    Parameters
    ----------
    image : Path
        The image, of the camera's size.
    depth : DepthMap or RoadPlane
        Its depth map, of the same size; or a flat road below the horizon and sky above it.
    visibility : float
        Meteorological visibility V_met [m].
    camera : Camera
        The calibration, whose response says what pixel values stand for.
    out : Path
        The fogged image.
    airlight : tuple of float or None
        Pixel value of the airlight: one, or red, green and blue; None to take it from the image (`airlight_of`).
    layer : FogLayer or None
        Airlight by elevation and path; None for one that is the same everywhere.
    overwrite : bool
        True to replace a file that is there.

    Returns
    -------
    (channels,) float64
        The airlight that was used, red first.

    Raises
    ------
    InputError
        If anything does not fit, or there is a file `out` that must not be replaced.
    """
    read = (image, depth.path) if isinstance(depth, DepthMap) else (image,)
    refuse_unwritable_image(out, "--out", overwrite=overwrite, read=read)
    pixels = read_image(image)
    refuse_other_size(image, (pixels.shape[1], pixels.shape[0]), camera)
    if isinstance(depth, DepthMap):
        distance, share, sines = read_distance(depth, camera), 1.0, None
    else:
        distance, share, sines = depth.distance(), BRIGHTEST_ABOVE_ROAD, depth.sines()
    colours = min(3, 1 if pixels.ndim == 2 else pixels.shape[2])
    if airlight is None:
        air = in_layer(airlight_of(pixels, distance, share), pixels, camera, layer)
    else:
        air = given_airlight(airlight, colours, pixels, camera)
    write_image(out, fog_image(pixels, distance, visibility, camera, air, layer, sines))
    return air[::-1]


def refuse_other_size(path: Path, size: tuple[int, int], camera: Camera) -> None:
    """Refuse images of another size than their camera's.

    Parameters
    ----------
    path : Path
        The image or video.
    size : tuple of int
        Its columns and rows [px].
    camera : Camera
        The calibration.

    Raises
    ------
    InputError
        If they differ.
    """
    if size != (camera.width, camera.height):
        raise InputError(
            f"{path}: the image has {size[0]} × {size[1]} pixels, the camera {camera.width} × {camera.height}; "
            "they must be the same"
        )


def given_airlight(airlight: tuple[float, ...], colours: int, pixels: Pixels, camera: Camera) -> NDArray[np.float64]:
    """Airlight that a user gives, blue first as images are stored.

    Parameters
    ----------
    airlight : tuple of float
        One pixel value, or one a colour, red first.
    colours : int
        How many colours the image has.
    pixels : (rows, cols[, channels]) uint8 or uint16
        The image.
    camera : Camera
        Its calibration.

    Raises
    ------
    InputError
        If they are not as many as colours, or beyond the image's pixel values.
    """
    full = full_scale(pixels, camera)
    if len(airlight) not in (1, colours):
        raise InputError(f"--airlight must be one pixel value or {colours}, got {len(airlight)}")
    if not all(0 <= value <= full for value in airlight):
        told = ", ".join(f"{value:g}" for value in airlight)
        raise InputError(f"--airlight must lie within 0 … {full:g}, the pixel values of this image, got {told}")
    return np.broadcast_to(np.array(airlight[::-1], dtype=np.float64), (colours,)).copy()
