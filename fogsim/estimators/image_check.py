"""What estimators demand of observations."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.values.camera import Camera
from fogsim.values.image import Frame, for_kernels
from fogsim.values.observation import Observation
from fogsim.vision.lines.letterbox import without_letterbox


class ObservationCheck:
    """What every method demands of its observations: the assumed camera's images, in the order of time."""

    def __init__(self, camera: Camera) -> None:
        self._camera = camera
        self._time = -math.inf

    def reset(self) -> None:
        """Let time begin again."""
        self._time = -math.inf

    def image_of(self, observation: Observation) -> NDArray[np.uint8] | NDArray[np.uint16]:
        """Image of an observation that can follow the earlier ones."""
        frame = observation.frame
        if not isinstance(frame, Frame):
            return checked_image(frame, self._camera)
        if frame.camera != self._camera:
            raise InputError(f"the frame's camera must be that of the estimator, {self._camera}, got {frame.camera}")
        image, time = checked_image(frame.image, self._camera), float(frame.time)
        if time < self._time:
            raise InputError(
                f"the time of a frame must not be before that of an earlier one, {self._time:g} s, got {time:g} s; "
                "call reset() where another drive begins"
            )
        self._time = time
        return image

    def kernel_image(self, observation: Observation) -> NDArray[np.uint8] | NDArray[np.uint16]:
        """As `image_of`, for FogSim's own methods, whose kernels only read it, without a black band above it."""
        return without_letterbox(for_kernels(self.image_of(observation)), self._camera)


def checked_image(image: object, camera: Camera) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """Return an image unchanged if it can have come from a camera (`image` (rows, cols))."""
    expected, most = np.dtype(np.uint8 if camera.bits == 8 else np.uint16), 2**camera.bits - 1
    if not isinstance(image, np.ndarray):
        raise InputError(f"an image must be a numpy array of {expected}, got {type(image).__name__}")
    if image.dtype != expected:
        raise InputError(f"an image of {camera.bits} bits must have dtype {expected} (0 … {most}), got {image.dtype}")
    if not (image.ndim == 2 or (image.ndim == 3 and image.shape[2] == 3)):
        raise InputError(f"an image must have shape (rows, cols) or (rows, cols, 3), got {image.shape}")
    if image.shape[:2] != (camera.height, camera.width):
        raise InputError(
            f"the image has {image.shape[1]}×{image.shape[0]} pixels (width × height), "
            f"but its camera has {camera.width}×{camera.height}"
        )
    if camera.bits > 8 and image.max() > most:
        raise InputError(f"an image of {camera.bits} bits must have values 0 … {most}, got one of {image.max()}")
    return image
