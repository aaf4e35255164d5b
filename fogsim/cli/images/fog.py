"""``fogsim fog``: homogeneous fog on an image or a video from disk."""

import contextlib
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fogsim.cli.option_values import pixel_values
from fogsim.cli.printing import escape, print_remarks, stderr, stdout
from fogsim.cli.progress import progress_bar
from fogsim.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from fogsim.offline.fog_image import FogLayer
    from fogsim.offline.rectification import RoadPlane


def fog_command(
    image: Annotated[
        Path,
        typer.Argument(metavar="IMAGE|VIDEO", help="8 or 16 bits, grey or colour; with --road-plane also a video."),
    ],
    visibility: Annotated[
        float,
        typer.Option(
            min=0.1, max=math.inf, help="Meteorological visibility in metres; inf leaves the image unchanged."
        ),
    ],
    out: Annotated[Path, typer.Option(help="Image with fog, or .mp4 for a video.")],
    depth: Annotated[
        Path | None, typer.Option(help="Depth map: .npy in metres, or 16-bit PNG; 0 or inf is sky.")
    ] = None,
    road_plane: Annotated[
        bool, typer.Option("--road-plane", help="No depth map: a flat road below the horizon, sky above it.")
    ] = False,
    camera: Annotated[Path | None, typer.Option(help="camera.yaml; its response defines the pixel values.")] = None,
    depth_kind: Annotated[
        str | None,
        typer.Option(help="For --depth: planar (along the optical axis) or range (along the ray)."),
    ] = None,
    airlight: Annotated[
        str | None, typer.Option(help="Pixel value, or R,G,B. Default: the sky's median, or the brightest thousandth.")
    ] = None,
    depth_scale: Annotated[float | None, typer.Option(min=1e-9, max=1e6, help="Metres per unit of DEPTH.")] = None,
    horizon_row: Annotated[
        float | None, typer.Option(min=0, max=1e6, help="For --road-plane without a camera file: row of the horizon.")
    ] = None,
    focal_length: Annotated[
        float | None, typer.Option(min=1, max=1e6, help="The same: focal length in pixels.")
    ] = None,
    mount_height: Annotated[
        float | None, typer.Option(min=0.05, max=1000, help="The same: metres from the road to the lens.")
    ] = None,
    ground_albedo: Annotated[
        float | None,
        typer.Option(min=0, max=1, help="Albedo of the surrounding land, 0 to 1: airlight then varies with elevation."),
    ] = None,
    layer_height: Annotated[
        float | None,
        typer.Option(min=0.001, max=1e6, help="For --ground-albedo: height of the fog layer in metres. Default: 250."),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace OUT if it exists.")] = False,
) -> None:
    """Add homogeneous fog to an image or video, by Koschmieder's law on light and slant range."""
    from fogsim.core.files.readers import nearest_file

    light = None if airlight is None else pixel_values(airlight)
    if image.is_dir():
        raise InputError(f"{image}: expected one image or video")
    if not image.exists():
        raise InputError(f"{image}: there is no such file{nearest_file(image)}")
    layer = _layer(ground_albedo, layer_height)
    geometry = {"--horizon-row": horizon_row, "--focal-length": focal_length, "--mount-height": mount_height}
    if (depth is None) != road_plane:
        what = "both are given" if road_plane else "neither is given"
        raise InputError(f"how far things are comes from --depth FILE or from --road-plane, the flat road; {what}")
    if road_plane:
        for option, value in (("--depth-kind", depth_kind), ("--depth-scale", depth_scale)):
            if value is not None:
                raise InputError(f"{option} goes with --depth; --road-plane reads no depth map")
        used = _fog_road(image, _road(image, camera, geometry), visibility, out, light, layer, overwrite)
    else:
        for option, value in geometry.items():
            if value is not None:
                raise InputError(f"{option} goes with --road-plane; with --depth the camera file has it")
        used = _fog_depth(image, depth, depth_kind, depth_scale, camera, visibility, out, light, layer, overwrite)
    values = ", ".join(f"{value:.4g}" for value in used)
    stdout.print(f"{escape(out)}: visibility {visibility:g} m, airlight {values}", soft_wrap=True)


def _layer(albedo: float | None, height: float | None) -> "FogLayer | None":
    from fogsim.offline.fog_image import FogLayer

    if albedo is None:
        if height is not None:
            raise InputError("--layer-height goes with --ground-albedo")
        return None
    return FogLayer(albedo, 250.0 if height is None else height)


def _fog_depth(
    image: Path,
    depth: Path | None,
    kind: str | None,
    scale: float | None,
    camera: Path | None,
    visibility: float,
    out: Path,
    light: tuple[float, ...] | None,
    layer: "FogLayer | None",
    overwrite: bool,
) -> "NDArray[np.float64]":
    from fogsim.offline.camera_file import load_calibration, straight_camera
    from fogsim.offline.fog_image import fog_file
    from fogsim.offline.image_files import DepthMap
    from fogsim.offline.input_paths import is_video

    assert depth is not None  # noqa: S101 - the caller has looked
    if kind is None:
        raise InputError("--depth-kind is missing: planar or range? Data sets differ, and the wrong one goes unseen")
    if camera is None:
        raise InputError("--camera is missing: a depth map needs the camera file (docs/how_to/own_camera.md)")
    if is_video(image):
        raise InputError(f"{image}: a depth map is of one image; on a video fog is laid with --road-plane")
    calibration = load_calibration(camera)
    print_remarks("assumed", calibration.remarks)
    pinhole = straight_camera(calibration, camera)
    return fog_file(
        image, DepthMap(depth, kind, scale), visibility, pinhole, out, light, layer=layer, overwrite=overwrite
    )


def _road(image: Path, camera: Path | None, geometry: dict[str, float | None]) -> "RoadPlane":
    from fogsim.offline.camera_file import load_calibration
    from fogsim.offline.rectification import RoadPlane, calibration_from_options

    given = {option: value for option, value in geometry.items() if value is not None}
    if camera is not None:
        if given:
            raise InputError(f"{', '.join(given)} and --camera are both given: the camera file has it")
        calibration = load_calibration(camera)
    else:
        lacking = [option for option in geometry if option not in given]
        if lacking:
            raise InputError(
                f"--road-plane needs --camera camera.yaml, or {', '.join(geometry)}; lacking: {', '.join(lacking)}"
            )
        calibration = calibration_from_options(
            image, given["--horizon-row"], given["--focal-length"], given["--mount-height"]
        )
    print_remarks("assumed", calibration.remarks)
    return RoadPlane(calibration)


def _fog_road(
    image: Path,
    road: "RoadPlane",
    visibility: float,
    out: Path,
    light: tuple[float, ...] | None,
    layer: "FogLayer | None",
    overwrite: bool,
) -> "NDArray[np.float64]":
    from fogsim.offline.fog_image import fog_file, fog_video
    from fogsim.offline.input_paths import is_video
    from fogsim.offline.video_source import VideoFile, left_out

    if not is_video(image):
        return fog_file(image, road, visibility, road.calibration.camera, out, light, layer=layer, overwrite=overwrite)
    video = VideoFile.open(image)
    with (
        progress_bar(stderr) as progress,
        contextlib.closing(fog_video(video, road, visibility, out, light, layer=layer, overwrite=overwrite)) as frames,
    ):
        task = progress.add_task(video.description, total=video.count)
        airlight = next(frames)
        progress.advance(task)
        for _ in frames:
            progress.advance(task)
    print_remarks("left out", left_out(video))
    return airlight
