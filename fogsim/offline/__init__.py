"""Visibility from a person's own images and videos: what ``fogsim estimate`` does."""

from fogsim.offline.estimation import FrameEstimates, chosen_methods, estimate_images, estimates_of
from fogsim.offline.find import find_source
from fogsim.offline.guess import CameraGuess, guess_camera
from fogsim.offline.guess_file import camera_text, refuse_existing, write_camera
from fogsim.offline.overlay_file import OverlayFile
from fogsim.offline.record import record_lines
from fogsim.offline.source import ImageFiles, Picture, Source
from fogsim.offline.straighten import Straightener, straightened
from fogsim.offline.table import table_heading, table_rows
from fogsim.offline.video_file import VideoFile

__all__ = [
    "CameraGuess",
    "FrameEstimates",
    "ImageFiles",
    "OverlayFile",
    "Picture",
    "Source",
    "Straightener",
    "VideoFile",
    "camera_text",
    "chosen_methods",
    "estimate_images",
    "estimates_of",
    "find_source",
    "guess_camera",
    "record_lines",
    "refuse_existing",
    "straightened",
    "table_heading",
    "table_rows",
    "write_camera",
]
