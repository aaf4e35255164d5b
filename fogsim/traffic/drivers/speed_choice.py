"""How fast drivers drive in fog by themselves, and what sets one apart from another.

Sources (we have seen only abstracts and summaries): White & Jeffery 1980 (TRL LR958) and TRL SR281 on the M4;
Hogema & van der Horst 1994 (TNO-TM C-6, C-7) and 1997 (A16); McCann & Fontaine 2016 (VTRC 17-R4) and Gonzales &
Fontaine 2018 (VTRC 19-R6) on I-77; Pretto, Bresciani, Rainer & Bülthoff 2012 (eLife 1:e00031); the SHRP2 naturalistic
study (Transportation Research Record 2018, doi 10.1177/0361198118774748).
"""

import math
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, NamedTuple, Protocol

import numpy as np

from fogsim.core.kinematics import DECELERATION, REACTION_TIME, safe_speed
from fogsim.core.parameters import Range, checked_parameters
from fogsim.core.registry import Registry
from fogsim.errors import InputError, shown
from fogsim.traffic.drivers.following import FOLLOWING_MODELS, OBSERVED_MIXTURE
from fogsim.values import Display
from fogsim.values.result_checks import checked_share, checked_speed

_Share = Annotated[float, Range(0.0, 1.0)]


@checked_parameters
@dataclass(frozen=True, slots=True)
class Compliance:
    """Who follows an advised speed, and how far."""

    # Share of drivers whom the advice reaches (a sign that they pass, a device on board), 0 … 1
    reached_share: _Share = 1.0
    rate: _Share = 1.0  # Share of those who follow it, 0 … 1
    strength: _Share = 1.0  # How far they go from their own speed down to the advised one, 0 … 1
    delay: Annotated[float, Range(0.0, math.inf, "s")] = 2.0  # Time before they do [s]
    # How far those who by themselves drive slower in fog go up to the advised speed, for they take it to be safe, 0 …
    # 1; never beyond what they drive in clear air
    trust: _Share = 0.0
    foreseen: _Share = 1.0  # Share of `strength` and `trust` that is left where they see no fog yet, 0 … 1


_FULL = Compliance()
"""Everyone is reached and goes all the way down, and no one up: the best case."""

_SPEED_LIMIT_SIGN = Compliance(strength=0.6, trust=1.0)
"""Signs with a speed limit for the visibility, above every lane, which drivers know and trust.

A16 (Hogema & van der Horst 1997): 80 km/h for 70 to 140 m, 60 km/h below; mean speeds 8 to 10 km/h lower than without
signs, and below 35 m 60 km/h in place of 29: drivers took the sign's speed for safe. On I-77 limits for the visibility
made 2 to 5 mph (Gonzales & Fontaine 2018); in Finland 80 for 100 km/h on slippery roads 3.4 km/h (Rämä 1999).
"""

_ADVISORY_SIGN = Compliance(rate=0.1, strength=0.35)
"""Signs next to the road that advise a speed.

Caltrans' CAWS near Stockton (MacCarley, Ackles & Watts 2006): mean speeds fell by 1.1 mph over all fogs, and were
61 mph where 30 mph were advised in dense fog: 0.035 of the way. In Saudi Arabia an advised speed made 6.5 km/h; the
word "fog" without a speed 1.8 mph on the M25 (Cooper & Sawyer 1993).
"""

_IN_CAR = Compliance(strength=0.55)
"""Advice on a display in the car.

Guan et al. 2022, in a simulator (table 3): 92.2 km/h in place of 107.2 on the way into the fog and 64.8 in place of
70.4 in dense fog, lower than with a sign next to. The advised speeds are not in what we have seen: 0.55 supposes
60 km/h.
"""

_VEHICLE_TO_VEHICLE = Compliance(reached_share=0.3, strength=0.55)
"""Advice from vehicle to vehicle, displayed in the car: as `_IN_CAR`, to those who are equipped; FogSim's own share."""

COMPLIANCES: Registry[Compliance] = Registry(
    "compliance",
    {
        "full": _FULL,
        "speed_limit_sign": _SPEED_LIMIT_SIGN,
        "advisory_sign": _ADVISORY_SIGN,
        "in_car": _IN_CAR,
        "vehicle_to_vehicle": _VEHICLE_TO_VEHICLE,
    },
)


