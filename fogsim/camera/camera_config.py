"""A vehicle's camera as plain values: optics, mount, image sensor, and what its calibration misses."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from fogsim.camera.exposure import AutoExposure, Metering, Sensor
from fogsim.camera.mount import USUAL_MOUNTS, CameraMount, Suspension
from fogsim.camera.sensor import CameraSensor
from fogsim.camera.shutter import Shutter
from fogsim.core.parameters import checked_parameters
from fogsim.values import Camera

CAR = "car"
"""Body kind of an ego by default."""

DEFAULT_CAMERA = Camera(640, 480, 320.0 / math.tan(math.radians(29.0)), (320.0, 240.0), 1.38, math.radians(2.0))
"""A camera behind a car's windscreen, with a field of view of 58°."""

_SENSOR = Sensor(10_000.0)
_EXPOSURE = AutoExposure(Metering.HIGHLIGHTS, 0.65, 0.5, 100_000.0, 100.0, 4.0)
_FROZEN, _STIFF = Shutter(), Suspension(0.0, 0.2)


@dataclass(frozen=True, slots=True)
class CalibrationErrors:
    """How the calibration that a vehicle assumes differs from the true one."""

    pitch: float = 0.0  # Assumed minus true [rad]
    roll: float = 0.0  # Assumed minus true [rad]
    focal_length_ratio: float = 1.0  # Assumed over true
    mount_height_ratio: float = 1.0  # Assumed over true


@dataclass(frozen=True, slots=True)
class StereoConfig:
    """A second camera like the first, to the right of it, and what the calibration of the pair has missed."""

    baseline: float = 0.5  # Distance between the optical centres [m]
    stated_baseline: float = 0.5  # The same by the calibration [m]
    # How far its axis turns to the left of the first one's, downward, and about itself [rad]
    yaw: float = 0.0
    pitch: float = 0.0
    roll: float = 0.0


@checked_parameters
@dataclass(frozen=True, slots=True)
class CameraConfig:
    """A vehicle's camera.

    Parameters
    ----------
    camera : Camera
        True calibration in a car.
    sensor : Sensor
        Image sensor, at its exposure if that is fixed.
    exposure : AutoExposure or None
        How the camera sets its exposure; None for a fixed one.
    errors : CalibrationErrors
        Errors of the calibration that estimators assume.
    mounts : mapping from str to CameraMount
        Mounts by body kind; one that is missing has the height of `camera`, and the usual setback.
    samples : int
        Samples a pixel side.
    has_bonnet : bool
        Whether the bonnet of a car is in the image.
    lens_shading : float
        Darkening of the corners [-]: 1 for cos⁴, 0 for none.
    lens_glare : float
        Share of the light of lamps that the lens scatters around them [-].
    shutter : Shutter
        How long the shutter is open.
    suspension : Suspension
        How braking pitches the camera.
    stereo : StereoConfig or None
        A second camera.
    """

    camera: Camera
    sensor: Sensor = _SENSOR
    exposure: AutoExposure | None = _EXPOSURE
    errors: CalibrationErrors = CalibrationErrors()
    mounts: Mapping[str, CameraMount] = field(default_factory=dict)
    samples: int = 1
    has_bonnet: bool = False
    lens_shading: float = 0.0
    lens_glare: float = 0.01
    shutter: Shutter = _FROZEN
    suspension: Suspension = _STIFF
    stereo: StereoConfig | None = None

    def mount(self, body: str = CAR) -> CameraMount:
        """Where the camera is on a vehicle.

        Parameters
        ----------
        body : str
            Body kind of the vehicle.
        """
        if body in self.mounts:
            return self.mounts[body]
        return CameraMount(self.camera.mount_height, USUAL_MOUNTS[body].setback)

    def on(self, body: str = CAR) -> Camera:
        """True calibration on a vehicle.

        Parameters
        ----------
        body : str
            Body kind of the vehicle.
        """
        return replace(self.camera, mount_height=self.mount(body).height)

    def assumed_on(self, body: str = CAR) -> Camera:
        """Calibration on a vehicle that estimators assume.

        Parameters
        ----------
        body : str
            Body kind of the vehicle.
        """
        true, errors = self.on(body), self.errors
        return replace(
            true,
            mount_height=true.mount_height * errors.mount_height_ratio,
            pitch=true.pitch + errors.pitch,
            roll=true.roll + errors.roll,
            focal_length=true.focal_length * errors.focal_length_ratio,
        )

    def make_sensor(self, period: float) -> CameraSensor:
        """Make what takes the images of one run.

        Parameters
        ----------
        period : float
            Time between two images [s].
        """
        return CameraSensor(self.camera, self.sensor, self.exposure, self.lens_shading, period, self.lens_glare)
