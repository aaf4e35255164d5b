"""Visibility from your own images and videos: the API behind ``fogsim estimate``."""

from fogsim.offline.calibration_deviations import CalibrationDeviations
from fogsim.offline.camera_file import Calibration, camera_text, load_calibration, write_camera
from fogsim.offline.drive.road_scale import NIGHT_METHODS, NightDrive
from fogsim.offline.drive.sign_watch import SignSummary, SignWatch, watch_signs
from fogsim.offline.estimation import FrameEstimates, chosen_methods, estimate_images, estimates_of
from fogsim.offline.guess import CameraGuess, guess_camera
from fogsim.offline.input_paths import find_source
from fogsim.offline.overlay import OverlayFile
from fogsim.offline.rectification import Straightener, straightened
from fogsim.offline.results import csv_line, csv_lines, record_lines, summary_rows, table_heading, table_rows
from fogsim.offline.source import ImageFiles, Picture, Source
from fogsim.offline.video_source import VideoFile

__all__ = [
    "NIGHT_METHODS",
    "Calibration",
    "CalibrationDeviations",
    "CameraGuess",
    "FrameEstimates",
    "ImageFiles",
    "NightDrive",
    "OverlayFile",
    "Picture",
    "SignSummary",
    "SignWatch",
    "Source",
    "Straightener",
    "VideoFile",
    "camera_text",
    "chosen_methods",
    "csv_line",
    "csv_lines",
    "estimate_images",
    "estimates_of",
    "find_source",
    "guess_camera",
    "load_calibration",
    "record_lines",
    "straightened",
    "summary_rows",
    "table_heading",
    "table_rows",
    "watch_signs",
    "write_camera",
]
