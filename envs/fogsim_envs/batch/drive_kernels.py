"""Road, fog, traffic, reward and observation of many episodes: one kernel moves them all by a decision period."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.core.kinematics import DECELERATION, REACTION_TIME
from fogsim.traffic.drivers.adaptation import Adaptation
from fogsim.traffic.drivers.sight_kernels import depth_limit
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values.belief import THINNEST
from fogsim_envs.batch.belief_kernels import answer_rule, draw_estimate, normals, uniform, update_belief
from fogsim_envs.batch.layout import (
    ARRIVED,
    BEGIN,
    CELL,
    CELLS,
    CELLS_AHEAD,
    CHOSEN_SHARE,
    CHOSEN_SPEED,
    COLLISION,
    DURATION,
    END,
    LENGTH,
    OTHERS,
    STEP,
    TIME,
    Episodes,
    RuleConstants,
    SurrogateArrays,
)

LIMIT = 130.0 / 3.6
ACCELERATION, BRAKING, _EMERGENCY, HEADWAY, _MINIMUM_GAP = 2.6, 4.5, 9.0, 1.4, 2.5
"""Of the ego, a car: [m/s²], time headway [s] and gap at a standstill [m]."""

_ADVICE_BRAKING, _COMFORTABLE, _LENGTH = 2.0, 2.0, 4.6  # [m/s²], [m]
_CONTRAST_THRESHOLD, _HEADLAMP_REACH, _REAR_LAMP, _CONTRAST = 0.05, 55.0, 8.0, 0.9
"""Eyes, and a typical rear: see `fogsim.traffic.drivers.sight`; [m], [cd]."""

REACTION, _REACH, _RADAR = 1.0, 250.0, 200.0
"""Time from first sight to reaction [s]; farthest leader that matters, and that the radar tracks [m]."""

_PATIENCE, _KEEPS_LEFT = 0.3, 35.0
"""Time lost behind a leader after which a driver overtakes, and time after which one moves back to the right [s], as
SUMO's drivers do in the Fast task."""


_ARRIVAL = END + 0.2
"""Where an episode is over [m]: an ego at 1940.17 m was still under way in the Fast task."""


@kernel
def _depth_at(depth: NDArray[np.float64], position: float) -> float:
    """Optical depth from the road's beginning to a place [-]."""
    place = min(float(CELLS_AHEAD - 2), max(0.0, position / CELL))
    low = int(place)
    return float(depth[low] + (position / CELL - low) * (depth[low + 1] - depth[low]))


@kernel
def _visibility_at(depth: NDArray[np.float64], position: float) -> float:
    """Visibility at a place [m]."""
    low = int(min(float(CELLS_AHEAD - 2), max(0.0, position / CELL)))
    return float(OPTICAL_DEPTH_AT_VISIBILITY / max((depth[low + 1] - depth[low]) / CELL, THINNEST))


@kernel
def _look_ahead(one: Any, depth: NDArray[np.float64]) -> None:
    """Visibility where the ego is, and as far as one sees ahead."""
    one.visibility = _visibility_at(depth, one.position)
    sought = _depth_at(depth, one.position) + OPTICAL_DEPTH_AT_VISIBILITY
    low, high = int(min(float(CELLS_AHEAD - 2), max(0.0, one.position / CELL))), CELLS_AHEAD - 1
    if depth[high] > sought:
        while high - low > 1:
            middle = (low + high) // 2
            if depth[middle] > sought:
                high = middle
            else:
                low = middle
        slope = depth[high] - depth[low]
        one.visibility_ahead = CELL * (low + (sought - depth[low]) / slope) - one.position
    else:
        slope = max((depth[high] - depth[high - 1]) / CELL, 1e-12)
        one.visibility_ahead = CELL * high - one.position + (sought - depth[high]) / slope


@kernel
def _is_seen(one: Any, depth: NDArray[np.float64], position: float, gap: float) -> bool:
    """Whether a driver sees the rear of a vehicle (`position`, `gap` [m])."""
    distance = max(gap + 2.0, 1.0)
    eyes = Adaptation(one.airlight, one.luminance, one.eye_threshold, one.flux_root, one.luminance_root)
    limit = depth_limit(eyes, _CONTRAST_THRESHOLD, _HEADLAMP_REACH, distance, _CONTRAST, _REAR_LAMP, 1.0)
    return _depth_at(depth, position + distance) - _depth_at(depth, position) <= limit


