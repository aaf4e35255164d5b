"""Fog on a video from disk, frame by frame."""

from collections.abc import Generator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.offline.fog_image import (
    BRIGHTEST_ABOVE_ROAD,
    airlight_of,
    fog_image,
    given_airlight,
    in_layer,
    refuse_other_size,
)
from fogsim.offline.layered_fog import FogLayer
from fogsim.offline.rectification import RoadPlane
from fogsim.offline.video_source import VideoFile, VideoWriter, refuse_unfit_video
from fogsim.values import Camera


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
        return np.asarray(given_airlight(given, 3, first, camera)[::-1])
    return in_layer(airlight_of(first, distance, BRIGHTEST_ABOVE_ROAD), first, camera, layer)
