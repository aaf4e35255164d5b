"""How fast drivers drive in fog by themselves, and how they follow advice.

Field and simulator studies agree that drivers slow down in fog, but not enough to stop within what they see, and not at
all above some 200 m of visibility (Hogema & van der Horst 1994; Kang, Ni & Andersen 2008); and that advice alone moves
few: on a fog-warned motorway drivers advised 30 mph drove 61 mph.
"""

import math
import zlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fogsim.kinematics import DECELERATION, REACTION_TIME, safe_speed
from fogsim.registry import Registry

UNAFFECTED_ABOVE = 200.0
"""Visibility above which drivers do not slow down [m]."""

CHOICE_PERIOD = 1.0
"""Time between two choices of speed [s]."""

Choice = Callable[[float], float]
"""From visibility [m] to the speed that a driver will not exceed [m/s]; ``inf`` if fog does not matter."""


def unaffected(visibility: float) -> float:  # noqa: ARG001 - every choice is asked with the visibility
    """Drive as in clear air, whatever the fog: the worst case.

    Parameters
    ----------
    visibility : float
        Meteorological visibility [m].
    """
    return math.inf


def within_sight(visibility: float) -> float:
    """Drive so that one can stop within the visibility: the careful case.

    Parameters
    ----------
    visibility : float
        Meteorological visibility [m].
    """
    return safe_speed(visibility, REACTION_TIME, DECELERATION)


def too_fast(visibility: float) -> float:
    """Slow down below 200 m, but to 1.4 times what would be safe (between the 1.3 and 1.5 that studies suggest).

    Parameters
    ----------
    visibility : float
        Meteorological visibility [m].
    """
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
class DriverTraits:
    """What sets one driver apart.

    Attributes
    ----------
    speed_factor : float
        Factor on the speed that the setup's choice gives [-].
    follows_advice : bool
        Whether advice reaches and moves them.
    """

    speed_factor: float
    follows_advice: bool


def driver_traits(setup: DriverSetup, vehicle: str, seed: int) -> DriverTraits:
    """Traits of the driver of a vehicle; they depend on nothing but the seed and the vehicle's id.

    Parameters
    ----------
    setup : DriverSetup
        What drivers are like.
    vehicle : str
        Its id.
    seed : int
        Seed of the run, not negative.
    """
    rng = np.random.default_rng([seed, zlib.crc32(vehicle.encode())])
    return DriverTraits(
        speed_factor=math.exp(setup.spread * rng.standard_normal()),
        follows_advice=bool(rng.random() < setup.compliance.reached_share)
        and bool(rng.random() < setup.compliance.rate),
    )


def desired_speed(
    setup: DriverSetup,
    driver: DriverTraits,
    own: float,
    visibility: float,
    advised: float = math.inf,
    advised_for: float = 0.0,
) -> float:
    """Speed that a driver wants to drive [m/s], never more than the own one.

    Parameters
    ----------
    setup : DriverSetup
        What drivers are like.
    driver : DriverTraits
        What this one is like.
    own : float
        Speed that they would drive in clear air without advice [m/s].
    visibility : float
        Meteorological visibility where they are [m]; ``inf`` in clear air.
    advised : float
        Advised speed [m/s]; ``inf`` for none.
    advised_for : float
        Time since there is advice for them [s].
    """
    chosen = min(driver.speed_factor * SPEED_CHOICES[setup.speed_choice](visibility), own)
    heard = driver.follows_advice and advised_for >= setup.compliance.delay
    return complied_speed(chosen, advised, setup.compliance.strength) if heard and math.isfinite(advised) else chosen
