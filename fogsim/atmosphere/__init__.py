"""Pure physics of light in fog: extinction, optical depth, airlight."""

from fogsim.atmosphere.access import FieldAccess
from fogsim.atmosphere.air import Air
from fogsim.atmosphere.daylight import airlight_from_illuminance
from fogsim.atmosphere.koschmieder import fogged_radiance
from fogsim.atmosphere.optical_depth import extinction, optical_depth

__all__ = ["Air", "FieldAccess", "airlight_from_illuminance", "extinction", "fogged_radiance", "optical_depth"]
