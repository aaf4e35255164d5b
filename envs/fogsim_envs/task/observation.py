"""What an agent of version 1 observes: only what the vehicle itself has."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from fogsim.advice.agent import SPEED_SCALE, agent_state, clipped, scaled_visibility
from fogsim.errors import UnknownNameError
from fogsim.values import Camera, Command, Estimate, Lamp, Step
from fogsim_envs.spaces import SIGN_FEATURES, SIGN_SLOTS, observation_space, observed_signs

_OBSERVATIONS = ("dict", "state", "camera", "camera+sign_map", "dict+sign_map")
"""What can be asked for: all of it, the numbers alone, or the picture alone; these with the picture of the sign map."""

_WAY, TIME = 2500.0, 300.0
"""What is 0 in ``state``: way [m] and time [s]. Nothing is −1, twice that 1."""

STATE_FEATURES = (
    "speed",
    "speed_limit",
    "distance_to_go",
    "time_left",
    "lane",
    "lanes",
    "lead_present",
    "lead_distance",
    "lead_relative_speed",
    "estimate_valid",
    "estimate_visibility",
    "estimate_deviation",
    "belief_5_percent",
    "belief_25_percent",
    "belief_median",
    "belief_75_percent",
    "belief_95_percent",
    "belief_deviation",
    "advised_speed",
    "front_fog_lamps",
    "rear_fog_lamp",
    "ambient_light",
)
"""Meaning of the entries of ``state``; the environment's docstring gives their scales."""

_LANE_SCALE = 5.0


def task_space(mode: str, camera: Camera | None) -> spaces.Space[Any]:
    """Space of observations."""
    if mode not in _OBSERVATIONS:
        raise UnknownNameError("observation", mode, _OBSERVATIONS)
    state = spaces.Box(-1.0, 1.0, (len(STATE_FEATURES),), np.float32)
    if mode == "state" or camera is None:
        return state
    known = observation_space(camera)
    # Flat, as libraries expect of what is no picture.
    signs = spaces.Box(-1.0, 1.0, (SIGN_SLOTS * len(SIGN_FEATURES),), np.float32)
    shape, depth = (camera.height, camera.width), np.uint8 if camera.bits == 8 else np.uint16
    return {
        "camera": known["camera"],
        "camera+sign_map": spaces.Box(0, 2**camera.bits - 1, (*shape, 4), depth),
        "dict": spaces.Dict({**known.spaces, "signs": signs, "state": state}),
        "dict+sign_map": spaces.Dict(
            {**known.spaces, "sign_map": spaces.Box(0, 255, (*shape, 3), np.uint8), "signs": signs, "state": state}
        ),
    }[mode]


def leading_estimate(estimates: Sequence[Estimate]) -> Estimate | None:
    """Estimate of the scenario's first estimator, perhaps invalid."""
    return estimates[0] if estimates else None


def first_valid_estimate(estimates: Sequence[Estimate]) -> Estimate | None:
    """First valid estimate, in the order of the scenario's estimators."""
    return next((one for one in estimates if one.valid), None)


def task_observation(
    step: Step, estimate: Estimate | None, mode: str, own: Command, duration: float, way_end: float
) -> Any:
    """Observation of a step. Every array is the caller's own (`duration` [s], `way_end` [m])."""
    if mode == "camera":
        return step.observation.image.copy()
    if mode == "camera+sign_map":
        nearness = step.observation.sign_map[:, :, 1:2]
        return np.concatenate([step.observation.image, nearness], axis=2, dtype=step.observation.image.dtype)
    state = task_state(step, estimate, own, duration - step.time, way_end - step.route_position)
    if mode == "state":
        return state
    signs, mask = observed_signs(step)
    whole = {"camera": step.observation.image.copy(), "signs": signs.ravel(), "signs_mask": mask, "state": state}
    return {**whole, "sign_map": step.observation.sign_map} if mode == "dict+sign_map" else whole


def task_state(
    step: Step, estimate: Estimate | None, own: Command, time_left: float, to_go: float
) -> NDArray[np.float32]:
    """Entries of ``state`` (`STATE_FEATURES`), float32 in −1 … 1 (`time_left` [s], `to_go` [m])."""
    known, advice = agent_state(step.observation, step.belief), own.advice.speed
    lane, lanes = _lane(step)
    values = (
        known[0],
        step.speed_limit / SPEED_SCALE - 1.0,
        to_go / _WAY - 1.0,
        time_left / TIME - 1.0,
        lane / _LANE_SCALE,
        lanes / _LANE_SCALE,
        *known[1:4],
        *_estimate(estimate),
        *known[4:10],
        advice / SPEED_SCALE - 1.0 if math.isfinite(advice) else 1.0,
        float(Lamp.FRONT_FOG in own.lamps),
        float(Lamp.REAR_FOG in own.lamps),
        known[10],
    )
    return clipped(values)


def _estimate(estimate: Estimate | None) -> tuple[float, float, float]:
    if estimate is None or not estimate.valid:
        return 0.0, 1.0, 1.0
    deviation = estimate.standard_deviation / estimate.extinction if estimate.extinction > 0.0 else 1.0
    return 1.0, scaled_visibility(estimate.visibility), deviation


def _lane(step: Step) -> tuple[int, int]:
    """Number of the ego's lane from the right, and how many lanes there are."""
    own = step.traffic.lane[step.ego]
    ways: Mapping[str, Sequence[str]] = step.truth.carriageways
    lanes = ways.get(own.rpartition("_")[0], ())
    return (lanes.index(own), len(lanes)) if own in lanes else (0, max(len(lanes), 1))
