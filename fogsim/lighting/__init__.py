"""Belief to lamp states."""

from collections.abc import Callable

from fogsim.core.registry import Registry
from fogsim.lighting.beams import LampMount, own_head_lamps
from fogsim.lighting.legal import LegalRules
from fogsim.lighting.optimiser import SightOptimiser
from fogsim.lighting.protocol import LightingPolicy, VehicleLightingPolicy
from fogsim.lighting.rules import AlwaysHigh, FogLampRules, Gallen2014, LowBeamOnly

LIGHTING_POLICIES: Registry[Callable[..., LightingPolicy | VehicleLightingPolicy]] = Registry(
    "lighting policy",
    {
        "fog_lamp_rules": FogLampRules,
        "low_beam": LowBeamOnly,
        "always_low": LowBeamOnly,
        "always_high": AlwaysHigh,
        "gallen2014": Gallen2014,
        "legal": LegalRules,
        "longest_sight": SightOptimiser,
    },
    group="fogsim.lighting",
    methods=("lamps|choose_lamps",),
)

__all__ = [
    "LIGHTING_POLICIES",
    "FogLampRules",
    "LampMount",
    "LightingPolicy",
    "LowBeamOnly",
    "VehicleLightingPolicy",
    "own_head_lamps",
]
