"""In a drive few hypotheses survive: which ones the last look at all of them has left, and when the next is due."""

import math
from dataclasses import dataclass

from fogsim.vision.strips.joint_fit import EVERY, JointFit

_PERIOD = 0.5
"""Time after which all hypotheses are tried again [s]."""

_WORSE, _FEWER = 1.3, 0.05
"""How many times as large the misfit may be as in the last full look, and by how much smaller the share of bins in use,
for even fog still to suffice [-]."""


@dataclass(frozen=True, slots=True)
class Left:
    """What a full look has left: albedos, and even fog with its misfit and its share of bins in use [-]."""

    time: float = -math.inf
    albedos: tuple[int, ...] = EVERY
    misfit: float = -math.inf
    used: float = math.inf

    def is_due(self, time: float) -> bool:
        """Whether all hypotheses are to be tried in an image of a time [s]."""
        return not self.time < time < self.time + _PERIOD

    def suffices(self, fit: JointFit) -> bool:
        """Whether even fog still explains the road about as well as in the full look."""
        return fit.misfit <= _WORSE * self.misfit and float(fit.used.mean()) >= self.used - _FEWER


def left_by(time: float, fit: JointFit) -> Left:
    """What a full look at a time [s] has left whose fit is of even fog without shade."""
    return Left(time, fit.albedos, fit.misfit, float(fit.used.mean()))
