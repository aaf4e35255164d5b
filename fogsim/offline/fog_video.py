"""Fog on a video from disk, frame by frame."""

from collections.abc import Generator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.files.atomic import partial_path, publish, refuse_missing_folder
from fogsim.offline.fog_image import (
    BRIGHTEST_ABOVE_ROAD,
    airlight_of,
    fog_image,
    given_airlight,
    in_layer,
    refuse_other_size,
    refuse_out,
)
from fogsim.offline.layered_fog import FogLayer
from fogsim.offline.road_plane import RoadPlane
from fogsim.offline.source import VideoFile
from fogsim.recorders.video import Encoder, encoder_command
from fogsim.values import Camera

RATE_FACTOR = 12
"""Constant rate factor of fogged videos: what is left of the road far away is a few pixel values, and is to be kept."""


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
        If anything does not fit, the video is cut off, or there is a file `out` that must not be replaced.
    """
    camera = road.calibration.camera
    _refuse_unfit(video, camera, out, overwrite)
    distance, sines = road.distance(), road.sines()
    air: NDArray[np.float64] | None = None
    encoder: Encoder | None = None
    try:
        for picture in video.pictures():
            if picture.image is None:
                raise InputError(picture.error)
            if air is None:
                air = _airlight(picture.image, distance, camera, airlight, layer)
            fogged = fog_image(picture.image, distance, visibility, camera, air, layer, sines)
            if encoder is None:
                encoder = Encoder(encoder_command(partial_path(out), video.period, video.size, RATE_FACTOR))
            encoder.write(fogged.tobytes())
            yield air
        if encoder is not None:
            finished, encoder = encoder, None
            finished.finish()
            publish(out)
    finally:
        if encoder is not None:
            encoder.finish()
        partial_path(out).unlink(missing_ok=True)


def _refuse_unfit(video: VideoFile, camera: Camera, out: Path, overwrite: bool) -> None:
    if out.suffix.lower() != ".mp4":
        raise InputError(f"--out {out}: a fogged video is written as .mp4, got {out.suffix or 'no ending'}")
    refuse_missing_folder(out, "--out")
    refuse_out(out, video.paths, overwrite)
    refuse_other_size(video.path, video.size, camera)
    if camera.width % 2 or camera.height % 2:
        raise InputError(
            f"{video.path}: frames of {camera.width} × {camera.height} pixels cannot be written as .mp4, which wants "
            "even numbers; cut a row or column off and give the camera of what is left"
        )


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
