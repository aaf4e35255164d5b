"""What the ego's light sensor measures, and what its lamps do by night: for itself and to others."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere import optical_depth
from fogsim.lighting.own_sight import own_sight_distance
from fogsim.scenario import Scenario
from fogsim.traffic.drivers.eye_heights import EYE_HEIGHTS
from fogsim.traffic.drivers.lamp_intensity import beam_intensity, head_lamps_that_burn, intensity_toward
from fogsim.traffic.sumo_drivers.oncoming_glare import LAMP_HEIGHT, MIRROR_ANGLE, MIRROR_SHARE
from fogsim.units import DAY_ILLUMINANCE, visibility_from_extinction
from fogsim.values import FogField, Lamp, LampEffects, LightMeasurement, TrafficState
from fogsim.values.eye import disability_glare
from fogsim.values.light import ALL_LAMPS

FARTHEST_DAZZLED = 250.0
"""Drivers farther away than this are not dazzled [m]."""

HEAD_LAMPS, TAIL_LAMPS = 1200.0, 16.0
"""What a pair of low beams, and of tail lamps, shines straight ahead and back, by which reaches are told [cd]."""


class Others(NamedTuple):
    """Other vehicles, as the ego has them.

    Attributes
    ----------
    row : (n,) int64
        Their rows in the traffic.
    ahead, aside : (n,) float64
        Where their front bumpers are, ahead of the ego's and to its left [m].
    distance : (n,) float64
        [m]
    comes : (n,) bool
        Whether they drive against the ego.
    angle : (n,) float64
        Angle between their headings and the way to the ego [rad].
    """

    row: NDArray[np.int64]
    ahead: NDArray[np.float64]
    aside: NDArray[np.float64]
    distance: NDArray[np.float64]
    comes: NDArray[np.bool_]
    angle: NDArray[np.float64]


class LightSensing:
    """The light sensor behind the ego's windscreen, and what its lamps do.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    """

    def __init__(self, scenario: Scenario) -> None:
        section = scenario.sensors.light
        self._reach, self._tail_reach = section.reach_m, section.tail_reach_m
        self._half_view = math.radians(0.5 * section.field_of_view_deg)

    def measure(self, state: TrafficState, ego: int, fog: FogField, illuminance: float) -> LightMeasurement:
        """Tell how bright it is, and by night whether others' lamps are ahead; no vehicle hides another.

        Parameters
        ----------
        state : TrafficState
            Every vehicle.
        ego : int
            Row of the ego.
        fog : FogField
            The fog now.
        illuminance : float
            Horizontal illuminance of the sky [lx].
        """
        if illuminance >= DAY_ILLUMINANCE:
            return LightMeasurement(illuminance)
        others = _others(state, ego, max(self._reach, self._tail_reach))
        if not len(others.row):
            return LightMeasurement(illuminance)
        bearing = np.abs(np.arctan2(others.aside, others.ahead))
        light = np.array([_pair_intensity(state, ego, int(row)) for row in others.row])
        light *= np.exp(-_depths(state, ego, others, fog)) / others.distance**2
        seen = (bearing <= self._half_view) & (others.ahead > 0.0)
        found = light >= np.where(others.comes, HEAD_LAMPS / self._reach**2, TAIL_LAMPS / self._tail_reach**2)
        seen &= found
        return LightMeasurement(illuminance, bool(np.any(seen & others.comes)), bool(np.any(seen & ~others.comes)))


def lamp_effects(state: TrafficState, ego: int, fog: FogField, extinction_ahead: float) -> LampEffects:
    """What the ego's lamps do by night.

    Parameters
    ----------
    state : TrafficState
        Every vehicle.
    ego : int
        Row of the ego.
    fog : FogField
        The fog now.
    extinction_ahead : float
        Mean extinction coefficient ahead of the ego [1/m].
    """
    lamps = int(state.lamps[ego])
    others = _others(state, ego, FARTHEST_DAZZLED)
    veils = _veils(state, ego, others, fog) if len(others.row) and head_lamps_that_burn(lamps) else np.zeros(0)
    sight = own_sight_distance(Lamp(lamps & int(ALL_LAMPS)), visibility_from_extinction(extinction_ahead))
    return LampEffects(sight, tuple(veils.tolist()))


def _others(state: TrafficState, ego: int, reach: float) -> Others:
    apart = state.position[:, :2] - state.position[ego, :2]
    distance = np.hypot(apart[:, 0], apart[:, 1])
    row = np.flatnonzero((distance > 0.0) & (distance <= reach))
    heading = float(state.heading[ego])
    forward, left = (math.cos(heading), math.sin(heading)), (-math.sin(heading), math.cos(heading))
    near = apart[row]
    ahead, aside = near[:, 0] * forward[0] + near[:, 1] * forward[1], near[:, 0] * left[0] + near[:, 1] * left[1]
    comes = np.cos(state.heading[row] - heading) < 0.0
    back = np.arctan2(-near[:, 1], -near[:, 0]) - state.heading[row]
    return Others(row, ahead, aside, distance[row], comes, np.arccos(np.clip(np.cos(back), -1.0, 1.0)))


def _pair_intensity(state: TrafficState, ego: int, row: int) -> float:
    """Luminous intensity of a pair of a vehicle's brightest lamps toward the ego [cd]."""
    heading = float(state.heading[row])
    x, y = (state.position[ego] - state.position[row])[:2].tolist()
    ahead, aside = x * math.cos(heading) + y * math.sin(heading), y * math.cos(heading) - x * math.sin(heading)
    return 2.0 * intensity_toward(int(state.lamps[row]), float(state.length[row]), ahead, aside)


def _depths(state: TrafficState, ego: int, others: Others, fog: FogField) -> NDArray[np.float64]:
    lift = (0.0, 0.0, LAMP_HEIGHT)
    eyes = state.position[others.row] + lift
    return np.asarray(optical_depth(fog, np.broadcast_to(state.position[ego] + lift, eyes.shape), eyes))


def _veils(state: TrafficState, ego: int, others: Others, fog: FogField) -> NDArray[np.float64]:
    """Veil of the ego's head lamps over the eyes of each of the others who is lit by them [cd/m²]."""
    lamps = head_lamps_that_burn(int(state.lamps[ego]))
    off_axis = np.degrees(np.abs(np.arctan2(others.aside, others.ahead)))
    squared = others.distance**2 + (EYE_HEIGHTS["car"] - LAMP_HEIGHT) ** 2
    light = np.array([sum(beam_intensity(lit, float(angle)) for lit in lamps) for angle in off_axis])
    light *= np.exp(-_depths(state, ego, others, fog)) / squared
    # Who comes looks along its own heading; who is ahead has the lamps in its mirrors.
    light *= np.where(others.comes, 1.0, MIRROR_SHARE)
    angle = np.where(others.comes, others.angle, MIRROR_ANGLE)
    return np.asarray(disability_glare(light, angle))[(others.ahead > 0.0) & (angle < 0.5 * math.pi)]
