"""Networks in ONNX files that read frames."""

import functools
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from fogsim.core.files.readers import number_in_text
from fogsim.core.onnx_network import OnnxNetwork, read_network
from fogsim.core.registry.guard import guarded_call
from fogsim.errors import MethodError

_CONFORMAL = "fogsim.conformal"
"""Key of a model's metadata: factor for its deviations with which 90 % intervals hold (`conformal_factor`)."""

_MOST_PIXELS = 2**22
"""Largest input of a model [px]."""

_INPUT = f"one input, float32 of shape (1, 3, H, W) or (1, H, W, 3) with fixed H and W and at most {_MOST_PIXELS} px"
_OUTPUT = "one output, float32 of shape (1, 2): ln k, with k in 1/m, and its standard deviation"


@dataclass(frozen=True, slots=True)
class OnnxModel:
    """A checked model."""

    network: OnnxNetwork
    size: tuple[int, int]  # Rows and columns of the frames that it reads [px]
    channels_first: bool  # Whether its input is (1, 3, H, W)
    factor: float  # Factor for its deviations by its calibration; 1 without one

    @property
    def path(self) -> Path:
        """Its file."""
        return self.network.path

    def tensor(self, pixels: NDArray[Any]) -> NDArray[Any]:
        """Its input for an image of (H, W, 3) with values 0 … 1."""
        return (pixels.transpose(2, 0, 1) if self.channels_first else pixels)[None]

    def read(self, image: NDArray[Any], full: int, name: str, time_limit: float | None) -> tuple[float, float]:
        """The two numbers for a frame with values 0 … full, averaged over areas to its size; MethodError if none."""
        rows, cols = self.size
        scaled = cv2.resize(image.astype(np.float32) / full, (cols, rows), interpolation=cv2.INTER_AREA)
        pixels = np.repeat(scaled[..., None], 3, axis=2) if scaled.ndim == 2 else scaled
        who = f"estimator {name!r}: its model"
        # A partial, since the line of a function of FogSim's says nothing about a model's failure.
        outputs = guarded_call(functools.partial(self.network.outputs), who, None, time_limit)
        (found,) = outputs(self.tensor(pixels))
        if found.size != 2:
            raise MethodError(f"{who}: expected {_OUTPUT}; got shape {found.shape}")
        log_extinction, deviation = found.ravel().tolist()
        return log_extinction, deviation * self.factor


def read_model(path: Path) -> OnnxModel:
    """Read and check a model; InputError says what was expected and what came."""
    network = read_network(path)
    model = OnnxModel(network, *_input(network), _factor(network))
    # The model may leave the shapes of its outputs open.
    grey = model.tensor(np.full((*model.size, 3), 0.5, np.float32))
    network.check_output(grey, "a grey frame", _OUTPUT, {(1, 2), (2,)})
    return model


def _factor(network: OnnxNetwork) -> float:
    if _CONFORMAL not in network.metadata:
        return 1.0
    return number_in_text(f"{network.path}: metadata", _CONFORMAL, network.metadata[_CONFORMAL], 1e-3, 1e3)


def _input(network: OnnxNetwork) -> tuple[tuple[int, int], bool]:
    """Rows and columns of the input, and whether its channels come first."""
    inputs = network.session.get_inputs()
    if len(inputs) == 1 and inputs[0].type == "tensor(float)" and len(inputs[0].shape) == 4:
        batch, *rest = inputs[0].shape
        channels_first = rest[0] == 3
        size = tuple(rest[1:] if channels_first else rest[:2])
        fits = all(isinstance(one, int) and one > 0 for one in size) and (batch == 1 or not isinstance(batch, int))
        if fits and 3 in (rest[0], rest[2]) and math.prod(size) <= _MOST_PIXELS:
            return size, channels_first
    raise network.wrong_input(_INPUT)
