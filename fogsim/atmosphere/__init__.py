"""Pure physics of light in fog: extinction, optical depth, airlight."""

from fogsim.atmosphere.access import FieldAccess, FogNow
from fogsim.atmosphere.air import Air
from fogsim.atmosphere.daylight import airlight_from_illuminance
from fogsim.atmosphere.frustum import FrustumGrid, frustum_grid, radiance_through_grid
from fogsim.atmosphere.koschmieder import fogged_radiance
from fogsim.atmosphere.medium import field_at
from fogsim.atmosphere.optical_depth import extinction, optical_depth, optical_depth_along
from fogsim.atmosphere.phase import Droplets

__all__ = [
    "Air",
    "Droplets",
    "FieldAccess",
    "FogNow",
    "FrustumGrid",
    "airlight_from_illuminance",
    "extinction",
    "field_at",
    "fogged_radiance",
    "frustum_grid",
    "optical_depth",
    "optical_depth_along",
    "radiance_through_grid",
]
