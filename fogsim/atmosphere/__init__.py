"""Pure physics of light in fog: extinction, optical depth, airlight, lamplight, and what is visible in it."""

from fogsim.atmosphere.air import Air
from fogsim.atmosphere.fog.airlight import airlight_from_illuminance
from fogsim.atmosphere.fog.frustum import FrustumGrid, frustum_grid, radiance_through_grid
from fogsim.atmosphere.fog.koschmieder import fogged_radiance
from fogsim.atmosphere.fog.layer_airlight import layer_thickness, side_light, slant_airlight, slant_share
from fogsim.atmosphere.fog.medium import field_at, with_change
from fogsim.atmosphere.fog.optical_depth import (
    FieldAccess,
    FogNow,
    distance_at_depth,
    extinction,
    optical_depth,
    optical_depth_along,
)
from fogsim.atmosphere.fog_config import FogConfig, RouteBank
from fogsim.atmosphere.lamps.phase_function import Droplets
from fogsim.atmosphere.surfaces.tunnel_light import TunnelLight
from fogsim.atmosphere.visibility.night_visibility import FogKind, Observer, Pavement, visibility_distance
from fogsim.atmosphere.visibility.visibility_level import visibility_level
from fogsim.values.eye import veiling_luminance

__all__ = [
    "Air",
    "Droplets",
    "FieldAccess",
    "FogConfig",
    "FogKind",
    "FogNow",
    "FrustumGrid",
    "Observer",
    "Pavement",
    "RouteBank",
    "TunnelLight",
    "airlight_from_illuminance",
    "distance_at_depth",
    "extinction",
    "field_at",
    "fogged_radiance",
    "frustum_grid",
    "layer_thickness",
    "optical_depth",
    "optical_depth_along",
    "radiance_through_grid",
    "side_light",
    "slant_airlight",
    "slant_share",
    "veiling_luminance",
    "visibility_distance",
    "visibility_level",
    "with_change",
]
