"""Fog on a video from disk, frame by frame."""

from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere import Droplets, slant_airlight, slant_share
from fogsim.errors import InputError
from fogsim.offline.fog_image import (
    BRIGHTEST_ABOVE_ROAD,
    airlight_of,
    fog_image,
    given_airlight,
    in_layer,
    refuse_other_size,
)
from fogsim.offline.rectification import RoadPlane
from fogsim.offline.video_source import VideoFile, VideoWriter, refuse_unfit_video
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, CameraPose, FogField
from fogsim.values.fog import airlight_share
from fogsim.values.pinhole import ray_from_pixel

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


def elevation_sines(camera: Camera) -> Floats:
    """Sines of the elevations of a pinhole's rays, (rows, cols)."""
    rows, columns = np.indices((camera.height, camera.width), dtype=np.float64)
    rays = ray_from_pixel(camera, CameraPose((0.0, 0.0, camera.mount_height), 0.0))
    x, y, z = (rays[axis, 0] * columns + rays[axis, 1] * rows + rays[axis, 2] for axis in range(3))
    return np.asarray(z / np.sqrt(x * x + y * y + z * z))


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
    refuse_other_size(video.path, video.size, camera)
    distance, sines = road.distance(), road.sines()
    air: NDArray[np.float64] | None = None
    damage = ""
    with VideoWriter(out) as writer:
        for picture in video.pictures():
            if picture.image is None:
                damage = picture.error
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
        return np.asarray(given_airlight(given, 3, first, camera)[::-1])
    return in_layer(airlight_of(first, distance, BRIGHTEST_ABOVE_ROAD), first, camera, layer)
