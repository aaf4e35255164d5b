"""Reading what the traffic lights near the ego show."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.appearance import SIGNAL_COLOURS
from fogsim.traffic.sumo.link import Api, getter
from fogsim.values import SignalHead, SignalState
from fogsim.values.traffic import NO_SIGNALS

REACH = 500.0
"""Traffic lights farther from the ego than this are left out [m]."""

_MOVED = 25.0  # which heads are near is asked again when the ego has moved so far [m]

_FIRST = "GgyYursoO"
"""Of the letters of a lane's links, the head shows that which stands first here: what lets most of them go."""


class SignalReader:
    """Reads the heads near a place."""

    def __init__(self, api: Api, heads: Sequence[SignalHead]) -> None:
        self._letters = getter(api, "trafficlight", "getRedYellowGreenState")
        known = set(api.trafficlight.getIDList()) if heads else set()
        self._heads = [head for head in heads if head.signal_id in known]
        self._places = np.array([head.position for head in self._heads]).reshape(-1, 3)
        self._asked = np.full(2, np.inf)
        self._near: list[SignalHead] = []
        self._last = NO_SIGNALS

    def state(self, here: NDArray[np.float64]) -> SignalState:
        """Heads nearer than `REACH` to a place, and what they show (`here` (3,) [m])."""
        if not self._heads:
            return self._last
        if not np.hypot(*(here[:2] - self._asked)) < _MOVED:
            self._find_near(here[:2])
        shown = {signal: self._letters(signal) for signal in dict.fromkeys(self._last.ids)}
        colours = tuple(SIGNAL_COLOURS[_letter(shown[head.signal_id], head.links)] for head in self._near)
        if colours != self._last.colour:
            self._last = replace(self._last, colour=colours)
        return self._last

    def _find_near(self, here: NDArray[np.float64]) -> None:
        self._asked = here.copy()
        off = self._places[:, :2] - here
        near = np.flatnonzero(np.hypot(off[:, 0], off[:, 1]) < REACH + _MOVED).tolist()
        self._near = heads = [self._heads[row] for row in near]
        self._last = SignalState(
            ids=tuple(head.signal_id for head in heads),
            lane=tuple(head.lane_id for head in heads),
            position=self._places[near],
            heading=np.array([head.heading for head in heads]),
            diameter=np.array([head.diameter for head in heads]),
            on_foot=np.array([head.on_foot for head in heads] if any(head.on_foot for head in heads) else [], np.bool_),
        )


def _letter(state: str, links: Sequence[int]) -> str:
    """What a head shows of the state of its traffic light; dark where that has no such links."""
    shown = {state[link] for link in links if link < len(state)}
    return next((letter for letter in _FIRST if letter in shown), "O")
