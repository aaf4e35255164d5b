"""Where the camera is, its samples, glare, exposure, noise, response and quantisation."""

from fogsim.camera.camera_config import CAR, DEFAULT_CAMERA, CalibrationErrors, CameraConfig, StereoConfig
from fogsim.camera.delivery import Delivered, FrameDelivery
from fogsim.camera.exposure import AutoExposure, Metering, Pixels, Sensor, expose, unexposed
from fogsim.camera.faulty_lens import FaultyLens
from fogsim.camera.glare import LensGlare
from fogsim.camera.mount import USUAL_MOUNTS, BodyPitch, CameraMount, Suspension, knocked, mounted_pose
from fogsim.camera.sensor import CameraSensor, averaged, middle_samples, supersampled
from fogsim.camera.shutter import Shutter

__all__ = [
    "CAR",
    "DEFAULT_CAMERA",
    "USUAL_MOUNTS",
    "AutoExposure",
    "BodyPitch",
    "CalibrationErrors",
    "CameraConfig",
    "CameraMount",
    "CameraSensor",
    "Delivered",
    "FaultyLens",
    "FrameDelivery",
    "LensGlare",
    "Metering",
    "Pixels",
    "Sensor",
    "Shutter",
    "StereoConfig",
    "Suspension",
    "averaged",
    "expose",
    "knocked",
    "middle_samples",
    "mounted_pose",
    "supersampled",
    "unexposed",
]