def complied_speed(own: float, advised: float, strength: float, trust: float = 0.0) -> float:
    """Speed of a driver who goes some way from the own speed to an advised one [m/s] (`own`, `advised` [m/s])."""
    return own + strength * min(0.0, advised - own) + trust * max(0.0, advised - own)


UNAFFECTED_ABOVE = 200.0
"""Visibility above which drivers do not slow down [m] (White & Jeffery 1980)."""

_ROUNDING = 1e-6
"""Shares together may differ from 1 by so much [-]."""

CHOICE_PERIOD = 1.0
"""Time between two choices of speed [s]."""


class SpeedChoice(Protocol):
    """How fast drivers drive in fog by themselves.

    One with a method ``share(visibility)`` [-] also slows drivers relative to the speed that they would drive in clear
    air, on any road.
    """

    def __call__(self, visibility: float) -> float:
        """Speed that a driver will not exceed [m/s]; ``inf`` where fog does not matter (`visibility` [m])."""


def speed_share(choice: SpeedChoice, visibility: float) -> float:
    """Share of the speed in clear air that drivers of a choice still want [-]; 1 if it is not relative."""
    share: Callable[[float], float] | None = getattr(choice, "share", None)
    return 1.0 if share is None else share(visibility)


@dataclass(frozen=True, slots=True)
class Unaffected:
    """Drive as in clear air, whatever the fog: the worst case."""

    def __call__(self, visibility: float) -> float:  # noqa: ARG002 - every choice is asked with the visibility
        """No limit [m/s]."""
        return math.inf


@checked_parameters
@dataclass(frozen=True, slots=True)
class WithinSight:
    """Drive so that one can stop within the visibility: the careful case.

    Attributes
    ----------
    reaction_time : float
        Time before braking [s].
    deceleration : float
        Deceleration of the stop [m/s²].
    """

    reaction_time: Annotated[float, Range(0.0, 60.0, "s")] = REACTION_TIME
    deceleration: Annotated[float, Range(0.1, 15.0, "m/s²")] = DECELERATION

    def __call__(self, visibility: float) -> float:
        """Safe speed [m/s] (`visibility` [m])."""
        return safe_speed(visibility, self.reaction_time, self.deceleration)


@checked_parameters
@dataclass(frozen=True, slots=True)
class TooFast:
    """Slow down below 200 m, but to 1.4 times what would be safe: a factor of FogSim's own, from no field study.

    Attributes
    ----------
    factor : float
        Speed over the safe one [-].
    """

    factor: Annotated[float, Range(0.1, 10.0)] = 1.4

    def __call__(self, visibility: float) -> float:
        """Limit below 200 m [m/s] (`visibility` [m])."""
        return math.inf if visibility >= UNAFFECTED_ABOVE else self.factor * within_sight(visibility)


