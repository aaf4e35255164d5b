"""What the ego's light sensor measures, and what its lamps do by night: for itself and to others."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fogsim.atmosphere import optical_depth
from fogsim.lighting.own_sight import headlamp_sight_distance
from fogsim.simulation.run_config import LightSensor
from fogsim.traffic.appearance import EYE_HEIGHTS
from fogsim.traffic.drivers.lamp_intensity import beam_intensity, head_lamps_that_burn, intensity_toward
from fogsim.traffic.sumo_drivers.oncoming_glare import LAMP_HEIGHT, MIRROR_ANGLE, MIRROR_SHARE
from fogsim.units import DAY_ILLUMINANCE, visibility_from_extinction
from fogsim.values import FogField, Lamp, LampEffects, LightMeasurement, TrafficState
from fogsim.values.eye import disability_glare
from fogsim.values.light import ALL_LAMPS

_FARTHEST_DAZZLED = 250.0
"""Drivers farther away than this are not dazzled [m]."""

_STEPS_PER_E_FOLD = 200.0

_HEAD_LAMPS, _TAIL_LAMPS = 1200.0, 16.0
"""Intensity straight ahead of a pair of low beams, and straight back of tail lamps; gives their reach [cd]."""


class Other(NamedTuple):
    """Another vehicle ahead, as the ego has it."""

    row: int  # Its row in the traffic
    # ahead, aside: where its front bumper is, ahead of the ego's and to its left [m]
    ahead: float
    aside: float
    distance: float  # [m]
    comes: bool  # Whether it drives against the ego
    angle: float  # Angle between its heading and the way to the ego [rad]


class LightSensing:
    """The light sensor behind the ego's windscreen, and what its lamps do."""

    def __init__(self, sensor: LightSensor) -> None:
        self._reach, self._tail_reach = sensor.reach, sensor.tail_reach
        self._half_view = 0.5 * sensor.field_of_view

    def measure(self, state: TrafficState, ego: int, fog: FogField, illuminance: float) -> LightMeasurement:
        """Measure how bright it is, and by night whether others' lamps are ahead; vehicles do not hide one another.

        Takes `illuminance` [lx].
        """
        if illuminance >= DAY_ILLUMINANCE:
            return LightMeasurement(illuminance)
        near = _others_ahead(state, ego, max(self._reach, self._tail_reach))
        bright: list[tuple[Other, float]] = []
        for other in near:
            light = _pair_intensity(state, ego, other.row) / other.distance**2
            # What is too dim in clear air is so in fog.
            if abs(math.atan2(other.aside, other.ahead)) <= self._half_view and light >= self._least(other):
                bright.append((other, light))
        if not bright:
            return LightMeasurement(illuminance)
        depths = _depths(state, ego, [other for other, _ in bright], fog)
        seen = [
            other
            for (other, light), depth in zip(bright, depths, strict=True)
            if light * math.exp(-depth) >= self._least(other)
        ]
        return LightMeasurement(illuminance, any(one.comes for one in seen), any(not one.comes for one in seen))

    def _least(self, other: Other) -> float:
        """Illuminance by which a vehicle's lamps are noticed [lx]."""
        return _HEAD_LAMPS / self._reach**2 if other.comes else _TAIL_LAMPS / self._tail_reach**2


def lamp_effects(state: TrafficState, ego: int, fog: FogField, extinction_ahead: float) -> LampEffects:
    """What the ego's lamps do by night (`extinction_ahead` [1/m])."""
    lamps = int(state.lamps[ego])
    others = _others_ahead(state, ego, _FARTHEST_DAZZLED) if head_lamps_that_burn(lamps) else []
    dazzled = [other for other in others if not other.comes or other.angle < 0.5 * math.pi]
    visibility = _stepped(visibility_from_extinction(extinction_ahead))
    sight = headlamp_sight_distance(Lamp(lamps & int(ALL_LAMPS)), visibility)
    return LampEffects(sight, _veils(state, ego, dazzled, fog) if dazzled else ())


def _stepped(visibility: float) -> float:
    """Visibility to a quarter of a percent [m]: what is seen in it takes a millisecond to find, and is remembered."""
    if not math.isfinite(visibility):
        return visibility
    return math.exp(round(_STEPS_PER_E_FOLD * math.log(visibility)) / _STEPS_PER_E_FOLD)


def _others_ahead(state: TrafficState, ego: int, reach: float) -> list[Other]:
    """Other vehicles ahead within reach [m]: plain numbers, for there are few."""
    (x, y, _), heading = state.position[ego].tolist(), float(state.heading[ego])
    east, north = math.cos(heading), math.sin(heading)
    found: list[Other] = []
    for row, ((to_x, to_y, _), turned) in enumerate(zip(state.position.tolist(), state.heading.tolist(), strict=True)):
        across, up = to_x - x, to_y - y
        ahead, distance = across * east + up * north, math.hypot(across, up)
        if ahead > 0.0 and distance <= reach:
            angle = abs(math.remainder(math.atan2(-up, -across) - turned, math.tau))
            comes = math.cos(turned - heading) < 0.0
            found.append(Other(row, ahead, up * east - across * north, distance, comes, angle))
    return found


def _pair_intensity(state: TrafficState, ego: int, row: int) -> float:
    """Luminous intensity of a pair of a vehicle's brightest lamps toward the ego [cd]."""
    heading = float(state.heading[row])
    x, y = (state.position[ego] - state.position[row])[:2].tolist()
    ahead, aside = x * math.cos(heading) + y * math.sin(heading), y * math.cos(heading) - x * math.sin(heading)
    return 2.0 * intensity_toward(int(state.lamps[row]), float(state.length[row]), ahead, aside)


def _depths(state: TrafficState, ego: int, others: Sequence[Other], fog: FogField) -> list[float]:
    lift = np.array((0.0, 0.0, LAMP_HEIGHT))
    eyes = state.position[[other.row for other in others]] + lift
    depths: list[float] = optical_depth(fog, state.position[ego] + lift, eyes).tolist()
    return depths


def _veils(state: TrafficState, ego: int, others: Sequence[Other], fog: FogField) -> tuple[float, ...]:
    """Veil of the ego's head lamps over the eyes of each of some others [cd/m²]."""
    lamps = head_lamps_that_burn(int(state.lamps[ego]))
    light: list[float] = []
    for other, depth in zip(others, _depths(state, ego, others, fog), strict=True):
        off_axis = math.degrees(abs(math.atan2(other.aside, other.ahead)))
        squared = other.distance**2 + (EYE_HEIGHTS["car"] - LAMP_HEIGHT) ** 2
        # Who comes looks along its own heading; who is ahead has the lamps in its mirrors.
        share = 1.0 if other.comes else MIRROR_SHARE
        light.append(share * sum(beam_intensity(lit, off_axis) for lit in lamps) * math.exp(-depth) / squared)
    angles = [other.angle if other.comes else MIRROR_ANGLE for other in others]
    return tuple(disability_glare(light, angles).tolist())
