"""How fast drivers drive in fog by themselves, and how they follow advice.

Field and simulator studies agree that drivers slow down in fog, but not enough to stop within what they see, and not at
all above some 200 m of visibility (Hogema & van der Horst 1994; Kang, Ni & Andersen 2008); and that advice alone moves
few: on a fog-warned motorway drivers advised 30 mph drove 61 mph.
"""

import math
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.kinematics import safe_speed
from fogsim.registry import Registry
from fogsim.traffic.link import Api
from fogsim.traffic.sight import FogAccess
from fogsim.units import visibility_from_extinction

REACTION_TIME, DECELERATION = 2.5, 3.4
"""Of the speed from which one can stop within what is visible (AASHTO) [s], [m/s²]."""

UNAFFECTED_ABOVE = 200.0
"""Visibility above which drivers do not slow down [m]."""

CHOICE_PERIOD = 1.0
"""Time between two choices of speed [s]."""

Choice = Callable[[float], float]
"""From visibility [m] to the speed that a driver will not exceed [m/s]; ``inf`` if fog does not matter."""


def unaffected(visibility: float) -> float:  # noqa: ARG001 - every choice is asked with the visibility
    """Drive as in clear air, whatever the fog: the worst case."""
    return math.inf


def within_sight(visibility: float) -> float:
    """Drive so that one can stop within the visibility: the careful case."""
    return safe_speed(visibility, REACTION_TIME, DECELERATION)


def too_fast(visibility: float) -> float:
    """Slow down below 200 m, but to 1.4 times what would be safe (between the 1.3 and 1.5 that studies suggest)."""
    return math.inf if visibility >= UNAFFECTED_ABOVE else 1.4 * within_sight(visibility)


def complied_speed(own: float, advised: float, strength: float) -> float:
    """Speed of a driver who goes some way from the own speed down to an advised one [m/s].

    Parameters
    ----------
    own, advised : float
        Speeds [m/s].
    strength : float
        How far, 0 (not at all) … 1 (all the way).
    """
    return own + strength * min(0.0, advised - own)


FULLY_MISJUDGED, RIGHTLY_JUDGED = 30.0, 150.0
"""Visibilities up to which distances are misjudged in full, and from which not at all [m]."""


def perceived_distance_factor(visibility: float, misjudgement: float) -> float:
    """Perceived over true distance in fog [-] (Cavallo, Colomb & Doré 2001; linear in between).

    Parameters
    ----------
    visibility : float
        Meteorological visibility [m].
    misjudgement : float
        Overestimate in the densest fog [-].
    """
    share = (RIGHTLY_JUDGED - visibility) / (RIGHTLY_JUDGED - FULLY_MISJUDGED)
    return 1.0 + misjudgement * min(max(share, 0.0), 1.0)


SPEED_CHOICES: Registry[Choice] = Registry(
    "speed choice", {"unaffected": unaffected, "too_fast": too_fast, "within_sight": within_sight}
)


@dataclass(frozen=True, slots=True)
class Compliance:
    """Who follows an advised speed, and how far.

    Attributes
    ----------
    reached_share : float
        Share of drivers whom the advice reaches (a sign that they pass, a device on board), 0 … 1.
    rate : float
        Share of those who follow it, 0 … 1.
    strength : float
        How far they go from their own speed towards the advised one, 0 … 1.
    delay : float
        Time before they do [s].
    """

    reached_share: float = 1.0
    rate: float = 1.0
    strength: float = 1.0
    delay: float = 2.0


@dataclass(frozen=True, slots=True)
class DriverSetup:
    """What drivers are like.

    Attributes
    ----------
    speed_choice : str
        Name in `SPEED_CHOICES`.
    spread : float
        Standard deviation of the logarithm of a driver's own factor on the chosen speed [-].
    compliance : Compliance
        How they follow advice.
    misjudgement : float
        By which share they take distances for longer than they are in dense fog [-], and so follow closer: 0.3 … 0.6 at
        night (Cavallo, Colomb & Doré 2001); in full up to 30 m of visibility, not at all from 150 m.
    """

    speed_choice: str = "too_fast"
    spread: float = 0.1
    compliance: Compliance = Compliance()
    misjudgement: float = 0.0


