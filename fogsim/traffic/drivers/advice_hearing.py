"""Which advice each driver has heard: by name, from the ego, in the car, or off a sign that was passed."""

import math
from collections.abc import Collection, Iterable, Mapping
from typing import Protocol

from fogsim.errors import InputError, suggest
from fogsim.values import Command, Display, Stretch

Heard = dict[Display, dict[str, float]]
"""The lowest speed that each driver has heard, by where; nothing by where no one has heard any [m/s]."""

_HARDEST_BRAKING = 9.0
"""No vehicle brakes harder than this for long [m/s²]."""


class _VehiclePlaces(Protocol):
    """Where the vehicles of a simulation are."""

    def on_stretch(self, stretch: Stretch, among: Collection[str] | None = None) -> Mapping[str, float]:
        """Vehicles on a stretch, and how far past its beginning their front bumpers are [m]."""

    def near_ego(self, distance: float, among: Collection[str] | None = None) -> Collection[str]:
        """Vehicles near the ego; no one while the ego is not on the road (`distance` [m])."""

    def speed(self, vehicle: str) -> float:
        """Speed of a vehicle [m/s]."""


class AdviceHearing:
    """Knows what the drivers of one run have heard.

    A message sign is read in passing, and what it said then is kept to the end of its stretch, whatever it says to
    those who come later. All other advice is heard as long as it is in force and the driver is where it is given.
    """

    def __init__(self, places: _VehiclePlaces) -> None:
        self._places = places
        self._readers: dict[Stretch, dict[str, float]] = {}
        self._last_on: dict[Stretch, Collection[str]] = {}

    def enter(self, command: Command, entering: Collection[str]) -> Heard:
        """Advice in force where vehicles enter the road [m/s]: they have passed the signs of their stretch upstream."""
        by_name = advised_by_name(command).get(Display.IN_CAR, {})
        heard: Heard = {Display.IN_CAR: {v: by_name[v] for v in entering if v in by_name}}
        if command.advice_reach > 0.0:
            near = self._places.near_ego(command.advice_reach, entering)
            _add_lower(heard, Display.IN_CAR, near, command.advice.speed)
        for advice in command.stretches:
            on = self._places.on_stretch(advice.stretch, entering)
            _add_lower(heard, advice.display, on, advice.speed)
            if on and advice.display == Display.MESSAGE_SIGN:
                self._readers.setdefault(advice.stretch, {}).update(dict.fromkeys(on, advice.speed))
        return _spoken(heard)

    def listen(self, command: Command, elapsed: float) -> Heard:
        """Advice that each driver now goes by, as far as there is any [m/s] (`elapsed` [s])."""
        heard = advised_by_name(command)
        if command.advice_reach > 0.0:
            near = self._places.near_ego(command.advice_reach)
            _add_lower(heard, Display.IN_CAR, near, command.advice.speed)
        shown: dict[Stretch, float] = {}
        for advice in command.stretches:
            if advice.display == Display.MESSAGE_SIGN:
                shown[advice.stretch] = advice.speed
            else:
                _add_lower(heard, advice.display, self._places.on_stretch(advice.stretch), advice.speed)
        for stretch in {**self._readers, **shown}:
            for vehicle, speed in self._read_sign(stretch, shown.get(stretch), elapsed).items():
                _add_lower(heard, Display.MESSAGE_SIGN, (vehicle,), speed)
        return _spoken(heard)

    def _read_sign(self, stretch: Stretch, shown: float | None, elapsed: float) -> dict[str, float]:
        """What those on the stretch of a sign have read there [m/s]."""
        on, last_on = self._places.on_stretch(stretch), self._last_on.get(stretch, ())
        readers = {v: speed for v, speed in self._readers.get(stretch, {}).items() if v in on}
        if shown is not None:
            for vehicle, past in on.items():
                if vehicle not in readers and vehicle not in last_on:
                    # Who has come onto the stretch farther on, from a ramp, has not passed the sign.
                    driven = self._places.speed(vehicle) * elapsed + 0.5 * _HARDEST_BRAKING * elapsed**2
                    readers.update({vehicle: shown} if past <= driven else {})
        self._readers[stretch], self._last_on[stretch] = readers, on
        if shown is None and not readers:
            del self._readers[stretch], self._last_on[stretch]
        return readers


def advised_by_name(command: Command) -> Heard:
    """Advice to single drivers by name, which is heard in the car."""
    return _spoken({Display.IN_CAR: {v: speed for v, speed in command.advised_speeds.items() if speed < math.inf}})


def heard_since(heard: Heard, before: Heard, time: float) -> Heard:
    """Instants since which drivers have heard any advice, by where [s] (`time` [s])."""
    return {
        display: {vehicle: before.get(display, {}).get(vehicle, time) for vehicle in speeds}
        for display, speeds in heard.items()
    }


def _spoken(heard: Heard) -> Heard:
    return {display: speeds for display, speeds in heard.items() if speeds}


def _add_lower(heard: Heard, display: Display, vehicles: Iterable[str], speed: float) -> None:
    """Let vehicles have heard a speed [m/s], where they have heard none there that is lower."""
    speeds = heard.setdefault(display, {})
    for vehicle in vehicles if speed < math.inf else ():
        speeds[vehicle] = min(speeds.get(vehicle, speed), speed)


def check_edges(stretch: Stretch, known: Collection[str]) -> None:
    """Check that a network has the edges of a stretch."""
    for edge in stretch.edges:
        if edge not in known:
            raise InputError(f"an advised stretch: the network has no edge {edge!r}; {suggest(edge, known)}")


def check_start(stretch: Stretch, length: float) -> None:
    """Check that a stretch begins on its road (`length` [m])."""
    if stretch.start >= length:
        road = f"edges, {', '.join(stretch.edges)}, are" if stretch.edges else "ego's route is"
        raise InputError(f"an advised stretch begins at {stretch.start:g} m, but the {road} {length:.0f} m long")
