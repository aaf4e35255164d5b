"""``fogsim fog``: homogeneous fog on an image from disk."""

from pathlib import Path
from typing import Annotated

import typer

from fogsim.cli.printing import escape, print_remarks, stdout
from fogsim.errors import InputError


def fog_command(
    image: Annotated[Path, typer.Argument(help="A grey or colour image of 8 or 16 bits.")],
    depth: Annotated[Path, typer.Option(help="Its depth map: .npy in metres, or 16-bit PNG; 0 or inf is sky.")],
    camera: Annotated[Path, typer.Option(help="camera.yaml; its response says what pixel values stand for.")],
    visibility: Annotated[float, typer.Option(help="Meteorological visibility in metres; inf gives the image back.")],
    out: Annotated[Path, typer.Option(help="The fogged image.")],
    depth_kind: Annotated[
        str | None, typer.Option(help="planar (along the optical axis) or range (along the ray); required.")
    ] = None,
    airlight: Annotated[
        str | None, typer.Option(help="Its pixel value, or R,G,B; else the sky's median, or the brightest thousandth.")
    ] = None,
    depth_scale: Annotated[float | None, typer.Option(help="Metres in one unit of DEPTH.")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace OUT if it is there already.")] = False,
) -> None:
    """Put homogeneous fog on an image from disk: Koschmieder's law on light and slant range."""
    from fogsim.offline.camera_file import load_calibration, straight_camera
    from fogsim.offline.fog_image import fog_file
    from fogsim.offline.image_files import DepthMap

    if depth_kind is None:
        raise InputError("--depth-kind is missing: planar or range? Data sets differ, and the wrong one goes unseen")
    light = None if airlight is None else _pixel_values(airlight)
    calibration = load_calibration(camera)
    print_remarks("assumed", calibration.remarks)
    pinhole = straight_camera(calibration, camera)
    depth_map = DepthMap(depth, depth_kind, depth_scale)
    used = fog_file(image, depth_map, visibility, pinhole, out, light, overwrite=overwrite)
    values = ", ".join(f"{value:.4g}" for value in used)
    stdout.print(f"{escape(out)}: visibility {visibility:g} m, airlight {values}", soft_wrap=True)


def _pixel_values(text: str) -> tuple[float, ...]:
    """Pixel value, or three with commas between them."""
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"--airlight {text}: expected a pixel value, or red, green and blue as R,G,B") from None
