"""Contrast restoration of one picture."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.units import LUMINANCE_WEIGHTS
from fogsim.values.camera import Camera
from fogsim.values.camera_response import exposure_of, respond
from fogsim.vision.restoration import light_kernels
from fogsim.vision.restoration.guided_filter import box_mean
from fogsim.vision.restoration.light_kernels import Smoothing
from fogsim.vision.restoration.methods import METHODS, Method
from fogsim.vision.restoration.picture import (
    Floats,
    FoggyPicture,
    Light,
    Pixels,
    Restoration,
    ToneCurve,
    largest_value,
    written_values,
)

KEY = 0.18
"""Luminance that the middle of what is seen gets, relative to full scale [-] (Reinhard et al. 2002)."""

BRIGHT, _WHITE, _DARKEST = 0.99, 1.25, 0.01
"""White is so many times what this share of the picture is darker than; what is darker than that share of the airlight
counts as that [-]."""


def _tone_curve(light: Floats, transmission: Floats, picture: FoggyPicture) -> ToneCurve:
    """Curve that brings out what the fog lets through: L (1 + L / L_w²) / (1 + L) (Reinhard et al. 2002, eq. 4).

    L is light over its logarithmic mean, times 0.18. Unlike the paper's, the mean is weighted by transmission: the sky
    and what the fog has hidden, which are brighter than all else, do not make the road black.

    Takes `light` (rows, cols, channels), `transmission` (rows, cols).
    """
    some = light.astype(np.float64) * picture.airlight
    luminance = some[..., 0] if some.shape[2] == 1 else (some * LUMINANCE_WEIGHTS).sum(axis=2)
    luminance = np.maximum(luminance, _DARKEST * float(picture.airlight.max()))
    weights = transmission.astype(np.float64)
    middle = float(np.exp((weights * np.log(luminance)).sum() / weights.sum()))
    exposure = KEY / middle
    white = max(exposure * _WHITE * float(np.quantile(luminance, BRIGHT)), 1.0)

    def curve(shown: Light) -> Light:
        scaled = exposure * shown
        return np.asarray(scaled * (1.0 + scaled / white**2) / (1.0 + scaled))

    return curve


_STRIDE = 4
"""Every how manyeth pixel of every how manyeth row is looked at for noise and tones."""

_RADIUS, _MORE_NOISE, _COLOUR_NOISE = 2, 4.0, 2.0
"""Windows in which noise is smoothed are 2 r + 1 wide [px]; what counts as noise, in its variance: local variances
scatter, and three channels have more of it than their mean. Chosen on pool 0 of benchmarks/restoration.py."""


def _without_veil(picture: FoggyPicture, transmission: Floats, *, smooths: bool, tone_map: bool) -> Pixels:
    """Undo Koschmieder's law, R = A + (I − A) / t, in pixel values.

    Returns like the picture's (rows, cols, channels) uint8. Takes `transmission` (rows, cols).
    """
    tables = picture.relative_tables()
    smoothing = _smoothing(picture, tables, transmission) if smooths else _no_smoothing()
    curve = None
    if tone_map:
        light = light_kernels.restored_light(picture.pixels, tables, transmission, smoothing, _STRIDE)
        curve = _tone_curve(light, transmission[::_STRIDE, ::_STRIDE], picture)
    values = written_values(picture, curve)
    scale = ((len(values) - 1) * picture.airlight).astype(np.float32)
    return light_kernels.restored_pixels(picture.pixels, tables, transmission, smoothing, scale, values)


def _smoothing(picture: FoggyPicture, tables: Floats, transmission: Floats) -> Smoothing:
    """Local statistics of the luminance, and its noise where least light comes through: the median variance there."""
    weights = np.array(LUMINANCE_WEIGHTS if len(tables) == 3 else (1.0,), np.float32)
    light = light_kernels.luminance(picture.pixels, tables * weights[:, None])
    mean, square = box_mean(light, _RADIUS), box_mean(light * light, _RADIUS)
    some = (slice(None, None, _STRIDE), slice(None, None, _STRIDE))
    veiled = transmission[some] < 1.5 / picture.most_gain
    if not veiled.any():
        return _no_smoothing()
    noise = max(float(np.median((square[some] - mean[some] ** 2)[veiled])), 0.0)
    return Smoothing(light, mean, square, np.float32(_MORE_NOISE * noise), np.float32(_COLOUR_NOISE))


def _no_smoothing() -> Smoothing:
    nothing = np.empty((0, 0), np.float32)
    return Smoothing(nothing, nothing, nothing, np.float32(0.0), np.float32(0.0))


MOST_GAIN = 5.0
"""Most by which light, and with it noise, is amplified if nothing else is asked for [-]; chosen on pool 0 of
benchmarks/restoration.py: more shows vehicles farther away, and more that is none."""

_LARGEST_GAIN = 1000.0
"""Largest bound of the gain [-]; from 255 on, a single step of 8 bits spans the whole range."""

_LEAST_LIGHT = 1e-12
"""Least light that an airlight can have, relative to full scale [-]; no pixel value but black has less."""


def restore_contrast(
    image: Pixels,
    camera: Camera,
    extinction: float | None = None,
    airlight: Sequence[float] | NDArray[np.float64] | None = None,
    *,
    method: str = "planar",
    most_gain: float = MOST_GAIN,
    tone_map: bool = False,
) -> Restoration:
    """Restore the contrast that daytime fog has taken from a picture.

    Parameters
    ----------
    image : (rows, cols) or (rows, cols, 3) uint8 or uint16
        Pixel values, red first.
    camera : Camera
        The assumed calibration: its response says what pixel values stand for, its place where the road is.
    extinction : float or None
        Extinction coefficient k [1/m], ≥ 0: 0 gives the image back; ``planar`` needs it, the others do not use it.
    airlight : (channels,) sequence of float or None
        Pixel values of the airlight, one or one a channel; None to take it from the picture.
    method : str
        A name in `fogsim.vision.restoration.METHODS`.
    most_gain : float
        Most by which light is amplified, 1 … 1000 [-].
    tone_map : bool
        Make the result to be looked at; else its light is that of the scene, at the picture's exposure.

    Returns
    -------
    Restoration
        The restored picture, and the transmission that was undone.

    Raises
    ------
    InputError
        If the image is not of this camera, there is no such method, or a number is out of its range.
    """
    chosen = METHODS.find(method)
    pixels, full = _checked(image, camera)
    if not 1.0 <= most_gain <= _LARGEST_GAIN:
        raise InputError(f"most_gain must lie within 1 … {_LARGEST_GAIN:g}, got {most_gain!r}")
    if extinction is not None and not (extinction >= 0.0 and math.isfinite(extinction)):
        raise InputError(f"extinction must be a finite number of 1/m, at least 0, got {extinction!r}")
    light = _airlight(pixels, camera, full, airlight, chosen)
    shown = np.asarray(full * respond(light, camera.response, camera.black_level))
    if chosen.needs_extinction and extinction == 0.0:
        return Restoration(image.copy(), np.ones(image.shape[:2], np.float32), shown, method)
    picture = FoggyPicture(pixels, camera, full, light, extinction, most_gain)
    transmission = chosen.transmission(picture)
    restored = _without_veil(picture, transmission, smooths=chosen.smooths, tone_map=tone_map)
    return Restoration(restored.reshape(image.shape), transmission, shown, method)


def _checked(image: Pixels, camera: Camera) -> tuple[Pixels, float]:
    """Pixels with an axis of channels, and their largest value."""
    if image.dtype not in (np.uint8, np.uint16) or image.ndim not in (2, 3) or image.shape[2:] not in ((), (1,), (3,)):
        raise InputError(
            f"expected a grey or colour image (rows, cols[, 3]) of uint8 or uint16, got {image.shape} {image.dtype}"
        )
    if image.shape[:2] != (camera.height, camera.width):
        raise InputError(
            f"the image has {image.shape[1]} × {image.shape[0]} pixels, the camera {camera.width} × {camera.height}; "
            "they must be the same"
        )
    pixels: Pixels = image.reshape(*image.shape[:2], -1).copy(order="C")
    return pixels, largest_value(image, camera)


def _airlight(
    pixels: Pixels,
    camera: Camera,
    full: float,
    given: Sequence[float] | NDArray[np.float64] | None,
    method: Method,
) -> Light:
    """Light of the airlight relative to full scale, one a channel."""
    if given is None:
        return method.airlight(pixels, camera, int(full))
    values, channels = np.atleast_1d(np.asarray(given, np.float64)), pixels.shape[2]
    if values.shape not in ((1,), (channels,)):
        raise InputError(f"airlight must be one pixel value or {channels}, got {values.size}")
    light = exposure_of(values / full, camera.response, camera.black_level)
    if not ((light >= _LEAST_LIGHT).all() and (values <= full).all()):
        listed = ", ".join(f"{value:g}" for value in values)
        raise InputError(
            f"airlight must be brighter than black and at most {full:g}, the largest pixel value, got {listed}"
        )
    return np.broadcast_to(light, (channels,)).copy()
