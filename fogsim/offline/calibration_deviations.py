"""How uncertain a calibration is, and what that does to estimates."""

import math
from dataclasses import dataclass, replace

from fogsim.core.parameters import accepted_parameters
from fogsim.estimators import ESTIMATORS
from fogsim.values import Estimate
from fogsim.values.estimate import OpticalDepths
from fogsim.vision.lines.horizon import PITCH_DEVIATION, SCALE_DEVIATION

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

    @property
    def parameters(self) -> dict[str, float]:
        """What methods are given, as far as they have these parameters: of the scale the usual deviation at most.

        They weigh hypotheses about a road whose distances they know; what a guess leaves open goes into their answer.
        """
        return {"pitch_deviation": self.pitch, "scale_deviation": min(self.scale, SCALE_DEVIATION)}


def scale_left(deviations: CalibrationDeviations, method: str) -> float:
    """Part of a scale's deviation that a method's answer goes with and that is none of its parameters [-]."""
    if "scale_deviation" in accepted_parameters(ESTIMATORS[method]):
        return math.sqrt(deviations.scale**2 - deviations.parameters["scale_deviation"] ** 2)
    return deviations.scale if method in _ON_THE_ROAD else 0.0


def on_any_scale(estimate: Estimate, scale: float) -> Estimate:
    """Estimate of a method that measures along the road, with another uncertainty of distances there (`scale` [-])."""
    if not estimate.valid or scale == 0.0:
        return estimate
    depths = estimate.optical_depths
    if depths is not None:
        both = zip(depths.depth, depths.standard_deviation, strict=True)
        wider = tuple(math.hypot(deviation, scale * depth) for depth, deviation in both)
        depths = OpticalDepths(depths.distance, depths.depth, wider)
    return replace(
        estimate,
        standard_deviation=math.hypot(estimate.standard_deviation, scale * estimate.extinction),
        optical_depths=depths,
        common_deviation=math.hypot(estimate.common_deviation, scale),
        scale_deviation=scale,
    )


EXACT = CalibrationDeviations()
"""Of a calibration that is exact but for the pitch."""
