"""A guessed calibration as a camera file."""

import math
from pathlib import Path

from fogsim.errors import InputError
from fogsim.files.atomic import write_text
from fogsim.offline.guess import CameraGuess


def camera_text(guess: CameraGuess) -> str:
    """Text of a camera file, with comments that say what each value was taken from.

    Parameters
    ----------
    guess : CameraGuess
        The calibration and its reasons.
    """
    camera = guess.camera
    values = {
        "width": f"{camera.width}",
        "height": f"{camera.height}",
        "focal_length_px": f"{camera.focal_length:.1f}",
        "principal_point_px": f"[{camera.principal_point[0]:g}, {camera.principal_point[1]:g}]",
        "mount_height_m": f"{camera.mount_height:g}",
        "pitch_deg": f"{math.degrees(camera.pitch):.3f}",
        "response": camera.response.value,
    }
    lines = ["# Guessed by fogsim estimate --guess-camera; correct what you know better.\n"]
    lines += [f"# Uncertain: {warning}\n" for warning in guess.warnings]
    lines += [f"{key}: {value}  # {guess.reasons[key]}\n" for key, value in values.items()]
    return "".join(lines)


def refuse_existing(path: Path, *, overwrite: bool) -> None:
    """Refuse a camera file that is there already or whose folder is not.

    Raises
    ------
    InputError
        If it must not or cannot be written.
    """
    if path.exists() and not overwrite:
        raise InputError(f"--camera {path} is there already; --overwrite replaces it by a guessed one")
    if not path.parent.is_dir():
        raise InputError(f"--camera {path}: there is no folder {path.parent}")


def write_camera(path: Path, guess: CameraGuess, *, overwrite: bool = False) -> None:
    """Write a guessed calibration as a camera file, whole or not at all.

    Raises
    ------
    InputError
        If it is there already and not to be replaced, or its folder is not there.
    """
    refuse_existing(path, overwrite=overwrite)
    write_text(path, camera_text(guess))
