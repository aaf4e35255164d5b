"""Contrast restoration: pictures in daytime fog, as far as possible as without it, one method a module."""

from fogsim.restoration.methods import METHODS
from fogsim.restoration.picture import Restoration
from fogsim.restoration.restore import MOST_GAIN, restore_contrast

__all__ = ["METHODS", "MOST_GAIN", "Restoration", "restore_contrast"]