@checked_parameters
@dataclass(frozen=True, slots=True)
class ObservedSpeed:
    """Slow down as drivers were seen to: a little on any road, and to what sight allows only in the densest fog.

    Two tendencies; the slower one holds. Fog makes people drive slower than they otherwise would, by a share that
    grows from nothing at 200 m (White & Jeffery 1980) to 18 % in severe fog (Pretto et al. 2012: 70 km/h where 85 km/h
    was to be driven; SHRP2: 10 % in near fog, 3 % in distant fog); so it does in a town, too. And they drive no faster
    than so many times the safe speed: about twice (I-77: mean speeds were twice the safe speed), but not more than once
    where they see next to nothing (A16 without signs below 35 m: 29 km/h on average, which is the safe speed at 30 m).
    Between, the ratio is linear in visibility: FogSim's own link. So overdriving is worst between 40 and 100 m (Hogema
    & van der Horst 1994), and at 50 m more than half drive faster than they can stop within what they see (SR281).

    How the share bends, and the ratio of 2.1, were calibrated to these sizes in motorway traffic (`fogsim reproduce
    drivers` with its calibration seeds): vehicles behind slower ones drive slower than they would by themselves.

    Attributes
    ----------
    unaffected_above : float
        Visibility from which drivers do not slow down [m], above `severe` and `overdriving_from`.
    slowest_share : float
        Share of the speed in clear air that is still wanted in severe fog [-].
    severe : float
        Visibility up to which fog is severe [m].
    overdriving : float
        Speed over the safe one that drivers do not exceed [-].
    overdriving_from : float
        Visibility from which they drive so much faster than is safe [m], above `safe_up_to`.
    safe_up_to : float
        Visibility up to which they drive no faster than is safe [m].
    curvature : float
        Power of the density with which that share falls [-]; 1 is linear.
    """

    unaffected_above: Annotated[float, Range(10.0, 2000.0, "m")] = UNAFFECTED_ABOVE
    slowest_share: Annotated[float, Range(0.1, 1.0)] = 0.82
    severe: Annotated[float, Range(1.0, 1000.0, "m")] = 30.0
    overdriving: Annotated[float, Range(0.5, 10.0)] = 2.1
    overdriving_from: Annotated[float, Range(1.0, 1000.0, "m")] = 50.0
    safe_up_to: Annotated[float, Range(0.0, 1000.0, "m")] = 30.0
    curvature: Annotated[float, Range(0.1, 10.0)] = 1.5

    def __post_init__(self) -> None:
        for lower, upper in (
            ("severe", "unaffected_above"),
            ("overdriving_from", "unaffected_above"),
            ("safe_up_to", "overdriving_from"),
        ):
            low, high = getattr(self, lower), getattr(self, upper)
            if not low < high:
                raise InputError(f"ObservedSpeed: {lower} must be less than {upper}, got {low:g} and {high:g} m")

    def __call__(self, visibility: float) -> float:
        """Speed that a driver will not exceed [m/s]; ``inf`` where fog does not matter (`visibility` [m])."""
        if visibility >= self.unaffected_above:
            return math.inf
        rise = (visibility - self.safe_up_to) / (self.overdriving_from - self.safe_up_to)
        return (1.0 + (self.overdriving - 1.0) * _clipped(rise)) * within_sight(visibility)

    def share(self, visibility: float) -> float:
        """Share of the speed in clear air that a driver still wants [-] (`visibility` [m])."""
        density = _clipped((self.unaffected_above - visibility) / (self.unaffected_above - self.severe))
        return 1.0 - (1.0 - self.slowest_share) * math.pow(density, self.curvature)


unaffected, within_sight, too_fast, observed = Unaffected(), WithinSight(), TooFast(), ObservedSpeed()


def _clipped(share: float) -> float:
    return min(max(share, 0.0), 1.0)


@dataclass(frozen=True, slots=True)
class CheckedChoice:
    """A user's choice of speed, whose results are checked."""

    name: str
    choice: SpeedChoice

    def __call__(self, visibility: float) -> float:
        """Speed that a driver will not exceed [m/s] (`visibility` [m])."""
        return checked_speed(self.name, self.choice(visibility))

    def share(self, visibility: float) -> float:
        """Share of the speed in clear air, 1 for a choice without a method ``share`` [-] (`visibility` [m])."""
        return checked_share(self.name, speed_share(self.choice, visibility))


def checked_choice(name: str, choice: SpeedChoice) -> SpeedChoice:
    """A choice of speed whose results are checked unless it is FogSim's own."""
    is_own = type(choice) in (Unaffected, WithinSight, TooFast, ObservedSpeed)
    return choice if is_own else CheckedChoice(name, choice)


SPEED_CHOICES: Registry[Callable[..., SpeedChoice]] = Registry(
    "speed choice",
    {"observed": ObservedSpeed, "unaffected": Unaffected, "too_fast": TooFast, "within_sight": WithinSight},
    group="fogsim.traffic.drivers.speed_choice",
    methods=("__call__",),
)