@kernel
def safe_speed(gap: float, leader_speed: float, headway: float, braking: float) -> float:
    """Safe speed behind a leader by SUMO's Krauss model with Euler steps [m/s]."""
    lost = braking * STEP
    steps = math.floor(leader_speed / lost)
    room = gap - _MINIMUM_GAP + STEP * (steps * leader_speed - 0.5 * lost * steps * (steps + 1.0))
    if room <= 0.0:
        return 0.0
    root = math.sqrt(STEP**2 + 4.0 * (STEP * (2.0 * room / lost - headway) + headway**2))
    steps = math.floor(0.5 - (headway - 0.5 * root) / STEP)
    stopping = 0.5 * steps * (steps - 1.0) * lost * STEP + steps * lost * headway
    return steps * lost + (room - stopping) / (steps * STEP + headway)


@kernel
def _followed_speed(speed: float, gap: float, leader_speed: float, headway: float, braking: float) -> float:
    """Speed behind a leader by SUMO: hard braking is no harder than what the leader's own braking asks for [m/s]."""
    safe = safe_speed(gap, leader_speed, headway, braking)
    planned = (speed - safe) / STEP
    room = gap - _MINIMUM_GAP
    if planned <= braking or room <= 0.0:
        return safe
    needed = 0.5 * speed**2 / (room + 0.5 * leader_speed**2 / braking)
    if needed > braking:
        needed = 0.5 * (speed**2 - leader_speed**2) / room
    return max(speed - STEP * min(max(1.2 * needed, braking), planned), 0.0)


@kernel
def _chosen(driver: int, visibility: float, wanted: float, factor: float) -> float:
    """Speed that a driver chooses in fog [m/s] (`wanted` [m/s]: in clear air)."""
    if visibility >= CHOSEN_SPEED.shape[1] - 1:
        return wanted
    column = int(visibility)
    return float(min(wanted * CHOSEN_SHARE[driver, column], factor * CHOSEN_SPEED[driver, column]))


@kernel
def _neighbours(others: Any, lane: int, position: float) -> tuple[int, int]:
    """Who is next ahead in a lane, and behind; −1 for none (`position` [m])."""
    ahead = behind = -1
    for j in range(OTHERS):
        if others[j].length == 0.0 or others[j].lane != lane or others[j].position > LENGTH:
            continue
        if others[j].position >= position:
            if ahead < 0 or others[j].position < others[ahead].position:
                ahead = j
        elif behind < 0 or others[j].position > others[behind].position:
            behind = j
    return ahead, behind


@kernel
def find_leader(one: Any, others: Any) -> None:
    """Find the ego's leader."""
    ahead, _ = _neighbours(others, one.lane, one.position)
    one.gap, one.leader_speed = math.inf, 0.0
    if ahead >= 0:
        one.gap = others[ahead].position - others[ahead].length - one.position
        one.leader_speed = others[ahead].speed


@kernel
def _ego_speed(one: Any, others: Any, depth: NDArray[np.float64]) -> float:
    """Speed of the ego after the step [m/s]; it changes lanes where a slower leader is in the way."""
    own = _chosen(int(one.driver), one.visibility_ahead, LIMIT, 1.0)
    wanted = min(one.advised, own, LIMIT)
    if wanted < LIMIT:
        wanted = max(wanted, one.speed - _ADVICE_BRAKING * STEP)
    wanted = min(wanted, one.speed + ACCELERATION * STEP)
    one.since_change += STEP
    if one.gap < _REACH and _is_seen(one, depth, one.position, one.gap):
        one.seen_for += STEP
    else:
        one.seen_for = 0.0
    safe = math.inf
    if one.seen_for > REACTION:
        safe = _followed_speed(one.speed, one.gap, one.leader_speed, HEADWAY, BRAKING)
        one.pressed = one.pressed + STEP * (1.0 - one.leader_speed / max(wanted, 1.0)) if safe < wanted else 0.0
        if one.pressed > _PATIENCE and _is_free(one, others, depth, one.lane + 1, wanted):
            one.lane, one.since_change, one.pressed = one.lane + 1, 0.0, 0.0
            find_leader(one, others)
            safe = math.inf
    elif one.since_change > _KEEPS_LEFT and one.lane > 0 and _is_free(one, others, depth, one.lane - 1, LIMIT + 5.0):
        one.lane, one.since_change = one.lane - 1, 0.0
        find_leader(one, others)
    return float(max(min(wanted, safe), one.speed - _EMERGENCY * STEP, 0.0))


