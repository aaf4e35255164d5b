"""Pixels to rays and back, exposure, noise, response and quantisation."""

from fogsim.camera.exposure import Sensor, expose
from fogsim.camera.projection import mounted_pose, ray_map, rotation

__all__ = ["Sensor", "expose", "mounted_pose", "ray_map", "rotation"]
