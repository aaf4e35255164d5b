"""Contrast restoration: pictures in daytime fog, as far as possible as without it, one method a module."""

from fogsim.vision.restoration.methods import METHODS
from fogsim.vision.restoration.picture import Restoration
from fogsim.vision.restoration.restore import MOST_GAIN, restore_contrast

__all__ = ["METHODS", "MOST_GAIN", "Restoration", "restore_contrast"]
