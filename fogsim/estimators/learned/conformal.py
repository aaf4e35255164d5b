"""Split conformal calibration: a factor for deviations with which 90 % intervals hold."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.core.parameters import checked_parameters
from fogsim.errors import InputError
from fogsim.values.estimate import NORMAL_90_PERCENT

_HELD = 0.9
"""Share of intervals that hold the truth [-]."""


@checked_parameters
def conformal_factor(
    log_extinction: NDArray[np.float64], deviation: NDArray[np.float64], truth: NDArray[np.float64]
) -> float:
    """Factor for a network's deviations with which its 90 % intervals hold on frames like those given.

    The score of a frame is its error over the network's deviation; the factor is the ⌈0.9 (n + 1)⌉-th smallest score
    over 1.645, the half-width of a normal distribution's 90 % interval (split conformal prediction; Lei et al.,
    "Distribution-free predictive inference for regression", JASA 2018). The frames must be of drives that the network
    was not trained on; it holds for new frames that could have been among them, so not for another camera.

    Parameters
    ----------
    log_extinction : (n,) array
        The network's ln k, with k in 1/m.
    deviation : (n,) array
        Its standard deviation of ln k [-], positive.
    truth : (n,) array
        The true ln k.

    Raises
    ------
    InputError
        If the arrays are not of one length of at least 9, not finite, or a deviation is not positive.
    """
    if not (log_extinction.shape == deviation.shape == truth.shape and log_extinction.ndim == 1):
        raise InputError(
            "conformal_factor: expected three arrays (n,) of one length, got shapes "
            f"{log_extinction.shape}, {deviation.shape} and {truth.shape}"
        )
    count = len(truth)
    rank = math.ceil(_HELD * (count + 1))
    if rank > count:
        raise InputError(f"conformal_factor: expected at least 9 frames, got {count}")
    if not ((deviation > 0.0).all() and np.isfinite([log_extinction, deviation, truth]).all()):
        raise InputError("conformal_factor: expected finite numbers and positive deviations, got others")
    scores = np.sort(np.abs(truth - log_extinction) / deviation)
    return float(scores[rank - 1]) / NORMAL_90_PERCENT
