"""References of the veil as a file of a calibration, or computed when they are first needed."""

import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError, shown
from fogsim.estimators.night.cells import camera_of_cells
from fogsim.estimators.night.references import ReferenceSource, VeilReferences
from fogsim.files.array_archive import read_arrays
from fogsim.files.readers import number_within
from fogsim.values.camera import Camera, Response
from fogsim.values.light import Lamp, lamp_names

HEAD_LAMPS = Lamp.LOW_BEAM | Lamp.HIGH_BEAM | Lamp.FRONT_FOG
"""Lamps that throw light ahead."""

USUAL_SETBACK = 1.9
"""Distance of the camera behind the front bumper where no vehicle tells it [m]."""

NEAR = 0.05
"""How far a camera may be from where it was for the references [m]: 0.2 m change visibilities by a fifth."""

_KEYS = {"head", "visibility", "veil", "road"}


class References:
    """References of one camera for the lamps that may be lit.

    Parameters
    ----------
    camera : Camera
        The assumed calibration.
    path : str or None
        File of ``fogsim calibrate veil``; without one there are none until `source` is set.

    Attributes
    ----------
    source : callable or None
        Where references come from without a file.

    Raises
    ------
    InputError
        If the file cannot be read, or is of another camera.
    """

    def __init__(self, camera: Camera, path: str | None) -> None:
        self._camera = camera
        self._read = [] if path is None else read_references(Path(path))
        self._path = path
        self.source: ReferenceSource | None = None
        for one in self._read:
            if _without_noise(one.camera) != _without_noise(camera):
                raise InputError(
                    f"references must be of the told camera, {camera}, and {path} has those of {one.camera}; "
                    "fogsim calibrate veil makes them"
                )

    def find(self, lamps: Lamp, setback: float) -> tuple[VeilReferences, ...]:
        """References for the lamps that are lit, of the same visibilities for each kind of droplets, if there are any.

        Parameters
        ----------
        lamps : Lamp
            Low beams, high beams, front fog lamps.
        setback : float
            Distance of the camera behind the front bumper [m]; 0 where it is not told.

        Raises
        ------
        InputError
            If the file has none for them, or those of a camera elsewhere.
        """
        if self._path is None:
            if self.source is None:
                return ()
            return self.source(_without_noise(self._camera), lamps, round(setback or USUAL_SETBACK, 3))
        found = tuple(one for one in self._read if one.lamps == lamps)
        if not found:
            has = ", ".join(dict.fromkeys(lamp_names(one.lamps) for one in self._read))
            raise InputError(f"{self._path} has no references for {lamp_names(lamps)}; it has {has}")
        there = found[0].setback
        if setback and abs(setback - there) > NEAR:
            raise InputError(
                f"{self._path} has references for a camera {there:g} m behind the front bumper, and this one "
                f"is {setback:g} m behind it; fogsim calibrate veil --setback {setback:g} makes them"
            )
        return found


def _without_noise(camera: Camera) -> Camera:
    """What of a camera decides where it sees what."""
    return replace(camera, bits=8, black_level=0.0, response=Response.LINEAR)


def references_as_bytes(references: Sequence[VeilReferences]) -> bytes:
    """The file of a calibration.

    Parameters
    ----------
    references : sequence of VeilReferences
        Of one camera, each for other lamps.
    """
    arrays: dict[str, NDArray[Any]] = {}
    for index, one in enumerate(references):
        head = {"camera": asdict(one.camera), "lamps": int(one.lamps), "droplets": one.droplets}
        head |= {"setback": one.setback}
        arrays[f"head{index}"] = np.array(json.dumps(head))
        for name in ("visibility", "veil", "road"):
            arrays[f"{name}{index}"] = getattr(one, name)
    file = io.BytesIO()
    np.savez_compressed(file, allow_pickle=False, **arrays)
    return file.getvalue()


def read_references(path: Path) -> list[VeilReferences]:
    """Read the file of a calibration.

    Parameters
    ----------
    path : Path
        As `references_as_bytes` makes it.

    Raises
    ------
    InputError
        If it cannot be read, or is no such file.
    """
    try:
        arrays = read_arrays(path)
        return [_one(arrays, index) for index in range(max(len(arrays) // len(_KEYS), 1))]
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError) as error:
        reason = error if isinstance(error, InputError) else shown(error)
        raise InputError(
            f"references must be a file of `fogsim calibrate veil`, got {str(path)!r}: {reason}"
        ) from error


def _one(arrays: Mapping[str, NDArray[Any]], index: int) -> VeilReferences:
    head = json.loads(str(arrays[f"head{index}"]))
    camera = Camera(**{**head["camera"], "principal_point": tuple(head["camera"]["principal_point"])})
    visibility, veil, road = (_numbers(arrays[f"{name}{index}"]) for name in ("visibility", "veil", "road"))
    cells = camera_of_cells(camera)
    wanted = (len(visibility), cells.height, cells.width)
    if veil.shape != wanted or road.shape != wanted or not (np.isfinite(veil).all() and np.isfinite(road).all()):
        raise InputError(
            f"expected a veil and a road of finite luminances in {wanted} cells, got {veil.shape} and {road.shape}"
        )
    if (
        visibility.ndim != 1
        or not len(visibility)
        or visibility[0] <= 0.0
        or not (visibility[1:] > visibility[:-1]).all()
    ):
        raise InputError(f"expected visibilities above 0 that ascend, got {shown(visibility.tolist())}")
    lamps = Lamp(head["lamps"])
    if not lamps or int(lamps) & ~int(HEAD_LAMPS):
        raise InputError(f"expected head lamps, got {shown(head['lamps'])}")
    setback = number_within("", "setback", head["setback"], 0.0)
    return VeilReferences(camera, lamps, str(head["droplets"]), setback, visibility, veil, road)


def _numbers(array: NDArray[Any]) -> NDArray[np.float64]:
    if array.dtype.kind not in "fiu" or not array.ndim:
        raise InputError(f"expected arrays of numbers, got {array.dtype}")
    return np.asarray(array, np.float64)
