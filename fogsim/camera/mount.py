"""Where a camera is mounted, and how the body that it is mounted on pitches."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.values import Camera, CameraPose
from fogsim.values.fault import FaultKind, Miscalibration


class CameraMount(NamedTuple):
    """Where on a vehicle a camera is."""

    height: float  # Height above the road [m]
    setback: float  # Distance behind the front bumper [m]


USUAL_MOUNTS = {
    "car": CameraMount(1.38, 1.7),
    "van": CameraMount(1.8, 1.2),
    "truck": CameraMount(2.63, 0.25),
    "bus": CameraMount(2.1, 0.2),
    "motorcycle": CameraMount(1.35, 0.8),
}
"""Mounts by body kind: behind the windscreen 0.3 m above the driver's eyes, on a motorcycle's helmet at the eyes."""


def mounted_pose(
    camera: Camera,
    front_bumper: NDArray[np.float64],
    heading: float,
    setback: float,
    grade: float = 0.0,
    body_pitch: float = 0.0,
) -> CameraPose:
    """Pose of a camera that is mounted behind a vehicle's front bumper, on its axis; lengths in m, angles in rad."""
    forward, up = math.cos(grade), math.sin(grade)
    along = setback * forward + camera.mount_height * up
    x = float(front_bumper[0]) - along * math.cos(heading)
    y = float(front_bumper[1]) - along * math.sin(heading)
    z = float(front_bumper[2]) - setback * up + camera.mount_height * forward
    return CameraPose(position=(x, y, z), heading=heading, grade=grade + body_pitch, road_grade=grade)


def knocked(camera: Camera, kinds: Iterable[FaultKind]) -> Camera:
    """The true calibration of a camera that has been knocked, or whose lens has slipped."""
    for kind in kinds:
        if isinstance(kind, Miscalibration):
            camera = replace(
                camera,
                pitch=camera.pitch + kind.pitch,
                roll=camera.roll + kind.roll,
                focal_length=camera.focal_length * kind.focal_length_ratio,
            )
    return camera


@dataclass(frozen=True, slots=True)
class Suspension:
    """How a vehicle's body pitches when it brakes or accelerates."""

    pitch_per_deceleration: float  # Steady pitch, nose down, for each unit of deceleration [rad per m/s²]
    time_constant: float  # Lag of first order with which the body follows [s]


class BodyPitch:
    """The pitch of a vehicle's body through a run (`period` [s])."""

    def __init__(self, suspension: Suspension, period: float) -> None:
        self._suspension = suspension
        lag = suspension.time_constant
        self._share = -math.expm1(-period / lag) if lag > 0 else 1.0
        self._grade: float | None = None

    def reset(self) -> None:
        """Begin a run: the first update finds the body settled."""
        self._grade = None

    def update(self, acceleration: float) -> float:
        """Upward inclination of the body on the road [rad]; braking makes it negative (`acceleration` [m/s²])."""
        settled = self._suspension.pitch_per_deceleration * acceleration
        before = settled if self._grade is None else self._grade
        self._grade = before + self._share * (settled - before)
        return self._grade
