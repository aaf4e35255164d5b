"""What differs from episode to episode: fog, light, traffic, script, the ego's own driver, and the calibration."""

import bisect
import functools
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Annotated, Any, NamedTuple

import numpy as np

from fogsim.core.parameters import Range, checked_parameters
from fogsim.core.randomness import Seed
from fogsim.errors import InputError, UnknownNameError
from fogsim.traffic import SPEED_CHOICES

_LIGHT = {"day": (2000.0, 40_000.0), "dusk": (10.0, 2000.0), "night": (0.1, 0.3)}
"""Illuminance of the sky [lx]: overcast or foggy day; sun below the horizon to civil twilight's end; no moon."""

SCRIPTS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "free": (),
        "lead": ("actors.lead={ahead_of: ego, gap_m: 70, speed_kmh: 110}",),
        "slow_truck": ("actors.lead={type: truck, ahead_of: ego, gap_m: 200, speed_kmh: 70}",),
        "braking_lead": ("actors.lead={ahead_of: ego, gap_m: 70, speed_kmh: 110}",),
        "standing_vehicle": ("actors.obstacle={position_m: 1500, stands: true}",),
    }
)
"""Who is about the ego, by name. Actors are few, so that networks and route files are written once."""


_Share = Annotated[float, Range(0.0, 1.0)]


@checked_parameters
@dataclass(frozen=True, slots=True)
class Episode:
    """One episode, as far as it was drawn.

    Attributes
    ----------
    settings : tuple of str
        ``key.path=value`` each, as after ``fogsim run --set``.
    driver : str
        How fast the ego's own driver goes in fog without advice: one of `fogsim.traffic.SPEED_CHOICES`.
    light : str
        "day", "dusk", "night", or "" where the scenario says it.
    script : str
        Name of what the vehicles about the ego do, or "".
    seed : int or None
        Seed of the run, which also chooses among several scenarios; None for one that is drawn at the reset.
    """

    settings: tuple[str, ...] = ()
    driver: str = "unaffected"
    light: str = ""
    script: str = ""
    seed: Seed | None = None

    def __post_init__(self) -> None:
        """Refuse a driver that is not known."""
        check_driver(self.driver)

    def as_info(self) -> dict[str, Any]:
        """Plain data for ``info["drawn"]``."""
        return {
            "settings": list(self.settings),
            "driver": self.driver,
            "light": self.light,
            "script": self.script,
            "seed": self.seed,
        }


def check_driver(driver: str) -> None:
    """Refuse a driver of the ego that is not known."""
    if driver not in SPEED_CHOICES:
        raise UnknownNameError("driver", driver, SPEED_CHOICES)


@checked_parameters
@dataclass(frozen=True, slots=True)
class FogDistribution:
    """Which fog there may be along the ego's way.

    Attributes
    ----------
    visibility : (float, float)
        Meteorological visibility where the fog is densest, log-uniform between these [m].
    clear_share : float
        Share of episodes without fog.
    even_share : float
        Share of the others in which the fog is the same everywhere; the rest has one or two banks.
    bank_length : (float, float)
        Length of a bank, uniform between these [m].
    bank_edge : (float, float)
        Length of its soft edges, log-uniform between these [m].
    outside_visibility : (float, float)
        Visibility outside the banks, log-uniform between these [m], but at least that in them.
    ahead : (float, float)
        From the route's beginning to the first bank, and from one bank to the next, uniform between these [m].
    reach : float
        No bank begins farther from the route's beginning than this [m].
    patchy_share : float
        Share of foggy episodes in which fog thickens and thins from place to place.

    Raises
    ------
    InputError
        If a range is none or a share is not in 0 … 1.
    """

    visibility: tuple[float, float] = (25.0, 1000.0)
    clear_share: _Share = 0.1
    even_share: _Share = 0.25
    bank_length: tuple[float, float] = (300.0, 1500.0)
    bank_edge: tuple[float, float] = (30.0, 300.0)
    outside_visibility: tuple[float, float] = (200.0, 2000.0)
    ahead: tuple[float, float] = (300.0, 800.0)
    reach: float = 2500.0
    patchy_share: _Share = 0.25

    def __post_init__(self) -> None:
        for name in ("ahead", "visibility", "bank_length", "bank_edge", "outside_visibility"):
            _check_range(f"FogDistribution.{name}", getattr(self, name), 1.0)
        if self.ahead[1] > self.reach:
            raise InputError(f"FogDistribution.reach: expected at least ahead, {self.ahead!r}, got {self.reach!r}")

    def draw(self, rng: np.random.Generator, visibility: float | None = None) -> dict[str, Any]:
        """Fog of an episode, as a scenario's block ``fog``.

        Parameters
        ----------
        rng : numpy.random.Generator
            Random numbers; as many are drawn whatever comes out.
        visibility : float or None
            Visibility where it is densest [m], in place of a drawn one; ``inf`` is clear air.
        """
        shares = self.clear_share, self.even_share, self.patchy_share, 0.3
        is_clear, is_even, is_patchy, is_double = (rng.random() < share for share in shares)
        densest, outside = _log_uniform(rng, self.visibility), _log_uniform(rng, self.outside_visibility)
        banks = [self._bank(rng) for _ in range(2)]
        seed = int(rng.integers(2**31))
        if visibility is not None:
            is_clear, densest = math.isinf(visibility), visibility
        if is_clear:
            return {"visibility_m": "inf"}
        if is_even:
            fog: dict[str, Any] = {"visibility_m": densest}
        else:
            fog = {
                "outside_visibility_m": max(outside, densest),
                "banks": _placed(banks[: 1 + is_double], densest, max(outside, densest), self.reach),
            }
        if is_patchy:
            fog["patches"] = {"correlation_length_m": 100.0, "strength": 0.4, "seed": seed}
        return fog

    def _bank(self, rng: np.random.Generator) -> dict[str, float]:
        return {
            "ahead": _uniform(rng, *self.ahead),
            "length": _uniform(rng, *self.bank_length),
            "edge": _log_uniform(rng, self.bank_edge),
            "depth": _uniform(rng, 0.3, 1.0),
        }


