"""A daytime image from a little above the horizon down, checked for what methods of the road's luminance need."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera, Response
from fogsim.vision.light.daylight import TOO_DARK, lit_by_lamps
from fogsim.vision.light.luminance import linear_luminance
from fogsim.vision.light.medians import columns_apart, median, quantile
from fogsim.vision.lines.horizon import CannotTellError, Horizon, levelled

_MIN_COLS, MIN_ROWS = 32, 16
"""[px] A road narrower than this, or lower below its horizon, shows no curve."""

MIN_AIRLIGHT = 6.0
"""Darker than this above the horizon is no day [linear grey levels]."""

MIN_CONTRAST = 6.0
"""Least contrast of road and airlight; below it quantisation hides the curve [linear grey levels]."""

SATURATED = 250.0
"""Luminance that is clipped, or so near that noise is [linear grey levels]."""

_SKY_SHARE = 0.05
"""Share of the image's height above the horizon that is taken along [-]."""

_SKY_HEIGHT = 0.12
"""How far above the horizon the airlight is looked for [rad]: over a wood that stands along the horizon."""


@dataclass(frozen=True, slots=True)
class RoadImage:
    """The part of an image from a little above the horizon to its bottom row."""

    luminance: NDArray[np.float32]  # (rows, cols): Linear grey levels
    first_row: int  # Row of the whole image that is row 0 here
    sky_rows: int  # Rows here that lie above the horizon
    # airlight, road: first guesses: the bright part of what lies above the horizon, and the median of the bottom row
    airlight: float
    road: float
    level: NDArray[np.uint8] | NDArray[np.uint16]  # (all rows, cols): The whole image without roll
    first_column: int = 0  # Column of the whole image that is column 0 here

    @property
    def contrast(self) -> float:
        """Airlight less road [linear grey levels]."""
        return self.airlight - self.road

    def above(self, lowest: int) -> "RoadImage":
        """The same without the rows below one of the whole image."""
        luminance = self.luminance[: lowest + 1 - self.first_row]
        part = luminance, self.first_row, self.sky_rows, self.airlight
        return RoadImage(*part, median(luminance[-1]), self.level, self.first_column)


def road_image(
    image: NDArray[np.uint8] | NDArray[np.uint16],
    camera: Camera,
    horizon: Horizon,
    columns: tuple[int, int] | None = None,
    *,
    linear: bool = True,
) -> RoadImage:
    """Cut, level and linearise an image (`image` (rows, cols), `columns` (int, int))."""
    rows, cols = image.shape[:2]
    if not 1.0 <= horizon.row <= rows - 1:
        raise CannotTellError(f"the horizon (row {horizon.row:.1f}) is outside the image")
    if rows - 1 - horizon.row < MIN_ROWS or cols < _MIN_COLS:
        raise CannotTellError("the image is too small to show a curve")
    sky_end = math.ceil(horizon.row)
    first = max(0, sky_end - 4 - round(_SKY_SHARE * rows))
    level = levelled(image, camera)
    left, right = columns or (0, cols)
    response = (camera.response, camera.bits, camera.black_level) if linear else (Response.LINEAR, camera.bits)
    luminance = linear_luminance(level[first:, left:right], *response)
    top = min(first, max(0, sky_end - round(_SKY_HEIGHT * camera.focal_length)))
    above = linear_luminance(columns_apart(level[top:sky_end:2], 4), *response)
    airlight = quantile(above, 0.9)
    seed = median(luminance[-1])
    road = _checked(RoadImage(luminance, first, sky_end - first, airlight, seed, level, left))
    if why := lit_by_lamps(level, camera):
        raise CannotTellError(why)
    return road


def _checked(road: RoadImage) -> RoadImage:
    if road.airlight < MIN_AIRLIGHT:
        raise CannotTellError(TOO_DARK)
    if road.road >= SATURATED:
        raise CannotTellError("the road is saturated")
    if road.contrast < max(MIN_CONTRAST, 0.05 * road.airlight):
        raise CannotTellError("the road is nearly as bright as the airlight, or brighter")
    return road
