"""What sky and horizon say about the fog before the road is looked at."""

import math
from statistics import NormalDist

from fogsim.values.camera import Camera
from fogsim.vision.light.luminance import linear_table
from fogsim.vision.lines.horizon import Horizon
from fogsim.vision.strips.joint_kernels import JointPrior
from fogsim.vision.strips.sky import SATURATED_SHARE, Sky

SKY_DEVIATION = 0.005
"""Relative deviation of the airlight at the horizon from the sky above it [-]."""

OVEREXPOSURE = 0.15
"""How far a sky without any unsaturated pixel may lie above saturation, as a deviation [-]."""

_HALF, _MOSTLY = 0.5, 0.98
"""Shares of saturated pixels beyond which a sky may be brighter, and beyond which it gives only a lower bound [-]."""

_EVEN_SKY, _CLOUD, MOST_CLOUD = 0.02, 1.5, 0.015
"""Unevenness of a sky that trees before it and rounding make, how much of more of it the airlight before the road has,
and the most of that [-]: clouds and dirt on the glass go on below the horizon."""


def joint_prior(sky: Sky, camera: Camera, horizon: Horizon) -> JointPrior:
    """Prior of airlight, horizon and lens for `fogsim.vision.strips.joint_fit.fit_jointly`."""
    airlight, below, above = _airlight(sky, camera)
    return JointPrior(
        airlight=airlight,
        below=below,
        above=above,
        shift=horizon.row - camera.horizon_row,
        shift_deviation=horizon.standard_deviation,
        vignetting=sky.vignetting,
        vignetting_deviation=sky.vignetting_deviation,
        cloud=min(_CLOUD * max(sky.unevenness - _EVEN_SKY, 0.0), MOST_CLOUD),
    )


def _airlight(sky: Sky, camera: Camera) -> tuple[float, float, float]:
    """Brightness of the airlight, and its deviations downward and upward [linear grey levels]."""
    deviation, upward = (math.hypot(SKY_DEVIATION * sky.luminance, apart) for apart in (sky.deviation, sky.upward))
    if not sky.is_clipped:
        return sky.luminance, deviation, upward
    table = linear_table(camera.response, camera.bits, camera.black_level)
    level = float(table[-1] - table[-2]) * (2**camera.bits / 256.0)
    if sky.saturated > _MOSTLY:
        return 255.0 + level, 2.0 * level, OVEREXPOSURE * 255.0
    if sky.saturated < SATURATED_SHARE:
        # One of the colours is clipped: there is more light than the others show.
        return sky.luminance + level, deviation + level, deviation + 4.0 * level
    # Noise carries some of the sky's pixels below saturation: the share of the others tells how bright it is.
    airlight = 255.0 - 0.5 * level + 1.3 * level * NormalDist().inv_cdf(sky.saturated)
    # Noise that is added after clipping tells nothing of what was clipped.
    above = OVEREXPOSURE * 255.0 if sky.saturated > _HALF else deviation + level
    return airlight, deviation + level, above