@kernel
def _is_free(one: Any, others: Any, depth: NDArray[np.float64], lane: int, speed: float) -> bool:
    """Whether the ego can change to a lane and drive a speed there (`speed` [m/s])."""
    if lane >= one.lanes:
        return False
    ahead, behind = _neighbours(others, lane, one.position)
    if ahead >= 0:
        gap = others[ahead].position - others[ahead].length - one.position
        is_slow = safe_speed(gap, others[ahead].speed, HEADWAY, BRAKING) < speed
        if gap < _MINIMUM_GAP or (is_slow and _is_seen(one, depth, one.position, gap)):
            return False
    if behind >= 0:
        gap = one.position - _LENGTH - others[behind].position
        return bool(
            gap > 0.0 and safe_speed(gap, one.speed, others[behind].headway, BRAKING) >= others[behind].speed - 2.0
        )
    return True


@kernel
def _lead_speed(one: Any, lead: Any, wanted: float) -> float:
    """Speed that the scripted lead wants: it comes to a standstill once, for a while (`wanted` [m/s])."""
    if lead.position <= one.brakes_from or one.hold <= 0.0:
        return wanted
    if lead.speed <= 0.0:
        one.hold -= STEP
    return float(max(lead.speed - one.braking * STEP, 0.0))


@kernel
def _leader_of(one: Any, others: Any, number: int, j: int) -> tuple[float, float]:
    """Gap to whom another vehicle follows, the ego included, and the leader's speed [m, m/s]."""
    it, gap, leader_speed = others[j], math.inf, 0.0
    for k in range(number):
        far = others[k].position - it.position
        if k != j and others[k].lane == it.lane and 0.0 <= far - others[k].length < gap and far < _REACH:
            gap, leader_speed = far - others[k].length, others[k].speed
    far = one.position - _LENGTH - it.position
    if one.lane == it.lane and -_LENGTH < far < gap:
        gap, leader_speed = far, one.speed
    return gap, leader_speed


@kernel
def _other_speed(one: Any, others: Any, number: int, j: int, depth: NDArray[np.float64]) -> float:
    """Speed of another vehicle after the step [m/s]."""
    it = others[j]
    desired = it.wanted
    if desired > 0.0:
        chosen = _chosen(1, _visibility_at(depth, it.position), it.wanted, it.factor)
        desired = chosen if chosen >= it.speed else max(chosen, it.speed - _ADVICE_BRAKING * STEP)
    if j == 0:
        desired = _lead_speed(one, it, desired)
    desired = min(desired, it.speed + it.power * STEP)
    gap, leader_speed = _leader_of(one, others, number, j)
    if gap < _REACH:
        safe = _followed_speed(it.speed, gap, leader_speed, it.headway, it.braking)
        if safe < desired and _is_seen(one, depth, it.position, gap):
            desired = max(safe, it.speed - _EMERGENCY * STEP)
    return float(max(desired - it.dawdling * it.power * STEP * uniform(one), 0.0))


@kernel
def _move_others(one: Any, others: Any, depth: NDArray[np.float64], speeds: NDArray[np.float64]) -> None:
    """Move the other vehicles, each by what it saw before the step; who leaves the road enters it again."""
    number = OTHERS
    while number > 0 and others[number - 1].length == 0.0:
        number -= 1
    for j in range(number):
        if others[j].length > 0.0 and others[j].position <= LENGTH:
            speeds[j] = _other_speed(one, others, number, j, depth)
    for j in range(number):
        it = others[j]
        if it.length > 0.0 and it.position <= LENGTH:
            it.speed = speeds[j]
            it.position += STEP * it.speed
        elif j > 0 and it.length > 0.0:
            _enter(one, others, j)


@kernel
def _enter(one: Any, others: Any, j: int) -> None:
    """Let a vehicle that has left the road enter it again where there is room, slow ones in the right lane."""
    it = others[j]
    lane = 0 if it.length > 6.0 else int(one.lanes * uniform(one))
    for k in range(OTHERS):
        if k != j and others[k].length > 0.0 and others[k].lane == lane and others[k].position < 80.0:
            return
    if one.lane == lane and one.position < 80.0:
        return
    it.lane, it.position, it.speed = lane, 0.0, it.wanted


