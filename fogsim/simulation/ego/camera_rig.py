"""The ego's camera, or the pair of them: from the light that falls on the glass to delivered images."""

from collections.abc import Sequence
from functools import partial
from typing import Protocol, cast

import numpy as np
from numpy.typing import NDArray

from fogsim.camera import CAR, CameraConfig, Delivered, FaultyLens, FrameDelivery, Pixels, unexposed
from fogsim.simulation.ego.motion_blur import exposed
from fogsim.simulation.ego.second_camera import SecondCamera
from fogsim.values import Camera, CameraPose, Frame, RunningFault, SecondView, TrafficState, View


class Draw(Protocol):
    """What draws for a camera."""

    def __call__(
        self, state: TrafficState, pose: CameraPose, camera: Camera
    ) -> tuple[View, NDArray[np.float32] | None]:
        """What a camera sees at a pose, and the light that reaches it; no light where nothing is drawn."""


class CameraRig:
    """Takes images; `period` apart [s]."""

    def __init__(self, config: CameraConfig, period: float) -> None:
        self._config, self._sensor = config, config.make_sensor(period)
        self._second = None if config.stereo is None else SecondCamera(config, config.stereo, period)
        self._glass, self._delivery = FaultyLens(), FrameDelivery()
        self.mount_on(CAR)

    def mount_on(self, body: str) -> None:
        """Put the cameras where they belong on a body kind."""
        self.camera, self.assumed = self._config.on(body), self._config.assumed_on(body)
        self.setback = self._config.mount(body).setback
        self._unexposed = unexposed(self.camera)

    def reset(self, rng: np.random.Generator) -> None:
        """Begin a run; a second camera has random numbers of its own."""
        self._sensor.reset()
        if self._second is not None:
            self._second.reset(rng.spawn(1)[0])
        self._glass.reset()
        self._delivery.reset()

    def take(
        self,
        draw: Draw,
        state: TrafficState,
        ego: int,
        pose: CameraPose,
        camera: Camera,
        faults: Sequence[RunningFault],
        rng: np.random.Generator,
        time: float,
    ) -> tuple[View, Frame, SecondView | None]:
        """View and images of a true calibration, as they are delivered at a time [s]."""
        shutter, second = self._config.shutter, None
        if self._second is not None:
            # Drawn first: arrays of the picture that is drawn last are kept.
            second = self._second.take(draw, shutter, state, ego, pose, self.camera)
        open_for = shutter.at(self._sensor.share_of_longest_exposure)
        view, radiance = exposed(partial(draw, camera=camera), open_for, state, ego, pose)
        image = self._unexposed
        if radiance is not None:
            image = self._sensor.take(self._glass.look_through(radiance, camera, faults), rng)
        if self._second is None:
            return view, Frame(*self._delivery.deliver(Delivered(time, image), faults), self.assumed), None
        # Both pictures go one way, and are late, lost or frozen together.
        pair = cast("Pixels", np.concatenate((image, self._unexposed if second is None else second), axis=1))
        when, both = self._delivery.deliver(Delivered(time, pair), faults)
        left, right = (np.ascontiguousarray(half) for half in np.split(both, 2, axis=1))
        return view, Frame(when, left, self.assumed), SecondView(right, self._second.stated_baseline)
