"""How a camera sets its own exposure."""

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from fogsim.camera.exposure import Sensor
from fogsim.camera.kernels import luminance_samples

SAMPLES = 2400
"""About as many pixels as are metered, evenly spread: every 121st of a 640 × 480 image."""

HIGHLIGHT_SHARE = 0.95
"""Quantile of luminance that `Metering.HIGHLIGHTS` goes by: bright surfaces and sky, yet not the lamps among them."""

_DARKEST_METERED = 1e-4
"""Luminance that darker pixels count as [cd/m²], so that black has a logarithm."""


class Metering(StrEnum):
    """What of a picture sets its exposure: its bright parts (95th percentile), or the mean of its log luminance."""

    HIGHLIGHTS = "highlights"
    LOG_AVERAGE = "log_average"


@dataclass(frozen=True, slots=True)
class AutoExposure:
    """How a camera sets its own exposure.

    Attributes
    ----------
    metering : Metering
        What of a picture counts.
    target : float
        Exposure at which the metered luminance is held, relative to saturation, 0 … 1.
    time_constant : float
        Time in which 63 % of a change of light, in its logarithm, is followed [s]; 0 for the next frame.
    brightest : float
        Saturation luminance of the shortest exposure [cd/m²].
    ungained : float
        Saturation luminance of the longest exposure time without gain [cd/m²].
    darkest : float
        Saturation luminance of the longest exposure time with the most gain [cd/m²].
    """

    metering: Metering
    target: float
    time_constant: float
    brightest: float
    ungained: float
    darkest: float


def metered_luminance(radiance: NDArray[np.float32], metering: Metering) -> float:
    """Luminance that stands for a picture [cd/m²].

    Parameters
    ----------
    radiance : (rows, cols, 3) float32
        Linear radiance at the camera [cd/m²].
    metering : Metering
        What of the picture counts.
    """
    rows, cols = radiance.shape[:2]
    stride = max(1, round(math.sqrt(rows * cols / SAMPLES)))
    samples = np.empty((rows // stride, cols // stride), np.float32)
    luminance_samples(np.ascontiguousarray(radiance, dtype=np.float32), stride, samples)
    if metering is Metering.HIGHLIGHTS:
        place = int(HIGHLIGHT_SHARE * (samples.size - 1))
        return float(np.partition(samples.ravel(), place)[place])
    return math.exp(float(np.mean(np.log(np.maximum(samples, _DARKEST_METERED, dtype=np.float64)))))


def wanted_saturation(luminance: float, auto: AutoExposure) -> float:
    """Saturation luminance that puts a metered luminance at the target, as far as the camera's limits allow [cd/m²]."""
    return min(max(luminance / auto.target, auto.darkest), auto.brightest)


def followed(saturation: float, wanted: float, auto: AutoExposure, period: float) -> float:
    """Saturation luminance one frame later: of first order in its logarithm, as photographers' stops are [cd/m²].

    Parameters
    ----------
    saturation, wanted : float
        Saturation luminance now, and the one that suits the light [cd/m²].
    auto : AutoExposure
        How the camera follows.
    period : float
        Time between two frames [s].
    """
    share = -math.expm1(-period / auto.time_constant) if auto.time_constant > 0 else 1.0
    return float(saturation * (wanted / saturation) ** share)


def sensor_at(sensor: Sensor, saturation: float, auto: AutoExposure) -> Sensor:
    """Sensor at an exposure.

    Exposure time makes no noise. Where even the longest is too short the signal is amplified, and the fewer electrons
    that then fill a pixel's range make it noisier.

    Parameters
    ----------
    sensor : Sensor
        The sensor without gain.
    saturation : float
        Saturation luminance [cd/m²].
    auto : AutoExposure
        Where gain begins.
    """
    filled = sensor.full_well * min(1.0, saturation / auto.ungained)
    return Sensor(saturation, filled, sensor.read_noise, sensor.bits)
