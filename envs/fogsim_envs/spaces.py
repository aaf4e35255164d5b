"""What agents see and what they may do: spaces, and the way from steps to observations and from actions to commands."""

import math
from typing import Annotated, Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from fogsim.core.parameters import Range
from fogsim.units import KMH_PER_MPS
from fogsim.values import Camera, Command, Lamp, SpeedAdvice, Step

_Side = Annotated[int, Range(16, 8192, "px")]
ImageSize = tuple[_Side, _Side]
"""Width and height of the camera, as far as scenarios allow [px]."""

SIGN_SLOTS = 8
SIGN_FEATURES = ("distance", "lateral", "value", "diameter")
_SIGN_SCALE = np.array([250.0, 25.0, 50.0, 2.0], dtype=np.float32)
"""What the features of a sign are divided by [m, m, m/s, m]."""

STATE_FEATURES = (
    "speed",
    "lead_present",
    "lead_distance",
    "lead_relative_speed",
    "estimate_valid",
    "estimate_visibility",
    "estimate_deviation",
    "belief_visibility",
    "belief_deviation",
    "advised_speed",
    "fog_lamps",
)
"""Meaning of the entries of ``state``; docs/reference/environments.md and the class docstring give their scales."""

SPEED_SCALE = 50.0
_LEAD_SCALE = 200.0
_LOG_VISIBILITY_SCALE = math.log(10_000.0)

ADVISED_SPEEDS = tuple(kmh / KMH_PER_MPS for kmh in range(20, 140, 10))
"""Advised speed of each level [m/s]; one more level means "no advice"."""

_SAME_SPEED = 1e-6
"""Speeds that differ by less are the same [m/s]."""

_BELOW_NONE = 1.0 - 1e-6

LAMP_MODES = (
    Lamp.POSITION | Lamp.LOW_BEAM,
    Lamp.POSITION | Lamp.LOW_BEAM | Lamp.FRONT_FOG,
    Lamp.POSITION | Lamp.LOW_BEAM | Lamp.FRONT_FOG | Lamp.REAR_FOG,
)
"""Lamps of each mode."""


def observation_space(camera: Camera) -> spaces.Dict:
    """Space of observations with images of a camera's size and bit depth."""
    pixels = np.uint8 if camera.bits == 8 else np.uint16
    return spaces.Dict(
        {
            "camera": spaces.Box(0, 2**camera.bits - 1, (camera.height, camera.width, 3), pixels),
            "signs": spaces.Box(-1.0, 1.0, (SIGN_SLOTS, len(SIGN_FEATURES)), np.float32),
            "signs_mask": spaces.MultiBinary(SIGN_SLOTS),
            "state": spaces.Box(-1.0, 1.0, (len(STATE_FEATURES),), np.float32),
        }
    )


ACTION_LEVELS = (len(ADVISED_SPEEDS) + 1, len(LAMP_MODES))
"""Levels of the advised speed and lamp modes."""


def action_space(continuous: bool, levels: tuple[int, int] = ACTION_LEVELS) -> spaces.Space[Any]:
    """Space of actions: two levels, or two numbers in −1 … 1."""
    return spaces.Box(-1.0, 1.0, (2,), np.float32) if continuous else spaces.MultiDiscrete(list(levels))


def observe(step: Step) -> dict[str, NDArray[Any]]:
    """Observation of a step: only what the vehicle itself has. Every array is the caller's own."""
    signs, mask = observed_signs(step)
    return {"camera": step.observation.image.copy(), "signs": signs, "signs_mask": mask, "state": _state(step)}


def observed_signs(step: Step) -> tuple[NDArray[np.float32], NDArray[np.int8]]:
    """Rows of signs ahead by the map, float32 (slots, features) in −1 … 1, and which of them are filled."""
    features = np.zeros((SIGN_SLOTS, len(SIGN_FEATURES)), dtype=np.float32)
    mask = np.zeros(SIGN_SLOTS, dtype=np.int8)
    for slot, sign in enumerate(step.observation.signs[:SIGN_SLOTS]):
        features[slot] = (sign.distance, sign.lateral, sign.value, sign.diameter)
        mask[slot] = 1
    return np.clip(features / _SIGN_SCALE, -1.0, 1.0), mask


def _state(step: Step) -> NDArray[np.float32]:
    lead, estimate, advice = step.observation.lead, step.estimates[0], step.command.advice.speed
    measured = estimate.valid and estimate.extinction > 0
    values = (
        step.observation.speed / SPEED_SCALE,
        float(lead is not None),
        lead.distance / _LEAD_SCALE if lead else 1.0,
        lead.relative_speed / SPEED_SCALE if lead else 0.0,
        float(estimate.valid),
        scaled_visibility(estimate.visibility) if estimate.valid else 1.0,
        estimate.standard_deviation / estimate.extinction if measured else 1.0,
        scaled_visibility(step.belief.visibility),
        step.belief.log_standard_deviation,
        advice / SPEED_SCALE if math.isfinite(advice) else 1.0,
        float(Lamp.FRONT_FOG in step.command.lamps or Lamp.REAR_FOG in step.command.lamps),
    )
    return np.clip(np.array(values, dtype=np.float32), -1.0, 1.0)


def scaled_visibility(visibility: float) -> float:
    """Visibility on a logarithmic scale, 1 m … 10 km to 0 … 1 (`visibility` [m])."""
    return min(math.log(max(visibility, 1.0)) / _LOG_VISIBILITY_SCALE, 1.0)


def command_of(action: Any, continuous: bool) -> Command:
    """Command that an action stands for."""
    if continuous:
        speed_share, lamp_share = (float(np.clip((a + 1) / 2, 0.0, 1.0)) for a in np.asarray(action, dtype=float))
        lowest, highest = ADVISED_SPEEDS[0], ADVISED_SPEEDS[-1]
        speed = math.inf if speed_share == 1.0 else lowest + speed_share * (highest - lowest)
        mode = min(int(lamp_share * len(LAMP_MODES)), len(LAMP_MODES) - 1)
    else:
        level, mode = (int(a) for a in action)
        speed = math.inf if level == len(ADVISED_SPEEDS) else ADVISED_SPEEDS[level]
    return Command(advice=SpeedAdvice(speed), lamps=LAMP_MODES[mode])


def action_of(speed: float, lamps: Lamp, continuous: bool) -> NDArray[Any]:
    """Action that stands for an advice, or for the next lower one, the inverse of `command_of` (`speed` [m/s])."""
    mode = max(number for number, lit in enumerate(LAMP_MODES) if lit & lamps == lit or number == 0)
    if not continuous:
        levels = [number for number, level in enumerate(ADVISED_SPEEDS) if level <= speed + _SAME_SPEED]
        level = len(ADVISED_SPEEDS) if math.isinf(speed) else max(levels, default=0)
        return np.array([level, mode])
    lowest, highest = ADVISED_SPEEDS[0], ADVISED_SPEEDS[-1]
    # The upper end stands for no advice.
    share = 1.0 if math.isinf(speed) else min(max((speed - lowest) / (highest - lowest), 0.0), _BELOW_NONE)
    return np.array([2.0 * share - 1.0, 2.0 * (mode + 0.5) / len(LAMP_MODES) - 1.0], dtype=np.float32)
