"""The wish to overtake in a lane that looks free to the driver, where SUMO's model weighs an unseen vehicle there.

SUMO's drivers want to change to the left for speed once what they would gain there adds up; a slow vehicle in that lane
takes the gain away, seen or not. For drivers who do not see it the sum is kept here, by the same rule.

Source: Erdmann, J. (2015), SUMO's lane-changing model, in Modeling Mobility with Open Data; the rule for tactical
changes to the left, as in LC2013: each second adds (v_left − v) / max(v_left, 10 m/s), and the wish begins at 0.2 over
``lcSpeedGain``.
"""

import contextlib
import math
from collections.abc import Iterable

from fogsim.traffic.sumo.claims import SPEED_GAIN
from fogsim.traffic.sumo.link import Api
from fogsim.traffic.sumo_drivers.lane_change_switches import refusal_of
from fogsim.traffic.sumo_drivers.perception import REACH, Perception

THRESHOLD = 0.2
"""Sum of relative gains at which the wish begins, over the driver's eagerness [s]."""

LEAST_SPEED = 10.0
"""Gains are relative to the speed in the other lane, and at least to this [m/s]."""

FORGOTTEN = 0.8
"""Share of the sum that is left after a second without anything to gain [-]."""

SHORTEST_STAY = 20.0
"""The route must go on in the other lane for so long [s]."""

_SPEED_GAIN_BITS = 0x30


def safe_speed(gap: float, leader_speed: float, deceleration: float, headway: float) -> float:
    """Speed behind a leader from which one stops behind it if both brake equally hard [m/s].

    Source: Krauss, S. (1998), Microscopic modeling of traffic flow: investigation of collision free vehicle dynamics.

    Takes `gap` [m], `leader_speed` [m/s], `deceleration` [m/s²], `headway` [s].
    """
    delay = deceleration * headway
    return math.sqrt(delay**2 + leader_speed**2 + 2.0 * deceleration * max(gap, 0.0)) - delay


class OvertakingWishes:
    """Adds up what drivers gain in a lane to the left that looks free to them (`period` [s])."""

    def __init__(self, api: Api, leaders: Perception, period: float) -> None:
        self._vehicles = api.vehicle
        self._leader, self._speed = leaders.leader, leaders.speed
        self._refusal = refusal_of(api)
        self._period = period
        self._gains: dict[str, float] = {}

    def update(self, drivers: Iterable[str]) -> list[str]:
        """Those of some drivers who want to overtake; all others begin again."""
        before, self._gains = self._gains, {}
        for driver in drivers:
            gain = self._relative_gain(driver)
            if driver not in before:
                # There is nothing to add up before the first look; who has just entered knows of no neighbours yet.
                kept = 0.0
            elif gain > 0.0:
                kept = before[driver] + gain * self._period
            else:
                kept = before[driver] * FORGOTTEN**self._period
            self._gains[driver] = kept
        return [driver for driver, gain in self._gains.items() if self._is_wish(driver, gain)]

    def _relative_gain(self, driver: str) -> float:
        """What a free lane would gain over staying behind the leader [-]."""
        leader, gap = self._leader(driver, REACH) or ("", 0.0)
        if not leader:
            return 0.0
        get = self._vehicles
        free = float(get.getAllowedSpeed(driver))
        behind = safe_speed(gap, float(self._speed(leader)), float(get.getDecel(driver)), float(get.getTau(driver)))
        return (free - min(behind, free)) / max(free, LEAST_SPEED)

    def _is_wish(self, driver: str, gain: float) -> bool:
        """Whether a sum of gains is enough for the driver's own eagerness, mode and route."""
        get = self._vehicles
        eagerness = 0.0
        # A lane-change model without it (DK2008) has other rules.
        with contextlib.suppress(self._refusal):
            eagerness = SPEED_GAIN.read(get, driver)
        if gain * eagerness <= THRESHOLD or not get.getLaneChangeMode(driver) & _SPEED_GAIN_BITS:
            return False
        lanes, beside = get.getBestLanes(driver), int(get.getLaneIndex(driver)) + 1
        if beside >= len(lanes):
            return False
        _, length, _, offset, *_ = lanes[beside]
        return bool(offset == 0 and length > SHORTEST_STAY * float(self._speed(driver)))