@kernel
def perceive(
    one: Any,
    depth: NDArray[np.float64],
    belief: NDArray[np.float64],
    state: NDArray[np.float32],
    table: SurrogateArrays,
    rule: RuleConstants,
    scratch: NDArray[np.float64],
) -> None:
    """What the ego gets to know after a step, what the rule answers, and the entries of ``state``."""
    _look_ahead(one, depth)
    distance, speed = normals(one)
    one.lead_present = 1 if one.gap <= _RADAR else 0
    one.lead_distance = max(one.gap + 0.25 * distance, 0.0)
    one.lead_speed = one.leader_speed - one.speed + 0.1 * speed
    draw_estimate(one, table)
    update_belief(one, belief, scratch)
    answer_rule(one, rule, LIMIT)
    for i in range(len(state)):
        state[i] = 0.0
    state[0], state[1] = one.speed / 25.0 - 1.0, LIMIT / 25.0 - 1.0
    state[2], state[3] = (END - one.position) / 2500.0 - 1.0, (DURATION - one.time) / 300.0 - 1.0
    state[4], state[5], state[6] = one.lane / 5.0, one.lanes / 5.0, one.lead_present
    state[7] = one.lead_distance / 100.0 - 1.0 if one.lead_present else 1.0
    state[8] = one.lead_speed / 25.0 if one.lead_present else 0.0
    state[9], state[10], state[11] = one.valid, 1.0, 1.0
    if one.valid and one.estimate > 0.0:
        state[10] = math.log10(OPTICAL_DEPTH_AT_VISIBILITY / one.estimate / 100.0)
        state[11] = one.estimate_deviation / one.estimate
    state[12], state[13] = math.log10(one.quantile_5 / 100.0), math.log10(one.quantile_25 / 100.0)
    state[14], state[15] = math.log10(one.quantile_50 / 100.0), math.log10(one.quantile_75 / 100.0)
    state[16], state[17] = math.log10(one.quantile_95 / 100.0), one.belief_deviation
    state[18] = one.advised / 25.0 - 1.0 if one.advised < math.inf else 1.0
    state[19], state[20] = min(one.lamps, 1), max(one.lamps - 1, 0)
    state[21] = 2.0 * (math.log10(one.illuminance) + 1.0) / 6.0 - 1.0
    for i in range(len(state)):
        state[i] = min(max(state[i], -1.0), 1.0)


@kernel
def advance(episodes: Episodes, weights: NDArray[np.float64], table: SurrogateArrays, rule: RuleConstants) -> None:
    """Let the advice and lamps of each episode be in force for one decision period (`weights` (9,) [points])."""
    scratch, speeds = np.empty((2, CELLS)), np.zeros(OTHERS)
    for i in range(len(episodes.ego)):
        one, others, depth = episodes.ego[i], episodes.others[i], episodes.depth[i]
        speed = _ego_speed(one, others, depth)
        _move_others(one, others, depth, speeds)
        one.acceleration, one.speed = (speed - one.speed) / STEP, speed
        driven = STEP * speed
        one.position += driven
        one.time += STEP
        find_leader(one, others)
        _, behind = _neighbours(others, one.lane, one.position)
        one.struck = 0
        if one.gap < 0.0:
            one.ending, one.struck = COLLISION, 1
        elif behind >= 0 and others[behind].position > one.position - _LENGTH:
            one.ending = COLLISION
        elif one.position >= _ARRIVAL:
            one.ending = ARRIVED
        elif one.time >= DURATION:
            one.ending = TIME
        perceive(one, depth, episodes.belief[i], episodes.state[i], table, rule, scratch)
        _reward(one, driven, episodes.terms[i])
        for t in range(len(weights)):
            episodes.terms[i, t] *= weights[t]


@kernel
def _reward(one: Any, driven: float, terms: NDArray[np.float64]) -> None:
    """Terms of the reward without weights; see `fogsim_envs.task.rewards.task_terms` (`driven` [m])."""
    length = END - BEGIN
    share, time_at_limit = driven / length, length / LIMIT
    needed = one.speed * REACTION_TIME + one.speed**2 / (2.0 * DECELERATION)
    unseen = max(0.0, 1.0 - one.visibility_ahead / needed) if needed > 0.0 else 0.0
    is_early = one.ending in (COLLISION, TIME)
    lost = max(DURATION - one.time, 0.0) if is_early else 0.0
    closing = one.speed - one.leader_speed
    in_danger = one.gap < math.inf and closing > 0.0
    conflict = max(0.0, 1.0 - max(one.gap, 0.0) / closing / 3.0) if in_danger else 0.0
    terms[0], terms[1] = min(driven, LIMIT * STEP) / length, -(STEP + lost) / time_at_limit
    terms[2], terms[3] = 1.0 if one.ending == ARRIVED else 0.0, -share * unseen
    terms[4], terms[5] = -STEP * conflict, -STEP * max(-one.acceleration - _COMFORTABLE, 0.0)
    terms[6] = -one.struck
    terms[7] = -share if (one.lamps >= 2) != (one.visibility < 50.0) else 0.0
    terms[8] = -share if (one.lamps >= 1) != (one.visibility < 100.0) else 0.0
