"""Distances on the road by the vehicle's own way: how far the road's texture moves from image to image."""

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from fogsim.core.parameters import accepted_parameters
from fogsim.estimators import ESTIMATORS
from fogsim.offline.image_files import Pixels
from fogsim.values import Camera, Lamp

NIGHT_METHODS = ("gallen2014", "gallen2014_halo", "gallen2014_veil", "night_road")
"""Methods that use lamplight."""


@dataclass(frozen=True, slots=True)
class NightDrive:
    """A drive by night.

    Attributes
    ----------
    lamps : Lamp
        Own head lamps that were lit.
    setback : float
        Distance of the camera behind the front bumper [m]; 0 if unknown: then 1.9 m.
    head_lamps : Path or None
        File of the head lamps (docs/explanation/night.md); None for a car's usual lamps.
    halos : Path or None
        File of ``fogsim calibrate halos``; None for the paper's threshold.
    """

    lamps: Lamp = Lamp.LOW_BEAM
    setback: float = 0.0
    head_lamps: Path | None = None
    halos: Path | None = None

    def parameters_of(self, method: str) -> Mapping[str, object]:
        """Parameters of a method for this drive.

        Parameters
        ----------
        method : str
            Its name in the registry.
        """
        taken = accepted_parameters(ESTIMATORS[method])
        files = {"head_lamps": self.head_lamps, "halos": self.halos}
        return {name: str(path) for name, path in files.items() if path is not None and name in taken}


Floats = NDArray[np.float64]

_NEAREST, FARTHEST, STEP = 4.0, 24.0, 0.1
"""Ends of the piece of road that is compared, and its sampling [m by the assumed camera]."""

_HALF_WIDTH, COLUMNS = 2.2, 45
"""Half of its width [m], which includes the lines of the lane, and samples across it."""

_SMOOTH = 3.0
"""Standard deviation along the road of what is taken away as shading [m]."""

_KERNEL, _LEAST_ROWS = 181, 40
"""Rows of the kernel that smooths, and of the overlap of two images below which they are not compared."""

_LEAST_WAY, _MOST_WAY = 1.5, 5.0
"""Ways between two images that are compared [m]: shorter ones are inexact, longer ones leave less of the road in both
and reach the period of the lane marks."""

_FACTORS = np.geomspace(0.5, 2.0, 139)
"""Assumed over true distances that are tried [-], 1 % apart."""

_LEAST_PAIRS, _LEAST_CORRELATION, _CLOSE = 5, 0.3, 0.15
"""Least pairs of images and mean correlation with a result [-], and how close in ln to the best factor those of
single pairs count [-]."""

_LEAST_DEVIATION = 0.03
"""Relative standard deviation that the track's own speed leaves at least [-]."""


@dataclass(frozen=True, slots=True)
class RoadScale:
    """True over assumed distances on the road, and the relative standard deviation of that [-]."""

    factor: float
    deviation: float


class RoadMotion:
    """Comparison of images along a drive, seen as from above by an assumed camera."""

    def __init__(self, camera: Camera) -> None:
        distance = np.arange(_NEAREST, FARTHEST, STEP)
        aside = np.linspace(-_HALF_WIDTH, _HALF_WIDTH, COLUMNS)
        below = camera.row_distance / distance[:, None]
        columns = camera.principal_point[0] + aside * below / camera.mount_height
        rows = (camera.horizon_row + below) * np.ones_like(columns)
        self._places = columns.astype(np.float32), rows.astype(np.float32)
        self._shown = np.asarray(rows[:, 0] < camera.height - 1.0)
        self._earlier: deque[tuple[float, Floats]] = deque(maxlen=60)
        self._correlations: list[Floats] = []

    def add(self, image: Pixels, way: float) -> None:
        """Add an image that was taken after a way from the start of the drive [m]."""
        texture = self._texture(image)
        for before, seen in reversed(self._earlier):
            if _LEAST_WAY <= way - before <= _MOST_WAY:
                self._correlations.append(self._correlation(seen, texture, way - before))
                break
        self._earlier.append((way, texture))

    @property
    def pairs(self) -> int:
        """Number of pairs of images that were compared."""
        return len(self._correlations)

    def scale(self) -> RoadScale | None:
        """Scale in which the road moves as the vehicle does; None if too little moved."""
        if len(self._correlations) < _LEAST_PAIRS:
            return None
        correlations = np.stack(self._correlations)
        mean = correlations.mean(axis=0)
        best = math.log(_FACTORS[int(mean.argmax())])
        if mean.max() < _LEAST_CORRELATION or not 0 < int(mean.argmax()) < _FACTORS.size - 1:
            return None
        single = np.log(_FACTORS[correlations.argmax(axis=1)])
        single = single[np.abs(single - best) < _CLOSE]
        middle = float(np.median(single)) if single.size else best
        scatter = 1.4826 * float(np.median(np.abs(single - middle))) if single.size else _CLOSE
        return RoadScale(math.exp(-middle), math.hypot(_LEAST_DEVIATION, scatter / math.sqrt(max(single.size, 1))))

    def _texture(self, image: Pixels) -> Floats:
        """Road from above without its shading (n, columns); zero where the image does not show it."""
        grey: Any = image if image.ndim == 2 else image[:, :, 1]
        above = cv2.remap(np.asarray(grey, np.float32), *self._places, cv2.INTER_LINEAR)
        smooth = cv2.GaussianBlur(above, (1, _KERNEL), sigmaX=1.0, sigmaY=_SMOOTH / STEP)
        return np.asarray((above - smooth) * self._shown[:, None], np.float64)

    def _correlation(self, before: Floats, after: Floats, way: float) -> Floats:
        """Correlation of two textures by factor: what was at x + way is at x now."""
        rows = np.arange(before.shape[0])
        found = np.zeros(_FACTORS.size)
        for index, shift in enumerate(way * _FACTORS / STEP):
            place = rows[: max(before.shape[0] - math.ceil(shift) - 1, 0)] + shift
            first = place.astype(int)
            if first.size < _LEAST_ROWS:
                continue
            share = (place - first)[:, None]
            moved = (1.0 - share) * before[first] + share * before[first + 1]
            now = after[: first.size] * (self._shown[first] & self._shown[: first.size])[:, None]
            moved = moved * (now != 0.0)
            power = float((now * now).sum()) * float((moved * moved).sum())
            found[index] = float((now * moved).sum()) / math.sqrt(power) if power > 0.0 else 0.0
        return found
