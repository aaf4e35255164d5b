"""The second camera of a stereo rig: next to the first one, with a sensor of its own."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fogsim.camera import CameraConfig, Shutter, StereoConfig
from fogsim.simulation.ego.motion_blur import exposed
from fogsim.values import Camera, CameraPose, TrafficState, View

Drawn = tuple[View, NDArray[np.float32] | None]


class SecondCamera:
    """A camera like the first, to the right of it, whose axis misses being parallel by what calibration has missed.

    It is drawn before the first one. Faults of a lens are the first one's; what happens to pictures on their way
    happens to both.
    """

    def __init__(self, camera: CameraConfig, pair: StereoConfig, period: float) -> None:
        self._pair, self._sensor = pair, camera.make_sensor(period)
        self.stated_baseline = pair.stated_baseline
        self._rng = np.random.default_rng(0)

    def reset(self, rng: np.random.Generator) -> None:
        """Begin a run."""
        self._sensor.reset()
        self._rng = rng

    def take(
        self,
        draw: Callable[[TrafficState, CameraPose, Camera], Drawn],
        shutter: Shutter,
        state: TrafficState,
        ego: int,
        pose: CameraPose,
        camera: Camera,
    ) -> NDArray[np.uint8] | NDArray[np.uint16] | None:
        """Take its picture.

        Returns the picture; None where nothing is drawn (rows, cols, 3) uint8.
        """
        x, y, z = pose.position
        pair = self._pair
        across = pair.baseline * math.sin(pose.heading), -pair.baseline * math.cos(pose.heading)
        beside = replace(pose, position=(x + across[0], y + across[1], z), heading=pose.heading + pair.yaw)
        turned = replace(camera, pitch=camera.pitch + pair.pitch, roll=camera.roll + pair.roll)
        open_for = shutter.at(self._sensor.share_of_longest_exposure)
        _, radiance = exposed(lambda traffic, place: draw(traffic, place, turned), open_for, state, ego, beside)
        return None if radiance is None else self._sensor.take(radiance, self._rng)