@dataclass(frozen=True, slots=True)
class _Driver:
    """One driver: factor on the chosen speed, whether advice moves them, top speed [m/s], wanted time headway [s]."""

    factor: float
    follows: bool
    top_speed: float
    headway: float


class Drivers:
    """Sets the top speed of every vehicle but the ego by what its driver chooses and is told.

    Parameters
    ----------
    api : Api
        The simulation.
    setup : DriverSetup
        What they are like.
    fog : FogAccess
        The fog.
    ego : str
        The ego, which others govern.
    seed : int
        With a vehicle's id it gives its driver's nature, so that it depends on nothing else.
    """

    def __init__(self, api: Api, setup: DriverSetup, fog: FogAccess, ego: str, seed: int) -> None:
        self._api = api
        self._setup = setup
        self._choice = SPEED_CHOICES[setup.speed_choice]
        self._fog = fog
        self._ego = ego
        self._seed = seed
        self._known: dict[str, _Driver] = {}
        self._advised_since: dict[str, float] = {}
        self._set: dict[str, float] = {}
        self._misjudging: dict[str, float] = {}
        self._next = 0.0

    def update(self, advised: Mapping[str, float]) -> None:
        """Let every driver choose a speed, if it is time to think again.

        Parameters
        ----------
        advised : mapping from vehicle id to float
            Advised speeds [m/s].
        """
        time = self._api.simulation.getTime()
        if time < self._next:
            return
        self._next = time + CHOICE_PERIOD
        vehicles = self._api.vehicle
        ids = [v for v in vehicles.getIDList() if v != self._ego]
        if not ids:
            return
        extinction = self._fog.extinction(np.array([vehicles.getPosition3D(v) for v in ids]))
        visibilities = self._visibilities(extinction)
        if self._setup.misjudgement > 0:
            self._follow_closer(ids, visibilities)
        self._advised_since = {v: self._advised_since.get(v, time) for v in advised}
        for vehicle, visibility in zip(ids, visibilities, strict=True):
            driver = self._driver(vehicle)
            target = min(driver.factor * self._choice(visibility), driver.top_speed)
            if vehicle in advised and driver.follows:
                target = self._advised(vehicle, target, advised[vehicle], time)
            # Setting it costs a call: a change that nobody would notice is left out.
            if abs(target - self._set.get(vehicle, driver.top_speed)) > 0.3:
                vehicles.setMaxSpeed(vehicle, target)
                self._set[vehicle] = target

    def _visibilities(self, extinction: NDArray[np.float64]) -> list[float]:
        """Visibility at each vehicle [m]; where the fog is one and the same, that is looked up once."""
        if extinction.min() == extinction.max():
            return [visibility_from_extinction(float(extinction[0]))] * len(extinction)
        return [visibility_from_extinction(float(k)) for k in extinction]

    def _follow_closer(self, ids: list[str], visibilities: list[float]) -> None:
        """Who takes a gap for longer than it is keeps a shorter one: the wanted time headway shrinks by that factor."""
        for vehicle, visibility in zip(ids, visibilities, strict=True):
            factor = perceived_distance_factor(visibility, self._setup.misjudgement)
            if abs(factor - self._misjudging.get(vehicle, 1.0)) > 0.02:
                self._api.vehicle.setTau(vehicle, self._driver(vehicle).headway / factor)
                self._misjudging[vehicle] = factor

    def _advised(self, vehicle: str, own: float, advised: float, time: float) -> float:
        """Top speed [m/s] of a driver who follows advice, once the delay is over."""
        if time - self._advised_since[vehicle] < self._setup.compliance.delay:
            return own
        own = min(own, float(self._api.vehicle.getAllowedSpeed(vehicle)))
        return complied_speed(own, advised, self._setup.compliance.strength)

    def _driver(self, vehicle: str) -> _Driver:
        known = self._known.get(vehicle)
        if known is None:
            rng = np.random.default_rng([self._seed, zlib.crc32(vehicle.encode())])
            compliance = self._setup.compliance
            known = self._known[vehicle] = _Driver(
                factor=float(np.exp(self._setup.spread * rng.standard_normal())),
                follows=bool(rng.random() < compliance.reached_share) and bool(rng.random() < compliance.rate),
                top_speed=float(self._api.vehicle.getMaxSpeed(vehicle)),
                headway=float(self._api.vehicle.getTau(vehicle)),
            )
        return known
