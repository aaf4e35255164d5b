"""Which vehicles follow one another, added to the state of the traffic."""

from dataclasses import replace

import numpy as np

from fogsim.traffic.sumo.link import Api
from fogsim.traffic.sumo_lanes.directions import LaneDirections
from fogsim.traffic.sumo_lanes.leaders import LaneSpots
from fogsim.values import TrafficState


class Courses:
    """Adds to a state what vehicles drive along where that is not their lane alone."""

    def __init__(self, api: Api, remote: bool = False) -> None:
        self._spots = LaneSpots(api, remote)
        self._directions = LaneDirections(api)
        self._two_way: dict[str, bool] = {}
        self._last: tuple[tuple[str, ...], tuple[str, ...]] = (), ()
        self._against: tuple[int, ...] = ()

    def add(self, state: TrafficState) -> TrafficState:
        """The state with `TrafficState.course` and `TrafficState.across`; as it is where all just keep to lanes."""
        if (state.ids, state.lane) != self._last:
            self._last = state.ids, state.lane
            self._against = self._find_against(state)
        if not self._against and not self._spots.is_divided:
            return state
        course, across = list(state.lane), state.across
        if self._spots.is_divided:
            course = [lane.rpartition("_")[0] for lane in course]
            spots = (
                self._spots.across(v, lane) if lane else 0.0 for v, lane in zip(state.ids, state.lane, strict=True)
            )
            across = np.fromiter(spots, np.float64, len(state.ids))
        for row in self._against:
            course[row] = f"-{course[row]}"
        return replace(state, course=tuple(course), across=across)

    def _find_against(self, state: TrafficState) -> tuple[int, ...]:
        """Rows of those who drive against their lane's direction."""
        known = self._two_way
        known.update((lane, self._directions.is_two_way(lane)) for lane in {*state.lane}.difference(known))
        rows = [row for row, lane in enumerate(state.lane) if known[lane]]
        return tuple(row for row in rows if self._directions.is_against(state.ids[row], state.lane[row]))
