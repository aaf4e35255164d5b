"""What a traffic simulation needs to know before it starts."""

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from fogsim.traffic.drivers.events import Event
from fogsim.traffic.drivers.sight import DriverSight
from fogsim.traffic.drivers.speed_choice import DriverSetup

UNTOUCHED = DriverSetup(speed_choice="unaffected", spread=0.0)
"""Drivers as the user's own simulation has them."""


ANY_EGO = "any"
"""In place of an ego's id: the first vehicle that suits."""


class AfterCollision(StrEnum):
    """What becomes of vehicles that have collided: they stand and block the lane, or they vanish."""

    STOP = "stop"
    REMOVE = "remove"


@dataclass(frozen=True, slots=True)
class TrafficSetup:
    """A SUMO simulation, and who the ego is if there is one.

    Parameters
    ----------
    net : Path or None
        SUMO network; None for the one that the simulation has loaded.
    routes, additional : tuple of Path
        SUMO route and additional files.
    ego : str or None
        Id of the ego vehicle, or `ANY_EGO`; None for traffic alone.
    step_length : float
        SUMO's step [s].
    keep_lane : tuple of str
        Vehicles that never change lane.
    warm_up_limit : float
        Simulated time within which the ego must appear [s].
    advice_deceleration : float
        Deceleration with which an advised vehicle slows down to the advice [m/s²].
    reading_radius : float
        Vehicles farther from the ego than this are not read [m].
    events : tuple of Event
        What is scripted.
    sight : DriverSight or None
        Eyes of the drivers; None lets them see through the fog, as SUMO's do by themselves.
    drivers : DriverSetup
        How drivers choose their speed in fog and follow advice.
    after_collision : AfterCollision
        What becomes of vehicles that have collided.
    config : Path or None
        SUMO configuration, in place of net, routes and additional files.
    sumo_options : tuple of (str, str)
        Further options of SUMO, named without dashes, and their values as on its command line.
    warm_up : float
        Without an ego, simulated time before the run begins [s].
    """

    net: Path | None
    routes: tuple[Path, ...] = ()
    additional: tuple[Path, ...] = ()
    ego: str | None = "ego"
    step_length: float = 0.1
    keep_lane: tuple[str, ...] = ()
    warm_up_limit: float = 600.0
    advice_deceleration: float = 2.0
    reading_radius: float = 1000.0
    events: tuple[Event, ...] = ()
    sight: DriverSight | None = None
    drivers: DriverSetup = UNTOUCHED
    after_collision: AfterCollision = AfterCollision.STOP
    config: Path | None = None
    sumo_options: tuple[tuple[str, str], ...] = ()
    warm_up: float = 0.0
