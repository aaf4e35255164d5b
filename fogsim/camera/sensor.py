"""A camera that takes one picture after another."""

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.camera.exposure import (
    AutoExposure,
    Pixels,
    Sensor,
    block_means,
    expose,
    followed,
    metered_luminance,
    sensor_at,
    wanted_saturation,
)
from fogsim.camera.glare import LensGlare
from fogsim.values import Camera, View


def supersampled(camera: Camera, side: int) -> Camera:
    """Camera with side × side pixels in the place of each.

    The centre of pixel u lies at integer u, so its left border is at u − ½ and what was at u is now at side · (u + ½) −
    ½.
    """
    u0, v0 = (side * (centre + 0.5) - 0.5 for centre in camera.principal_point)
    return dataclasses.replace(
        camera,
        width=side * camera.width,
        height=side * camera.height,
        focal_length=side * camera.focal_length,
        principal_point=(u0, v0),
    )


def averaged(radiance: NDArray[np.float32], side: int) -> NDArray[np.float32]:
    """Mean of each pixel's samples (side · rows, side · cols, 3) [cd/m²]; these themselves if there is one a pixel."""
    if side == 1:
        return radiance
    rows, cols = radiance.shape[0] // side, radiance.shape[1] // side
    out = np.empty((rows, cols, 3), np.float32)
    lines = np.ascontiguousarray(radiance[: side * rows], dtype=np.float32).reshape(side * rows, -1)
    block_means(lines, side, out)
    return out


def middle_samples(view: View, side: int) -> View:
    """View with one sample a pixel: the one in the middle, or for an even number the next to its lower right.

    Samples are chosen, not averaged: a mean of distances is the distance of nothing.
    """
    if side == 1:
        return view
    pick = slice(side // 2, None, side)
    layers: dict[str, Any] = {field.name: getattr(view, field.name) for field in dataclasses.fields(view)}
    kept: dict[str, Any] = {
        name: layer if layer is None else np.ascontiguousarray(layer[pick, pick]) for name, layer in layers.items()
    }
    return dataclasses.replace(view, **kept)


class CameraSensor:
    """Takes the pictures of one run; what it remembers from one to the next is the exposure (`period` [s])."""

    def __init__(
        self,
        camera: Camera,
        sensor: Sensor,
        auto: AutoExposure | None,
        shading: float,
        period: float,
        glare: float = 0.0,
    ) -> None:
        self._camera = camera
        self._sensor = sensor
        self._auto = auto
        self._shading = lens_shading(camera, shading)[..., None] if shading > 0 else None
        self._glare = LensGlare(camera, glare) if glare > 0 else None
        self._period = period
        self._saturation: float | None = None

    def reset(self) -> None:
        """Begin a run: the first picture sets the exposure, as if the camera had long looked at what it shows."""
        self._saturation = None

    @property
    def share_of_longest_exposure(self) -> float:
        """Next exposure time over the longest [-]: 1 if fixed, 0 before the first picture, whose light sets it."""
        if self._auto is None:
            return 1.0
        return 0.0 if self._saturation is None else min(1.0, self._auto.ungained / self._saturation)

    def take(self, radiance: NDArray[np.float32], rng: np.random.Generator) -> Pixels:
        """Picture (rows, cols, 3) uint8 at the exposure that the pictures before have set (`radiance` [cd/m²])."""
        if self._shading is not None:
            radiance = radiance * self._shading
        # Metered without glare: how bright a lamp must be to scatter light depends on the exposure.
        sensor = self._sensor_for(radiance)
        if self._glare is not None:
            radiance = self._glare.scatter(radiance, sensor.saturation_luminance)
        return expose(radiance, sensor, self._camera.response, rng)

    def _sensor_for(self, radiance: NDArray[np.float32]) -> Sensor:
        if self._auto is None:
            return self._sensor
        wanted = wanted_saturation(metered_luminance(radiance, self._auto.metering), self._auto)
        now = wanted if self._saturation is None else self._saturation
        # What this picture shows sets the exposure of the next.
        self._saturation = followed(now, wanted, self._auto, self._period)
        return sensor_at(self._sensor, now, self._auto)


def lens_shading(camera: Camera, strength: float) -> NDArray[np.float32]:
    """Light that each pixel (rows, cols) gets, over that on the optical axis: 1 − strength · (1 − cos⁴ θ).

    cos⁴ of the angle θ to the optical axis is the natural vignetting of a thin lens; designs of lenses and correction
    in the camera take part of it back.
    """
    u0, v0 = camera.principal_point
    across = (np.arange(camera.width) - u0) / camera.focal_length
    along = (np.arange(camera.height) - v0) / camera.focal_length
    # cos² θ = 1 / (1 + tan² θ)
    fourth = (1.0 + across**2 + along[:, None] ** 2) ** -2
    return (1.0 - strength * (1.0 - fourth)).astype(np.float32)