_BETWEEN = 1.0
"""Least distance between the edges of two banks [m]."""


def _placed(
    banks: Sequence[Mapping[str, float]], densest: float, outside: float, reach: float
) -> list[dict[str, float]]:
    """Banks one after the other; the first is the densest, a further one is less dense."""
    placed, start, free_from = [], 0.0, 0.0
    for number, bank in enumerate(banks):
        edge = min(bank["edge"], bank["length"] / 2.0)
        # Soft edges are centred on where a bank begins and ends, and must not meet.
        begin = max(start + bank["ahead"], free_from + edge / 2.0)
        if begin > reach:
            break
        end = begin + bank["length"]
        share = bank["depth"]
        thinner = math.exp(share * math.log(densest) + (1.0 - share) * math.log(outside))
        inside = thinner if number else densest
        placed.append({"start_m": begin, "end_m": end, "edge_m": edge, "visibility_m": inside})
        start, free_from = end, end + edge / 2.0 + _BETWEEN
    return placed


VAN_SHARE = 0.1
"""Share of vans in the traffic."""


class Scene(NamedTuple):
    """What is drawn of an episode but for its fog."""

    light: str
    script: str
    driver: str
    lanes: int
    demand: float  # [1/h]
    trucks: float  # Share of trucks
    illuminance: float  # [lx]
    braking: tuple[float, float, float]  # Where a braking lead brakes [m], how hard [m/s²], and how long it stands [s]
    pitch: float  # Error of the camera's pitch in the calibration [rad]
    focal_length: float  # Error of its focal length, as a share

    def as_episode(self) -> Episode:
        """The episode, as settings of a scenario."""
        settings = [
            f"road.lanes={self.lanes}",
            f"demand.same_way_vph={self.demand!r}",
            f"demand.mix={json.dumps({'truck': self.trucks, 'van': VAN_SHARE})}",
            f"light.illuminance_lx={self.illuminance!r}",
            f"camera.told.pitch_error_deg={math.degrees(self.pitch)!r}",
            f"camera.told.focal_length_error_percent={100.0 * self.focal_length!r}",
            *SCRIPTS[self.script],
        ]
        if self.script == "braking_lead":
            brakes_at, deceleration, hold = self.braking
            brake = {"to_kmh": 0.0, "deceleration_mps2": deceleration, "hold_s": hold}
            rule = {"when": f"lead.position > {brakes_at:.1f} m", "do": {"lead": {"brake": brake}}}
            settings.append(f"timeline={json.dumps([rule])}")
        return Episode(tuple(settings), self.driver, self.light, self.script)


