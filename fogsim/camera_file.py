"""Camera files under the name that this module had until 0.1: see `fogsim.offline.camera_file`."""

from fogsim.offline.camera_file import Calibration, load_calibration, load_camera, straight_camera

__all__ = ["Calibration", "load_calibration", "load_camera", "straight_camera"]
