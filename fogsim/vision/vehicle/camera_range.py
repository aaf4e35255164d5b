"""Range of the vehicle ahead from its picture alone: where it stands on the road, or its known width."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera
from fogsim.vision.region.road_image import CannotTellError
from fogsim.vision.vehicle.rear_localisation import STANDS_OUT, WIDTHS, RearBox, localise_rear
from fogsim.vision.vehicle.vehicle_crop import VehicleCrop

_NEAREST, STEP = 8.0, 1.1
"""Nearest range at which an unknown vehicle is searched [m], and the ratio of each range to the next [-]."""

_LEAST_WIDTH = 8.0
"""Narrowest vehicle that is searched [px]."""

_USUAL_WIDTH, _WIDTH_SPREAD, _UNUSUAL = 1.8, 0.15, 0.4
"""Median width of vehicles [m], the standard deviation of its logarithm, and how far that may be from it [-]."""

_FOOT = 0.15
"""Standard deviation of the height of what is taken for the foot [m]: in fog a bumper's lower edge is clearer."""

_KNOWN_WIDTH = 0.02
"""Relative standard deviation of a width that is given: edges are rounded [-]."""

_CONSISTENT = 0.1
"""Largest relative difference of a range by the contact with the road from the range that is tried [-]."""

_EDGE, _REGISTERED = 0.3, 0.2
"""Standard deviation of the width between two edges, and of one by registration [px]."""

_MOST_JUMP = 12.0
"""Change of range between frames by more than which the vehicle is another one [m]."""


def registered_deviation(camera: Camera, distance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Standard deviation of ranges whose pictures were registered [m]."""
    return np.asarray(_REGISTERED * distance**2 / (_USUAL_WIDTH * camera.focal_length))


class CameraRange:
    """Ranges to a vehicle by the width of its picture, d = f W / w.

    Its width W is known, or follows from the row at which it stands on the road, d = λ / (v − v_h), weighted over its
    pictures, for the nearest show it best, and from the usual width of vehicles. An error of W is common to all ranges,
    and so goes into k as a factor.

    Takes `width` [m], `pitch_deviation` [rad].
    """

    def __init__(self, camera: Camera, width: float | None, pitch_deviation: float) -> None:
        self._camera, self._known, self._pitch_deviation = camera, width, pitch_deviation
        self.reset()

    def reset(self) -> None:
        """Forget the vehicle."""
        self._distance: float | None = None
        self._first_width, self._weighted, self._weight, self._nearest = 0.0, 0.0, 0.0, math.inf

    @property
    def scale(self) -> float:
        """What true ranges are over the measured ones, by all pictures and the usual width of vehicles [-]."""
        if self._known:
            return 1.0
        share = (self.scale_deviation / _WIDTH_SPREAD) ** 2
        width = (1.0 - share) * self._weighted / self._weight + share * math.log(_USUAL_WIDTH)
        return math.exp(width) / self._first_width

    @property
    def scale_deviation(self) -> float:
        """Relative standard deviation of all ranges together [-]."""
        if self._known:
            return _KNOWN_WIDTH
        # The pitch may be off by as much in every picture; the nearest shows that least.
        by_contact = math.hypot(self._pitch_deviation * self._nearest, _FOOT) / self._camera.mount_height
        return 1.0 / math.hypot(1.0 / by_contact, 1.0 / _WIDTH_SPREAD)

    def measure(self, crop_at: Callable[[float], VehicleCrop]) -> tuple[float, float]:
        """Range from the camera, and its standard deviation that is not common to all [m] (`crop_at` [m])."""
        box = self._search(crop_at) if self._distance is None else self._follow(crop_at, self._distance)
        width = self._known or self._first_width
        distance = width * self._camera.focal_length / box.width
        if self._distance is not None and abs(distance - self._distance) > _MOST_JUMP:
            raise CannotTellError("the vehicle ahead no longer stands out")
        self._distance = distance
        contact = self._contact(box)
        if contact is not None and not self._known:
            weight = contact**-2.0
            self._weighted += weight * math.log(box.width * contact / self._camera.focal_length)
            self._weight += weight
            self._nearest = min(self._nearest, contact)
        return distance, _EDGE * distance / box.width

    def _contact(self, box: RearBox) -> float | None:
        """Range by the row at which a vehicle stands [m]; None where its foot does not stand out."""
        below = box.foot - self._camera.horizon_row
        clear = box.evidence > math.log1p(STANDS_OUT**2) and below > 1.0
        return self._camera.row_distance / below if clear else None

    def _search(self, crop_at: Callable[[float], VehicleCrop]) -> RearBox:
        farthest = WIDTHS[1] * self._camera.focal_length / _LEAST_WIDTH
        count = max(math.ceil(math.log(max(farthest, _NEAREST) / _NEAREST) / math.log(STEP)), 1)
        for tried in np.geomspace(_NEAREST, _NEAREST * STEP**count, count + 1):
            try:
                box = _localised(crop_at(float(tried)), float(tried))
            except CannotTellError:
                continue
            contact = None if box is None else self._contact(box)
            if box is None or contact is None or abs(math.log(contact / tried)) > _CONSISTENT:
                continue
            width = box.width * contact / self._camera.focal_length
            if abs(math.log(width / (self._known or _USUAL_WIDTH))) < _UNUSUAL:
                # Farther ones are parts of it: in the image they lie above its foot.
                self._first_width = width
                return box
        raise CannotTellError("no vehicle stands out ahead whose range the image shows")

    def _follow(self, crop_at: Callable[[float], VehicleCrop], distance: float) -> RearBox:
        box = _localised(crop_at(distance), distance)
        if box is None:
            raise CannotTellError("the vehicle ahead no longer stands out")
        return box


def _localised(crop: VehicleCrop, distance: float) -> RearBox | None:
    return localise_rear(crop.luminance, crop.origin, crop.camera, distance, crop.noise)
