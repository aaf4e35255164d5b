"""How uncertain a calibration is, and what that does to estimates."""

import math
from dataclasses import dataclass, replace

from fogsim.values import Estimate
from fogsim.values.estimate import OpticalDepths
from fogsim.vision.lines.horizon import PITCH_DEVIATION

_ON_THE_ROAD = ("night_road",)
"""Methods that take distances from the calibration of the road plane, so that their extinction goes with the inverse of
focal length × mount height, and have no parameter `scale_deviation`."""


@dataclass(frozen=True, slots=True)
class CalibrationDeviations:
    """Standard deviations of a calibration.

    Attributes
    ----------
    focal_length, mount_height : float
        Relative to the values [-].
    pitch : float
        Of the pitch [rad].
    """

    focal_length: float = 0.0
    mount_height: float = 0.0
    pitch: float = PITCH_DEVIATION

    @property
    def scale(self) -> float:
        """Relative standard deviation of distances on the road [-]."""
        return math.hypot(self.focal_length, self.mount_height)

    def widened(self, estimate: Estimate) -> Estimate:
        """Estimate with the uncertainty of distances on the road in its deviations.

        Parameters
        ----------
        estimate : Estimate
            Of a method that may measure along the road.
        """
        if not estimate.valid or self.scale == 0.0 or estimate.method not in _ON_THE_ROAD:
            return estimate
        deviation = self._of(estimate.extinction, estimate.standard_deviation)
        depths = estimate.optical_depths
        if depths is not None:
            both = zip(depths.depth, depths.standard_deviation, strict=True)
            depths = OpticalDepths(depths.distance, depths.depth, tuple(self._of(*one) for one in both))
        common = math.hypot(estimate.common_deviation, self.scale)
        return replace(estimate, standard_deviation=deviation, optical_depths=depths, common_deviation=common)

    def _of(self, value: float, deviation: float) -> float:
        """Standard deviation of a value with its own deviation, times a factor of 1 ± `scale`."""
        return math.hypot(deviation * math.hypot(1.0, self.scale), value * self.scale)


EXACT = CalibrationDeviations()
"""Of a calibration that is exact but for the pitch."""
