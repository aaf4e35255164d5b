"""What one driver is like and how fast they want to drive, in plain values: the same whatever simulates the traffic."""

import math
import zlib
from dataclasses import dataclass

import numpy as np

from fogsim.traffic.drivers.speed_choice import SPEED_CHOICES, DriverSetup, complied_speed


@dataclass(frozen=True, slots=True)
class Nature:
    """What sets one driver apart.

    Attributes
    ----------
    factor : float
        Factor on the speed that the setup's choice gives [-].
    follows : bool
        Whether advice reaches and moves them.
    """

    factor: float
    follows: bool


def nature(setup: DriverSetup, vehicle: str, seed: int) -> Nature:
    """Nature of the driver of a vehicle; it depends on nothing but the seed and the vehicle's id.

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
    return Nature(
        factor=math.exp(setup.spread * rng.standard_normal()),
        follows=bool(rng.random() < setup.compliance.reached_share) and bool(rng.random() < setup.compliance.rate),
    )


def wanted_speed(
    setup: DriverSetup,
    driver: Nature,
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
    driver : Nature
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
    chosen = min(driver.factor * SPEED_CHOICES[setup.speed_choice](visibility), own)
    heard = driver.follows and advised_for >= setup.compliance.delay
    return complied_speed(chosen, advised, setup.compliance.strength) if heard and math.isfinite(advised) else chosen
