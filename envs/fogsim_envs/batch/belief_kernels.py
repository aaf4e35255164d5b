"""What the ego makes of the fog: estimates drawn as the estimator errs, the belief, and the built-in rule's answer."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.core.exponential import exponential
from fogsim.core.jit import kernel
from fogsim.core.kinematics import DECELERATION, REACTION_TIME
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY, extinction_from_visibility
from fogsim.values.belief import NO_FOG, OLDEST
from fogsim_envs.batch.layout import CELLS, LOG_EXTINCTION, STEP, RuleConstants, SurrogateArrays

# Defaults of `fogsim.fusion.GridFilter`; a test compares the two.
_DRIFT, _LEAP_RATE, _LEAP_SCALE, _FLOOR, _OUTLIERS, _SLOW, _STILL = 0.05, 0.05, 1.0, 0.05, 0.07, 15.0, 0.1
_WIDTH = float(LOG_EXTINCTION[1] - LOG_EXTINCTION[0])
_LOG_RANGE = float(LOG_EXTINCTION[-1] - LOG_EXTINCTION[0])
_EXTINCTION = np.exp(LOG_EXTINCTION)
_IN_FOG = np.maximum(LOG_EXTINCTION, math.log(extinction_from_visibility(NO_FOG)))
_SHARES = np.array([0.05, 0.25, 0.5, 0.75, 0.95])
_FADING = math.exp(-_WIDTH / _LEAP_SCALE)
_FADED = _FADING ** np.arange(1.0, CELLS + 1.0)
_CLEAR = 3e-5

GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_MIX_1, _MIX_2 = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_S30, _S27, _S31, _S11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)


@kernel
def uniform(one: Any) -> float:
    """Next random number of an episode, above 0 and below 1 (splitmix64)."""
    one.random += GOLDEN
    z = one.random
    z = (z ^ (z >> _S30)) * _MIX_1
    z = (z ^ (z >> _S27)) * _MIX_2
    z = z ^ (z >> _S31)
    return (float(z >> _S11) + 0.5) * 1.1102230246251565e-16


@kernel
def normals(one: Any) -> tuple[float, float]:
    """Two normal deviates (Box-Muller)."""
    size, angle = math.sqrt(-2.0 * math.log(uniform(one))), 2.0 * math.pi * uniform(one)
    return size * math.cos(angle), size * math.sin(angle)


@kernel
def _at(quantiles: NDArray[np.float64], normal: float) -> float:
    """Quantile at the share of a normal distribution below a deviate."""
    place = 0.5 * (1.0 + math.erf(normal / math.sqrt(2.0))) * (len(quantiles) - 1)
    low = min(int(place), len(quantiles) - 2)
    return float(quantiles[low] + (place - low) * (quantiles[low + 1] - quantiles[low]))


@kernel
def draw_estimate(one: Any, table: SurrogateArrays) -> None:
    """Draw the next estimate; see `fogsim_envs.task.surrogate.EstimatorSurrogate.estimate`."""
    new, width = normals(one)
    own, light, column = math.sqrt(1.0 - table.persistence**2), int(one.light), 0
    while column < len(table.edges) - 2 and one.visibility_ahead > table.edges[column + 1]:
        column += 1
    one.error = table.persistence * one.error + own * new
    one.width = table.persistence * one.width + own * width
    likely = table.stays_valid[light, column] if one.valid else table.becomes_valid[light, column]
    valid, none = uniform(one), uniform(one)
    one.valid = 1 if valid < likely else 0
    if not one.valid:
        return
    one.evidence = one.time
    if none < table.none_seen[light, column]:
        one.estimate, one.estimate_deviation = 0.0, math.exp(_at(table.none_deviation[light, column], one.width))
        return
    drawn = math.sqrt(table.episode_share) * one.common + math.sqrt(1.0 - table.episode_share) * one.error
    one.estimate = max(OPTICAL_DEPTH_AT_VISIBILITY / one.visibility_ahead, _CLEAR)
    one.estimate *= math.exp(_at(table.error[light, column], drawn))
    one.estimate_deviation = one.estimate * math.exp(_at(table.deviation[light, column], one.width))


@kernel
def update_belief(one: Any, belief: NDArray[np.float64], scratch: NDArray[np.float64]) -> None:
    """Let time pass and an estimate count, as `fogsim.fusion.GridFilter` does (`scratch` (2, CELLS))."""
    if one.time > 0.0:
        moving = min(max(round(10.0 * one.speed / _SLOW) / 10.0, _STILL), 1.0)
        _diffuse(belief, STEP * moving, scratch)
    if one.valid:
        measured = min(one.estimate, _EXTINCTION[-1])
        deviation = math.hypot(min(one.estimate_deviation, 10.0), _FLOOR * max(measured, _EXTINCTION[0]))
        outlier = 1.0 / (_LOG_RANGE * max(measured, deviation))
        share = (1.0 - _OUTLIERS) / _OUTLIERS / (math.sqrt(2.0 * math.pi) * deviation * outlier)
        precision = 1.0 / deviation
        for i in range(CELLS):
            far = (measured - _EXTINCTION[i]) * precision
            belief[i] *= 1.0 + share * exponential(-0.5 * far * far)
    total = 0.0
    for i in range(CELLS):
        total += belief[i]
    _summarise(one, belief, 1.0 / total)


@kernel
def _summarise(one: Any, belief: NDArray[np.float64], scale: float) -> None:
    """Normalise the belief; its quantiles and deviations."""
    mean = square = fog_mean = fog_square = reached = before = 0.0
    place, below = 0, LOG_EXTINCTION[0]
    for i in range(CELLS):
        belief[i] *= scale
        share, value, fog = belief[i], LOG_EXTINCTION[i], _IN_FOG[i]
        mean += share * value
        square += share * value * value
        fog_mean += share * fog
        fog_square += share * fog * fog
        middle = reached + 0.5 * share
        reached += share
        while place < 5 and middle > _SHARES[place]:
            quantile = value
            if i > 0:
                quantile = below + (value - below) * (_SHARES[place] - before) / (middle - before)
            _put_quantile(one, place, OPTICAL_DEPTH_AT_VISIBILITY / math.exp(quantile))
            place += 1
        before, below = middle, value
    while place < 5:
        _put_quantile(one, place, OPTICAL_DEPTH_AT_VISIBILITY / _EXTINCTION[-1])
        place += 1
    one.belief_deviation = math.sqrt(max(square - mean * mean, 0.0))
    one.fog_deviation = math.sqrt(max(fog_square - fog_mean * fog_mean, 0.0))


@kernel
def _put_quantile(one: Any, place: int, visibility: float) -> None:
    """Keep a quantile of the visibility [m] by its place in `_SHARES`."""
    if place == 0:
        one.quantile_95 = visibility
    elif place == 1:
        one.quantile_75 = visibility
    elif place == 2:
        one.quantile_50 = visibility
    elif place == 3:
        one.quantile_25 = visibility
    else:
        one.quantile_5 = visibility


@kernel
def _diffuse(belief: NDArray[np.float64], elapsed: float, scratch: NDArray[np.float64]) -> None:
    """Random walk and leaps of ln k, reflected at both ends of the grid (`elapsed` [s], `scratch` (2, CELLS))."""
    kept = math.exp(-_LEAP_RATE * elapsed)
    leaps = (1.0 - kept) * (1.0 - _FADING) / (1.0 + _FADING)
    aside = 0.5 * _DRIFT * _DRIFT * elapsed / (_WIDTH * _WIDTH)
    # A sum over exponentials to either side is two running sums, which the processor makes both at once; what is
    # reflected at the end of one begins the other.
    forward = backward = 0.0
    for i in range(CELLS):
        last = CELLS - 1 - i
        scratch[0, i] = _FADING * forward
        forward = belief[i] + scratch[0, i]
        backward = belief[last] + _FADING * backward
        scratch[1, last] = backward
    backward += _FADED[CELLS - 1] * forward
    for i in range(CELLS):
        before, after = belief[max(i - 1, 0)], belief[min(i + 1, CELLS - 1)]
        walked = (1.0 - 2.0 * aside) * belief[i] + aside * (before + after)
        reflected = _FADED[i] * backward + _FADED[CELLS - 1 - i] * forward
        scratch[0, i] = kept * walked + leaps * (scratch[0, i] + scratch[1, i] + reflected)
    for i in range(CELLS):
        belief[i] = scratch[0, i]


@kernel
def answer_rule(one: Any, rule: RuleConstants, limit: float) -> None:
    """What `StoppingSightDistance` and `FogLampRules` say to the belief (`limit` [m/s])."""
    is_known = one.fog_deviation <= rule.widest and one.time - one.evidence <= OLDEST
    front, rear = one.rule_lamps >= 1, one.rule_lamps >= 2
    if is_known:
        rear = one.quantile_75 < (60.0 if rear else 50.0)
        front = one.quantile_50 < (120.0 if front else 100.0)
    else:
        front = rear = False
    one.rule_lamps = 2 if rear else 1 if front else 0
    if is_known:
        visibility = one.quantile_25
        if rule.quantile != 0.25:
            visibility = one.quantile_5 if rule.quantile < 0.25 else one.quantile_50
            visibility = one.quantile_75 if rule.quantile > 0.5 else visibility
        distance = rule.sight_share * visibility
        safe = DECELERATION * (math.sqrt(REACTION_TIME**2 + 2.0 * distance / DECELERATION) - REACTION_TIME)
        step = 10.0 / 3.6
        target = math.inf if safe >= limit else max(2.0 * step, math.floor(safe / step + 1e-9) * step)
        if target <= one.rule_speed:
            one.rule_speed, one.raise_since = target, math.nan
        else:
            if math.isnan(one.raise_since):
                one.raise_since = one.time
            if one.time - one.raise_since >= rule.hold:
                one.rule_speed, one.raise_since = target, math.nan
    else:
        if rule.fallback < math.inf:
            one.rule_speed = rule.fallback
        one.raise_since = math.nan
