"""A network in an ONNX file as an estimator."""

import functools
import math
from collections.abc import Callable
from pathlib import Path

from fogsim.core.parameters import checked_parameters
from fogsim.errors import InputError
from fogsim.estimators.image_check import ObservationCheck
from fogsim.estimators.learned.onnx_model import OnnxModel, read_model
from fogsim.values.camera import Camera
from fogsim.values.estimate import NORMAL_90_PERCENT, Estimate
from fogsim.values.observation import Observation

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