@checked_parameters
@dataclass(frozen=True, slots=True)
class DriverSetup:
    """What drivers are like."""

    speed_choice: SpeedChoice = observed
    # Standard deviation of the logarithm of a driver's own factor on the chosen speed [-]
    spread: _Share = 0.1
    compliance: Compliance = _FULL  # How they follow advice
    # By which share they take distances for longer than they are [-] where they see the lamps of a leader and not its
    # outline, and so follow closer: 0.3 … 0.6 (Cavallo, Colomb & Doré 2001)
    misjudgement: Annotated[float, Range(0.0, 10.0)] = 0.0
    # Shares of the kinds of drivers, by their names in `FOLLOWING_MODELS`, together 1. None stands for
    # `OBSERVED_MIXTURE` if speeds are `observed` ones, and for drivers who follow as in clear air otherwise
    following: Mapping[str, _Share] | None = None
    # How they follow advice where that depends on where they hear it; the rest as `compliance` has it
    compliance_by_display: Mapping[Display, Compliance] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not callable(self.speed_choice):
            raise InputError(f"DriverSetup: speed_choice must be callable, got {shown(self.speed_choice)}")
        shares = self.following_shares
        for name in shares:
            FOLLOWING_MODELS[name]
        if not math.isclose(total := math.fsum(shares.values()), 1.0, abs_tol=_ROUNDING):
            raise InputError(f"DriverSetup: following: shares must together be 1, and are {total:g}")

    def compliance_with(self, display: Display) -> Compliance:
        """How they follow advice that they hear in one way."""
        return self.compliance_by_display.get(display, self.compliance)

    @property
    def following_shares(self) -> Mapping[str, float]:
        """Shares of the kinds of drivers, by name [-]."""
        if self.following is not None:
            return self.following
        return OBSERVED_MIXTURE if isinstance(self.speed_choice, ObservedSpeed) else {"unaffected": 1.0}


@dataclass(frozen=True, slots=True)
class DriverTraits:
    """What sets one driver apart."""

    speed_factor: float  # Factor on the speed that the setup's choice gives [-]
    # reached_from, moved_from: share of drivers reached, and of those who follow, from which on this one is among them,
    # 0 … 1: whoever follows in the car when few do follows signs, too, that more do
    reached_from: float = 0.0
    moved_from: float = 0.0
    following: str = "unaffected"  # How they follow, a name in `FOLLOWING_MODELS`

    def follows(self, compliance: Compliance) -> bool:
        """Whether advice reaches and moves them."""
        return self.hears(compliance) and self.moved_from < compliance.rate

    def hears(self, compliance: Compliance) -> bool:
        """Whether advice reaches them."""
        return self.reached_from < compliance.reached_share


class HeardAdvice(NamedTuple):
    """Advice that a driver has heard."""

    display: Display  # Where
    speed: float  # Advised speed [m/s]
    since: float  # Time for which there has been advice there [s]


def driver_traits(setup: DriverSetup, vehicle: str, seed: int) -> DriverTraits:
    """Traits of the driver of a vehicle; they depend on nothing but the seed and the vehicle's id."""
    rng = np.random.default_rng([seed, zlib.crc32(vehicle.encode())])
    speed_factor = math.exp(setup.spread * rng.standard_normal())
    reached, moved, kind = rng.random(3)
    return DriverTraits(
        speed_factor=speed_factor,
        reached_from=float(reached),
        moved_from=float(moved),
        following=_drawn_kind(setup.following_shares, kind),
    )


def _drawn_kind(shares: Mapping[str, float], draw: float) -> str:
    """The kind of driver in whose part of 0 … 1 a draw falls."""
    upper = 0.0
    for name, share in shares.items():
        upper += share
        if draw < upper:
            return name
    # Shares that add up to a little less than 1 in binary fractions.
    return next(reversed(list(shares)))


def chosen_speed(choice: SpeedChoice, factor: float, own: float, visibility: float) -> float:
    """Speed that a driver chooses in fog [m/s] (`own` [m/s], `visibility` [m])."""
    return min(factor * choice(visibility), speed_share(choice, visibility) * own)


def desired_speed(
    setup: DriverSetup,
    driver: DriverTraits,
    own: float,
    visibility: float,
    heard: Sequence[HeardAdvice] = (),
    room: float = math.inf,
    kept: float = 0.0,
) -> float:
    """Speed that a driver wants to drive, never more than the own one; speeds in m/s, `visibility` in m."""
    chosen = chosen_speed(setup.speed_choice, driver.speed_factor, own, visibility)
    chosen = min(max(min(chosen, room), kept), own)
    wanted = []
    for advice in heard:
        compliance = setup.compliance_with(advice.display)
        if driver.follows(compliance) and advice.since >= compliance.delay and advice.speed < math.inf:
            wanted.append(min(speed_by_compliance(compliance, chosen, advice.speed, visibility), own))
    return min(wanted, default=chosen)


def speed_by_compliance(compliance: Compliance, own: float, advised: float, visibility: float) -> float:
    """Speed of a driver who follows advice, as far as he believes it where he is [m/s]."""
    belief = compliance.foreseen if visibility >= UNAFFECTED_ABOVE else 1.0
    return complied_speed(own, advised, belief * compliance.strength, belief * compliance.trust)
