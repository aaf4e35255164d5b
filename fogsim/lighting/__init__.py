"""Belief to lamp states."""

from collections.abc import Callable

from fogsim.lighting.head_lamps import LampMount, own_head_lamps
from fogsim.lighting.protocol import LightingPolicy
from fogsim.lighting.rules import FogLampRules, LowBeamOnly
from fogsim.registry import Registry

LIGHTING_POLICIES: Registry[Callable[..., LightingPolicy]] = Registry(
    "lighting policy",
    {"fog_lamp_rules": FogLampRules, "low_beam": LowBeamOnly},
    group="fogsim.lighting",
    methods=("lamps",),
)

__all__ = ["LIGHTING_POLICIES", "FogLampRules", "LampMount", "LightingPolicy", "LowBeamOnly", "own_head_lamps"]
