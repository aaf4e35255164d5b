"""Fog on images from disk: Koschmieder's law on what the pixel values stand for, over a depth map."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.files.atomic import refuse_existing
from fogsim.offline.image_files import DepthMap, Pixels, read_distance, read_image, write_image
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera
from fogsim.values.camera_response import exposure_of, respond

LEAST_SKY = 0.001
"""Share of the image that must be sky for the airlight to be taken from it; the brightest such share is taken else."""


def fog_image(
    image: Pixels, distance: NDArray[np.float64], visibility: float, camera: Camera, airlight: NDArray[np.float64]
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
        Pixel values of the airlight.

    Returns
    -------
    array like `image`
        Fogged pixel values.

    Raises
    ------
    InputError
        If the visibility is not positive.
    """
    if not visibility > 0:
        raise InputError(f"--visibility must be a positive length in metres, got {visibility!r}")
    extinction = extinction_from_visibility(visibility)
    if extinction == 0:
        return image.copy()
    full = full_scale(image, camera)
    colours = image.reshape(*image.shape[:2], -1)
    channels = min(colours.shape[2], 3)
    transmittance = np.exp(-extinction * distance)[..., None]
    light = exposure_of(colours[..., :channels] / full, camera.response, camera.black_level)
    air = exposure_of(airlight[:channels] / full, camera.response, camera.black_level)
    fogged = respond(light * transmittance + air * (1.0 - transmittance), camera.response, camera.black_level)
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


def airlight_of(image: Pixels, distance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Pixel values that an image itself suggests for its airlight.

    The median of the sky; of an image without sky, the mean of its brightest thousandth.

    Parameters
    ----------
    image : (rows, cols) or (rows, cols, channels) uint8 or uint16
        Pixel values.
    distance : (rows, cols) float64
        Distances [m]; ``inf`` for the sky.

    Returns
    -------
    (channels,) float64
        Pixel values, three at most.
    """
    colours = image.reshape(-1, 1 if image.ndim == 2 else image.shape[2])[:, :3].astype(np.float64)
    sky = np.isinf(distance).reshape(-1)
    if sky.mean() >= LEAST_SKY:
        return np.asarray(np.median(colours[sky], axis=0))
    brightest = np.argsort(colours.sum(axis=1))[-max(1, round(LEAST_SKY * len(colours))) :]
    return np.asarray(colours[brightest].mean(axis=0))


def fog_file(
    image: Path,
    depth: DepthMap,
    visibility: float,
    camera: Camera,
    out: Path,
    airlight: tuple[float, ...] | None = None,
    *,
    overwrite: bool = False,
) -> NDArray[np.float64]:
    """Put homogeneous fog on an image file.

    Parameters
    ----------
    image : Path
        The image, of the camera's size.
    depth : DepthMap
        Its depth map, of the same size.
    visibility : float
        Meteorological visibility V_met [m].
    camera : Camera
        The calibration, whose response says what pixel values stand for.
    out : Path
        The fogged image.
    airlight : tuple of float or None
        Pixel value of the airlight: one, or red, green and blue; None to take it from the image (`airlight_of`).
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
    if out.exists() and any(given.exists() and out.samefile(given) for given in (image, depth.path)):
        raise InputError(f"--out {out} would replace what is read; give another name")
    refuse_existing(out, overwrite)
    pixels = read_image(image)
    if pixels.shape[:2] != (camera.height, camera.width):
        rows, columns = pixels.shape[:2]
        raise InputError(
            f"{image}: the image has {columns} × {rows} pixels, the camera {camera.width} × {camera.height}; "
            "they must be the same"
        )
    distance = read_distance(depth, camera)
    colours = min(3, 1 if pixels.ndim == 2 else pixels.shape[2])
    air = airlight_of(pixels, distance) if airlight is None else _given_airlight(airlight, colours, pixels, camera)
    write_image(out, fog_image(pixels, distance, visibility, camera, air))
    return air[::-1]


def _given_airlight(airlight: tuple[float, ...], colours: int, pixels: Pixels, camera: Camera) -> NDArray[np.float64]:
    """Airlight in the order of the image's channels."""
    full = full_scale(pixels, camera)
    if len(airlight) not in (1, colours):
        raise InputError(f"--airlight must be one pixel value or {colours}, got {len(airlight)}")
    if not all(0 <= value <= full for value in airlight):
        told = ", ".join(f"{value:g}" for value in airlight)
        raise InputError(f"--airlight must lie within 0 … {full:g}, the pixel values of this image, got {told}")
    return np.broadcast_to(np.array(airlight[::-1], dtype=np.float64), (colours,)).copy()
