"""A network in an ONNX file as an estimator."""

import functools
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fogsim.core.parameters import checked_parameters
from fogsim.errors import InputError
from fogsim.estimators.image_check import ObservationCheck
from fogsim.estimators.learned.onnx_model import OnnxModel, read_model
from fogsim.values.camera import Camera
from fogsim.values.estimate import NORMAL_90_PERCENT, Estimate
from fogsim.values.observation import Observation

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


FARTHEST = 20.0
"""Largest |ln k| that is an answer: k from 2e-9 to 5e8 per metre."""

_WIDEST = 10.0
"""Largest deviation of ln k that is an answer [-]."""


class OnnxGuest:
    """A network that reads a frame and gives ln k and its standard deviation: ``onnx:model.onnx``.

    It is given the pixels as the camera has them, over full scale, made smaller to the size that the model states by
    averaging over areas (the sides need not keep their ratio); a grey image has its channel three times. Deviations are
    multiplied by the model's calibration, metadata ``fogsim.conformal`` (`conformal_factor`). The interval of k is
    symmetric and contains that of ln k. Errors of a network repeat from frame to frame of a drive, so that its whole
    deviation counts as common (`Estimate.common_deviation`). The estimate is invalid if a number is not finite, a
    deviation is not positive, or values are beyond any fog.

    Parameters
    ----------
    name : str
        Name of the method.
    model : OnnxModel
        From `read_model`.
    time_limit : float or None
        Limit of each call of the model [s].
    camera : Camera
        The assumed calibration; the network is given its frames alone.

    Raises
    ------
    InputError
        If the camera has fewer rows or columns than the model reads.
    """

    def __init__(self, name: str, model: OnnxModel, time_limit: float | None, camera: Camera) -> None:
        self.method = name
        self._model, self._time_limit = model, time_limit
        self._check, self._full = ObservationCheck(camera), 2**camera.bits - 1
        rows, cols = model.size
        if rows > camera.height or cols > camera.width:
            raise InputError(
                f"{model.path}: the model reads {cols}×{rows} pixels, and the camera has {camera.width}×"
                f"{camera.height}; frames are only made smaller"
            )

    def reset(self) -> None:
        """Forget the time of earlier frames."""
        self._check.reset()

    @checked_parameters
    def update(self, observation: Observation) -> Estimate:
        """Read a frame.

        Parameters
        ----------
        observation : Observation
            Its image is used.

        Raises
        ------
        InputError
            If camera, image or time do not fit (see `fogsim.estimators.image_check`).
        MethodError
            If the model fails or takes too long.
        """
        image = self._check.image_of(observation)
        log_extinction, deviation = self._model.read(image, self._full, self.method, self._time_limit)
        if not (abs(log_extinction) <= FARTHEST and 0.0 < deviation <= _WIDEST):
            return Estimate.invalid(self.method, f"the network gives ln k = {log_extinction:g} ± {deviation:g}")
        extinction = math.exp(log_extinction)
        spread = extinction * math.expm1(NORMAL_90_PERCENT * deviation) / NORMAL_90_PERCENT
        return Estimate(self.method, extinction, spread, common_deviation=deviation)


def onnx_guest(name: str, path: Path, time_limit: float | None = None) -> Callable[..., OnnxGuest]:
    """Factory of the estimator whose model is in a file; InputError if it cannot be one."""
    return functools.partial(OnnxGuest, name, read_model(path), time_limit)
