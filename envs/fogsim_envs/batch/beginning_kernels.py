"""How episodes of a batch begin: the fog along the road, the traffic on it, and what the ego knows first."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim_envs.batch.belief_kernels import normals, uniform
from fogsim_envs.batch.drive_kernels import (
    ACCELERATION,
    BRAKING,
    HEADWAY,
    LIMIT,
    REACTION,
    find_leader,
    perceive,
    safe_speed,
)
from fogsim_envs.batch.layout import (
    BEGIN,
    CELL,
    CELLS,
    CELLS_AHEAD,
    LENGTH,
    OTHERS,
    Episodes,
    RuleConstants,
    SurrogateArrays,
)

_FREE, _FILLING_GAP, _TRUCK_SPEED = 120.0, 25.0, 24.7
"""Where the filled road begins, least distance of vehicles on it [m], and a truck's top speed [m/s]."""


@kernel
def _lay_fog(one: Any, drawn: Any, depth: NDArray[np.float64]) -> None:
    """Fill in the optical depth along the road: banks with soft edges, and patches."""
    noise, patches = np.empty(CELLS_AHEAD // 2 + 18), np.ones(CELLS_AHEAD // 2 + 2)
    if drawn.strength > 0.0:
        for i in range(0, len(noise), 2):
            noise[i], noise[min(i + 1, len(noise) - 1)] = normals(one)
        for i in range(len(patches)):
            total = squares = 0.0
            for j in range(17):
                # White noise through a bell, so that the correlation is e^(−(Δ / ℓ)²).
                weight = math.exp(-2.0 * (2.0 * CELL * (j - 8) / drawn.correlation) ** 2)
                total += weight * noise[i + j]
                squares += weight * weight
            patches[i] = math.exp(drawn.strength * total / math.sqrt(squares) - 0.5 * drawn.strength**2)
    depth[0] = 0.0
    for i in range(1, CELLS_AHEAD):
        position = CELL * (i - 0.5)
        extinction = drawn.outside
        extinction += drawn.extra_0 * (
            _risen(position, drawn.start_0, drawn.edge_0) - _risen(position, drawn.end_0, drawn.edge_0)
        )
        extinction += drawn.extra_1 * (
            _risen(position, drawn.start_1, drawn.edge_1) - _risen(position, drawn.end_1, drawn.edge_1)
        )
        at = 0.5 * position / CELL
        low = int(at)
        factor = patches[low] + (at - low) * (patches[low + 1] - patches[low])
        depth[i] = depth[i - 1] + CELL * extinction * factor


@kernel
def _risen(position: float, middle: float, edge: float) -> float:
    """Share to which a soft edge has risen (`position`, `middle`, `edge` [m])."""
    t = min(max((position - middle) / max(edge, 1e-6) + 0.5, 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)


@kernel
def _find_place(one: Any, others: Any, j: int) -> None:
    """Place a vehicle where it blocks no other; off the road where no such place is found."""
    it = others[j]
    for _ in range(10):
        place = _FREE + (LENGTH - _FREE) * uniform(one)
        is_clear = it.lane > 0 or safe_speed(place - it.length - BEGIN, it.speed, HEADWAY, BRAKING) >= LIMIT
        for k in range(j):
            if others[k].lane == it.lane and abs(others[k].position - place) < _FILLING_GAP:
                is_clear = False
        if is_clear:
            it.position = place
            return


@kernel
def _place_traffic(one: Any, drawn: Any, others: Any) -> None:
    """Place the actor, if there is one, and other vehicles anywhere along the lanes."""
    for j in range(OTHERS):
        others[j].length, others[j].position = 0.0, -1e9
    it = others[0]
    if drawn.actor_length > 0.0:
        it.position, it.speed, it.wanted = drawn.actor_position, drawn.actor_speed, drawn.actor_speed
        it.length, it.lane, it.factor, it.dawdling = drawn.actor_length, 0, 1.0, 0.0
        it.headway, it.power, it.braking = HEADWAY, ACCELERATION, BRAKING
    per_lane = drawn.demand / 3600.0 / one.lanes * (LENGTH - _FREE) / (0.9 * LIMIT)
    due, j = 0.0, 1
    slow = min(1.0, drawn.trucks * one.lanes)
    for lane in range(one.lanes):
        due += per_lane
        while due >= 1.0 and j < OTHERS:
            due -= 1.0
            it, is_slow = others[j], lane == 0 and uniform(one) < slow
            deviate, own = normals(one)
            is_van = not is_slow and uniform(one) < drawn.vans
            it.lane, it.factor, it.dawdling = lane, math.exp(0.1 * own), 0.3 if is_slow else 0.4
            it.wanted = min(max((0.9 if is_van else 0.95) + 0.1 * deviate, 0.75), 1.2) * LIMIT
            it.length, it.headway = 5.9 if is_van else 4.6, HEADWAY
            it.power, it.braking = ACCELERATION, BRAKING
            if is_slow:
                it.wanted, it.length, it.headway, it.power, it.braking = _TRUCK_SPEED, 15.5, 1.8, 0.8, 4.0
            it.speed = it.wanted
            _find_place(one, others, j)
            j += 1


@kernel
def begin(
    episodes: Episodes,
    rows: NDArray[np.int64],
    draws: Any,
    table: SurrogateArrays,
    rule: RuleConstants,
) -> None:
    """Begin episodes in some rows (`draws` (rows,) of `DRAWN`)."""
    scratch = np.empty((2, CELLS))
    for r in range(len(rows)):
        i, drawn = rows[r], draws[r]
        one = episodes.ego[i]
        one.random = drawn.seed
        one.time, one.position, one.speed, one.acceleration = 0.0, BEGIN, LIMIT, 0.0
        one.lane, one.lanes, one.lamps, one.rule_lamps, one.ending, one.struck = 0, int(drawn.lanes), 0, 0, 0, 0
        one.driver, one.illuminance, one.light = drawn.driver, drawn.illuminance, drawn.light
        one.airlight, one.luminance, one.eye_threshold = drawn.airlight, drawn.luminance, drawn.eye_threshold
        one.flux_root, one.luminance_root = drawn.flux_root, drawn.luminance_root
        one.brakes_from, one.braking, one.hold = drawn.brakes_from, drawn.braking, drawn.hold
        one.common, one.error = normals(one)
        one.width, _ = normals(one)
        one.valid, one.seen_for, one.since_change = 1, 2.0 * REACTION, 2.0
        one.evidence, one.raise_since, one.pressed = -math.inf, math.nan, 0.0
        one.advised = one.rule_speed = math.inf
        for c in range(CELLS):
            episodes.belief[i, c] = 1.0 / CELLS
        for t in range(episodes.terms.shape[1]):
            episodes.terms[i, t] = 0.0
        _lay_fog(one, drawn, episodes.depth[i])
        _place_traffic(one, drawn, episodes.others[i])
        find_leader(one, episodes.others[i])
        perceive(one, episodes.depth[i], episodes.belief[i], episodes.state[i], table, rule, scratch)