@checked_parameters
@dataclass(frozen=True, slots=True)
class ScenarioDistribution:
    """Which traffic, light, script and vehicle there may be.

    Attributes
    ----------
    lanes : tuple of int
        Lanes of the motorway, each as likely.
    demand : tuple of float
        Vehicles that drive as the ego does [1/h], each as likely.
    truck_shares : tuple of float
        Shares of trucks, each as likely.
    light : mapping from str to float
        Weights of "day", "dusk" and "night".
    scripts : mapping from str to float
        Weights of what happens about the ego: "free" (no one in particular), "lead", "slow_truck", "braking_lead"
        (which comes to a standstill for a while, somewhere) and "standing_vehicle" (in the ego's lane).
    drivers : mapping from str to float
        Weights of the ego's own driver, by `fogsim.traffic.SPEED_CHOICES`: how fast one goes in fog without advice.
    pitch_error, focal_length_error : float
        Standard deviation of the error of the camera's pitch in the calibration [rad], and share of its focal length.

    Raises
    ------
    InputError
        If a name is unknown or a weight or number cannot be.
    """

    lanes: tuple[Annotated[int, Range(1, 6)], ...] = (2, 3)
    demand: tuple[Annotated[float, Range(0.0, 20_000.0, "/h")], ...] = (300.0, 900.0, 1500.0, 2100.0)
    truck_shares: tuple[_Share, ...] = (0.1, 0.25)
    light: Mapping[str, float] = field(default_factory=lambda: {"day": 0.5, "dusk": 0.2, "night": 0.3})
    scripts: Mapping[str, float] = field(
        default_factory=lambda: {
            "free": 0.2, "lead": 0.2, "slow_truck": 0.15, "braking_lead": 0.25, "standing_vehicle": 0.2,
        }
    )  # fmt: skip
    drivers: Mapping[str, float] = field(default_factory=lambda: {"unaffected": 0.5, "observed": 0.3, "too_fast": 0.2})
    pitch_error: float = math.radians(0.3)
    focal_length_error: float = 0.01

    def __post_init__(self) -> None:
        for name, known in (("light", _LIGHT), ("scripts", SCRIPTS), ("drivers", SPEED_CHOICES)):
            _check_weights(f"ScenarioDistribution.{name}", getattr(self, name), list(known))
        for name in ("lanes", "demand", "truck_shares"):
            if not len(getattr(self, name)):
                raise InputError(f"ScenarioDistribution.{name}: expected at least one value to choose from, got none")

    @property
    def darkest(self) -> float:
        """Least illuminance of the sky that may be drawn [lx]."""
        return min(_LIGHT[name][0] for name, weight in self.light.items() if weight > 0.0)

    def draw(self, rng: np.random.Generator) -> Episode:
        """An episode but for its fog.

        Parameters
        ----------
        rng : numpy.random.Generator
            Random numbers; as many are drawn whatever comes out.
        """
        return self.draw_scene(rng).as_episode()

    def draw_scene(self, rng: np.random.Generator) -> Scene:
        """What `draw` draws, as values.

        Parameters
        ----------
        rng : numpy.random.Generator
            See `draw`.
        """
        light, script, driver = (_choice(rng, weights) for weights in (self.light, self.scripts, self.drivers))
        lanes, demand, trucks = (values[int(rng.integers(len(values)))] for values in self._values())
        illuminance = _log_uniform(rng, _LIGHT[light])
        braking = _uniform(rng, 500.0, 2000.0), _uniform(rng, 3.0, 7.0), _uniform(rng, 5.0, 30.0)
        pitch, focal = (float(error) * rng.standard_normal() for error in (self.pitch_error, self.focal_length_error))
        return Scene(
            light, script, driver, int(lanes), float(demand), float(trucks), illuminance, braking, pitch, focal
        )

    def _values(self) -> tuple[Sequence[float], ...]:
        return self.lanes, self.demand, self.truck_shares


def fog_setting(fog: Mapping[str, Any]) -> str:
    """Override that puts a block ``fog`` in place of a scenario's."""
    return f"fog={json.dumps(dict(fog))}"


def _uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """The same number as `rng.uniform` gives, which takes several times as long."""
    return float(low + (high - low) * rng.random())


def _log_uniform(rng: np.random.Generator, limits: tuple[float, float]) -> float:
    return math.exp(_uniform(rng, math.log(limits[0]), math.log(limits[1])))


def _choice(rng: np.random.Generator, weights: Mapping[str, float]) -> str:
    return list(weights)[bisect.bisect_right(_cumulative(tuple(weights.values())), rng.random())]


@functools.cache
def _cumulative(weights: tuple[float, ...]) -> list[float]:
    values = np.array(weights, dtype=float)
    shares: list[float] = (np.cumsum(values) / values.sum()).tolist()
    return shares


def _check_range(name: str, limits: Sequence[float], least: float) -> None:
    low, high = limits
    if not (least <= low <= high and math.isfinite(high)):
        raise InputError(f"{name}: expected two numbers, {least:g} ≤ lower ≤ upper, got {tuple(limits)!r}")


def _check_weights(name: str, weights: Mapping[str, float], known: Sequence[str]) -> None:
    unknown = [one for one in weights if one not in known]
    if unknown:
        raise InputError(f"{name}: unknown name {unknown[0]!r}; known: {', '.join(known)}")
    values = list(weights.values())
    if not values or min(values) < 0.0 or not 0.0 < sum(values) < math.inf:
        raise InputError(f"{name}: expected weights of at least 0, not all 0, got {dict(weights)!r}")
