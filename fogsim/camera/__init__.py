"""Where the camera is, exposure, noise, response and quantisation."""

from fogsim.camera.exposure import Sensor, expose
from fogsim.camera.mount import mounted_pose

__all__ = ["Sensor", "expose", "mounted_pose"]
