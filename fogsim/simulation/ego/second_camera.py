"""The second camera of a stereo rig: next to the first one, with a sensor of its own."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fogsim.scenario import Scenario, build
from fogsim.simulation.ego.shutter import Shutter, exposed
from fogsim.values import Camera, CameraPose, TrafficState, View

Drawn = tuple[View, NDArray[np.float32] | None]


class SecondCamera:
    """A camera like the first, to the right of it, whose axis misses being parallel by what calibration has missed.

    It is drawn before the first one. Faults of a lens are the first one's; what happens to pictures on their way
    happens to both.
    """

    def __init__(self, scenario: Scenario) -> None:
        section = scenario.camera.stereo
        assert section is not None  # noqa: S101 - the caller has looked
        self._baseline = section.baseline_m
        self._yaw, self._pitch, self._roll = (
            math.radians(angle) for angle in (section.yaw_error_deg, section.pitch_error_deg, section.roll_error_deg)
        )
        self.stated_baseline = section.baseline_m * (1.0 + section.baseline_error_percent / 100.0)
        self._sensor = build.camera_sensor(scenario)
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
        across = self._baseline * math.sin(pose.heading), -self._baseline * math.cos(pose.heading)
        beside = replace(pose, position=(x + across[0], y + across[1], z), heading=pose.heading + self._yaw)
        turned = replace(camera, pitch=camera.pitch + self._pitch, roll=camera.roll + self._roll)
        open_for = shutter.at(self._sensor.share_of_longest_exposure)
        _, radiance = exposed(lambda traffic, place: draw(traffic, place, turned), open_for, state, ego, beside)
        return None if radiance is None else self._sensor.take(radiance, self._rng)
