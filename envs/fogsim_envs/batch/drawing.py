"""Episodes of the task's own distributions as numbers for the kernel: those of the Fast task with the same seed."""

import math
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from fogsim.traffic.drivers.adaptation import adaptation
from fogsim.traffic.templates.placement import VEHICLE_KINDS
from fogsim.units import KMH_PER_MPS, extinction_from_visibility
from fogsim_envs.batch.layout import BEGIN, DRIVERS
from fogsim_envs.task.episodes import SCRIPTS, VAN_SHARE, FogDistribution, ScenarioDistribution
from fogsim_envs.task.sampling import numbered
from fogsim_envs.task.surrogate import light_class

_NO_BANK = (0.0, 0.0, 1.0, 0.0)


def _actor(settings: tuple[str, ...]) -> tuple[float, float, float]:
    """Position [m], speed [m/s] and length [m] of the vehicle that a script sets; zeros without one."""
    if not settings:
        return 0.0, 0.0, 0.0
    numbers = {name: float(number) for name, number in re.findall(r"(\w+): (\d+)", settings[0])}
    length = VEHICLE_KINDS["truck" if "truck" in settings[0] else "car"].length
    position = numbers.get("position_m", BEGIN + numbers.get("gap_m", 0.0) + length)
    return position, numbers.get("speed_kmh", 0.0) / KMH_PER_MPS, length


_ACTORS = {name: _actor(settings) for name, settings in SCRIPTS.items()}


def draw_numbers(
    rng: np.random.Generator, split: int, scenes: ScenarioDistribution, fogs: FogDistribution
) -> tuple[float, ...]:
    """Fields of `DRAWN`, drawn as `EpisodeSource.draw` does."""
    seed, own = numbered(rng, split)
    own.integers(1)
    scene = scenes.draw_scene(own)
    fog = fogs.draw(own)
    patches = fog.get("patches", {})
    return (
        scene.lanes,
        scene.demand,
        scene.trucks,
        VAN_SHARE,
        DRIVERS.index(scene.driver),
        scene.illuminance,
        light_class(scene.illuminance),
        *adaptation(scene.illuminance),
        *_fog(fog),
        patches.get("strength", 0.0),
        patches.get("correlation_length_m", 1.0),
        *_ACTORS[scene.script],
        *(scene.braking if scene.script == "braking_lead" else (math.inf, 0.0, 0.0)),
        seed,
    )


def _fog(fog: Mapping[str, Any]) -> tuple[float, ...]:
    """Extinction coefficient outside, and start, end, edge and additional extinction of two banks [1/m, m]."""
    outside = extinction_from_visibility(float(fog.get("visibility_m", fog.get("outside_visibility_m", math.inf))))
    banks = [
        (one["start_m"], one["end_m"], one["edge_m"], extinction_from_visibility(one["visibility_m"]) - outside)
        for one in fog.get("banks", ())
    ]
    first, second, *_ = (*banks, _NO_BANK, _NO_BANK)
    return outside, *first, *second
