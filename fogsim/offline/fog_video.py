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
from fogsim.offline.road_plane import RoadPlane
from fogsim.offline.source import VideoFile
from fogsim.offline.video_file import VideoWriter, refuse_unfit_video
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
    """Put homogeneous fog on a video of a flat road; under its final name only when it is whole.

    Parameters
    ----------
    video : VideoFile
        The video, of the camera's size.
    road : RoadPlane
        The camera above its road.
    visibility : float
        Meteorological visibility V_met [m].
    out : Path
        The fogged video, ``.mp4``.
    airlight : tuple of float or None
        Pixel value of the airlight: one, or red, green and blue; None to take it from the first frame's sky, once for
        all frames, lest it flicker.
    layer : FogLayer or None
        Airlight by elevation and path; None for one that is the same everywhere.
    overwrite : bool
        True to replace a file that is there.

    Yields
    ------
    (3,) float64
        The airlight that is used, red first, after each frame.

    Raises
    ------
    InputError
        If anything does not fit, there is a file `out` that must not be replaced, or, when `out` is written, the video
        is cut off or damaged.
    """
    camera = road.calibration.camera
    refuse_unfit_video(out, video.paths, camera, kind="fogged", overwrite=overwrite)
    refuse_other_size(video.path, video.size, camera)
    distance, sines = road.distance(), road.sines()
    air: NDArray[np.float64] | None = None
    damage = ""
    with VideoWriter(out, video.period) as writer:
        for picture in video.pictures():
            if picture.image is None:
                damage = picture.error
                continue
            if air is None:
                air = _airlight(picture.image, distance, camera, airlight, layer)
            writer.write(fog_image(picture.image, distance, visibility, camera, air, layer, sines))
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
    """Airlight of a video, as given or from the sky of its first frame, red first."""
    if given is not None:
        return np.asarray(given_airlight(given, 3, first, camera)[::-1])
    return in_layer(airlight_of(first, distance, BRIGHTEST_ABOVE_ROAD), first, camera, layer)
