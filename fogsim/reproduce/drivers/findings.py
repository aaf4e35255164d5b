"""What field studies found of traffic in fog, and what of ours stands next to it.

Of the reports only abstracts and summaries have been seen:

- LR958: White & Jeffery 1980, Transport and Road Research Laboratory; the M4, three lanes
- SR281: Sumner, Baguley & Burton 1977, the same; 1780 vehicles on the M4
- M4 1976: Commercial Motor, 10 December 1976, on the study that became SR281
- C-6: Hogema & van der Horst 1994, TNO-TM; loops on a two-lane motorway near Breda, by day, a year
- A16: Hogema & van der Horst 1997, as quoted in the US DOT's database of benefits
- Broughton: Broughton, Switzer & Scott 2007, a simulator, behind leaders of 13.4 and 22.4 m/s; fogs not given
- van der Hulst: van der Hulst, Rothengatter & Meijman 1999, a simulator
- Cavallo: Cavallo & Beaudoin, a simulator; leaders of 50 to 90 km/h in a visibility of 30 m, by night
- SHRP2: Transportation Research Record 2018, doi 10.1177/0361198118774748; visibility of its "near fog" not given
"""

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from fogsim.reproduce.drivers.plan import (
    CAREFUL,
    CLEAR,
    DEFAULT,
    FAST,
    MEDIUM,
    MISJUDGING,
    PAIRS_IN,
    SIGNED,
    SLOW,
    SPARSE,
    Case,
    Pair,
    Results,
)

NEAR, _FACTOR = 0.3, 2.0
"""Relative error of a size up to which ours is inside, and factor up to which it is not outside [-]."""


class Verdict(StrEnum):
    """Whether ours agrees."""

    INSIDE = "inside"
    FACTOR_OF_TWO = "within factor 2"
    OUTSIDE = "outside"
    RIGHT = "right sign"
    WRONG = "wrong sign"
    UNKNOWN = "not measured"


@dataclass(frozen=True, slots=True)
class Size:
    """A published number, or a range of them, of one sign."""

    low: float
    high: float
    unit: str

    def __str__(self) -> str:
        """As a table has it."""
        ends = f"{self.low:.3g}" if self.low == self.high else f"{self.low:.3g} … {self.high:.3g}"
        return f"{ends} {self.unit}"

    def verdict(self, value: float) -> Verdict:
        """How near a value of ours is."""
        if self.low <= value <= self.high:
            return Verdict.INSIDE
        ratio = value / min(self.low, self.high, key=lambda end: abs(value - end))
        if abs(ratio - 1.0) <= NEAR:
            return Verdict.INSIDE
        return Verdict.FACTOR_OF_TWO if 1.0 / _FACTOR <= ratio <= _FACTOR else Verdict.OUTSIDE


@dataclass(frozen=True, slots=True)
class Bound:
    """A published statement that something lies between two numbers."""

    low: float
    high: float
    unit: str

    def __str__(self) -> str:
        """As a table has it."""
        return f"{self.low:.3g} … {self.high:.3g} {self.unit}"

    def verdict(self, value: float) -> Verdict:
        """Whether a value of ours lies there."""
        return Verdict.INSIDE if self.low <= value <= self.high else Verdict.OUTSIDE


@dataclass(frozen=True, slots=True)
class Sign:
    """A published statement that something rises or falls from an origin: 0 for a difference, 1 for a ratio."""

    rises: bool
    unit: str
    origin: float = 0.0

    def __str__(self) -> str:
        """As a table has it."""
        return f"{'>' if self.rises else '<'} {self.origin:.3g} {self.unit}"

    def verdict(self, value: float) -> Verdict:
        """Whether a value of ours has the published sign."""
        return Verdict.RIGHT if (value > self.origin) == self.rises and value != self.origin else Verdict.WRONG


@dataclass(frozen=True, slots=True)
class Look:
    """Looks up a population's measures; KeyError where they were not run."""

    results: Results
    population: str

    def __call__(self, measure: str, visibility: float, demand: float = MEDIUM) -> NDArray[np.float64]:
        """Values of a measure, seed by seed (n,), by visibility [m] and demand [1/h]."""
        return self.results.over_seeds(Case(self.population, demand, visibility), measure)

    def signed(self, measure: str, visibility: float) -> NDArray[np.float64]:
        """Values under the A16's signs (n,), which only the default drivers have."""
        population = SIGNED if self.population == DEFAULT else f"{self.population} {SIGNED}"
        return self.results.over_seeds(Case(population, MEDIUM, visibility), measure)

    def pair(self, measure: str, leader_speed: float, visibility: float) -> NDArray[np.float64]:
        """Values of a measure of drivers behind one leader (n,), by the leader's speed [m/s] and visibility [m]."""
        return self.results.over_seeds(Pair(self.population, leader_speed, visibility), measure)

    def kind(self, name: str, measure: str, leader_speed: float, visibility: float) -> NDArray[np.float64]:
        """Values of one type of drivers behind one leader (n,), compared with the default drivers alone."""
        who = name if self.population == DEFAULT else f"{self.population} {name}"
        return self.results.over_seeds(Pair(who, leader_speed, visibility), measure)


@dataclass(frozen=True, slots=True)
class Finding:
    """A published finding, and how to get ours, seed by seed; `six` are those to be met within 30 %."""

    name: str
    text: str
    source: str
    published: Size | Bound | Sign
    ours: Callable[[Look], NDArray[np.float64]]
    six: bool = False

    def values(self, look: Look) -> NDArray[np.float64]:
        """Ours, seed by seed (n,); none if what it takes was not run."""
        try:
            return self.ours(look)
        except KeyError:
            return np.empty(0)

    def verdict(self, value: float) -> Verdict:
        """Whether a value of ours agrees; NaN stands for none."""
        return Verdict.UNKNOWN if math.isnan(value) else self.published.verdict(value)


Values = NDArray[np.float64]
Ours = Callable[[Look], Values]

_DENSE_FOGS = (100.0, 70.0, 50.0)
"""Visibilities of the range in which C-6 found drivers most critical, 40 to 100 m [m]."""

_THICKENING = (200.0, 150.0, 100.0, 70.0, 50.0, 30.0)


def _mean_over(visibilities: Sequence[float], value: Callable[[float], Values]) -> Values:
    return np.asarray(np.mean([value(v) for v in visibilities], axis=0))


def _free_speed(look: Look, visibility: float) -> Values:
    return look("free_speed", visibility, SPARSE)


def _free_speed_change(visibility: float) -> Ours:
    """Change of the free speed from clear air [%]."""
    return lambda look: 100.0 * (_free_speed(look, visibility) / _free_speed(look, CLEAR) - 1.0)


def _share(measure: str, visibility: float) -> Ours:
    """A share [%]."""
    return lambda look: 100.0 * look(measure, visibility)


def _change(measure: str, visibility: float) -> Ours:
    """Change of a share from clear air [percentage points]."""
    return lambda look: 100.0 * (look(measure, visibility) - look(measure, CLEAR))


def _sign_effect(measure: str, visibility: float) -> Ours:
    """What signs change."""
    return lambda look: look.signed(measure, visibility) - look(measure, visibility)


def _over_clear(measure: str) -> Ours:
    """Mean over 50 to 100 m, over that in clear air [-]."""
    return lambda look: _mean_over(_DENSE_FOGS, lambda v: look(measure, v)) / look(measure, CLEAR)


def _kind_over_clear(kind: str) -> Ours:
    """Headway of a kind of drivers behind a slow leader, over that in clear air [-]."""
    return lambda look: look.kind(kind, "headway", SLOW, PAIRS_IN) / look.kind(kind, "headway", SLOW, CLEAR)


def _least_fall(look: Look) -> Values:
    """Least fall of the free speed from one visibility to the next smaller one, from 200 m down [km/h]."""
    speeds = [_free_speed(look, v) for v in _THICKENING]
    return np.asarray(np.min([a - b for a, b in itertools.pairwise(speeds)], axis=0))


def _excess_between(look: Look) -> Values:
    """By how much more drivers overdrive at 50 to 100 m than at 30 m and at 200 m [percentage points]."""
    inside = _mean_over(_DENSE_FOGS, lambda v: look("overdriving_aashto", v))
    outside = np.maximum(look("overdriving_aashto", 30.0), look("overdriving_aashto", 200.0))
    return 100.0 * (inside - outside)


SIX: tuple[Finding, ...] = (
    Finding(
        "speed_at_200m",
        "free speed unaffected above about 200 m: change at 200 m",
        "LR958",
        Bound(-3.0, 3.0, "%"),
        _free_speed_change(200.0),
        six=True,
    ),
    Finding(
        "overdriving_at_50m",
        "more than half exceed the speed from which they stop within sight at ≤ 50 m",
        "SR281",
        Bound(50.0, 100.0, "%"),
        _share("overdriving", 50.0),
        six=True,
    ),
    Finding(
        "below_2s_at_150m",
        "one third of all vehicles follow within 2 s at 150 m",
        "LR958",
        Size(33.3, 33.3, "%"),
        _share("headway_below_2", 150.0),
        six=True,
    ),
    Finding(
        "speed_below_35m",
        "mean speed below 35 m without signs (ours: 30 m)",
        "A16",
        Size(29.0, 29.0, "km/h"),
        lambda look: look("mean_speed", 30.0),
        six=True,
    ),
    Finding(
        "signs_at_100m",
        "what signs change of the mean speed (ours: 100 m, 80 km/h shown)",
        "A16",
        Size(-10.0, -8.0, "km/h"),
        _sign_effect("mean_speed", 100.0),
        six=True,
    ),
    Finding(
        "speed_in_near_fog",
        "change of speed in near fog (ours: 100 m)",
        "SHRP2",
        Size(-10.0, -10.0, "%"),
        _free_speed_change(100.0),
        six=True,
    ),
)
"""The six sizes that are to be met within 30 %."""

_OTHER_SIZES: tuple[Finding, ...] = (
    Finding(
        "speed_in_distant_fog",
        "change of speed in distant fog (ours: 150 m)",
        "SHRP2",
        Size(-3.0, -3.0, "%"),
        _free_speed_change(150.0),
    ),
    Finding(
        "speed_above_91m",
        "mean speed above 91 m, lanes 2 and 3: 101 and 116 km/h (ours: 150 m)",
        "M4 1976",
        Size(101.0, 116.0, "km/h"),
        lambda look: look("mean_speed", 150.0),
    ),
    Finding(
        "stops_at_150m",
        "most can stop within sight down to 150 m: share that cannot",
        "LR958",
        Bound(0.0, 50.0, "%"),
        _share("overdriving", 150.0),
    ),
    Finding(
        "headway_stays",
        "no effect of fog on the headways of followers (ours: 50–100 m)",
        "C-6",
        Size(1.0, 1.0, "of clear air"),
        _over_clear("following_headway"),
    ),
    Finding(
        "signs_below_35m",
        "mean speed below 35 m with signs (ours: 30 m, 60 km/h shown)",
        "A16",
        Size(60.0, 60.0, "km/h"),
        lambda look: look.signed("mean_speed", 30.0),
    ),
    Finding(
        "signs_leave_headway",
        "signs hardly change the headways of followers (ours: 100 m)",
        "A16",
        Size(1.0, 1.0, "of no signs"),
        lambda look: look.signed("following_headway", 100.0) / look("following_headway", 100.0),
    ),
)

_SIGNS_OF_CHANGE: tuple[Finding, ...] = (
    Finding(
        "speed_falls",
        "free speed falls with visibility: least fall of five steps from 200 to 30 m",
        "C-6",
        Sign(rises=True, unit="km/h"),
        _least_fall,
    ),
    Finding(
        "worst_between_40_and_100m",
        "stopping within sight fails most between 40 and 100 m: excess over 30 and 200 m, by 2.5 s and 3.4 m/s²",
        "C-6",
        Sign(rises=True, unit="points"),
        _excess_between,
    ),
    Finding(
        "close_following_rises",
        "more follow within 2 s at 150 m than in clear air",
        "LR958",
        Sign(rises=True, unit="points"),
        _change("headway_below_2", 150.0),
    ),
    Finding(
        "distance_falls",
        "following distances fall (ours: 50–100 m)",
        "C-6",
        Sign(rises=False, unit="of clear air", origin=1.0),
        _over_clear("following_distance"),
    ),
    Finding(
        "differences_fall",
        "differences of speed to the vehicle ahead fall (ours: 50–100 m)",
        "C-6",
        Sign(rises=False, unit="of clear air", origin=1.0),
        _over_clear("speed_difference"),
    ),
    Finding(
        "ttc_rises",
        "times to collision rise (ours: median, 50–100 m)",
        "C-6",
        Sign(rises=True, unit="of clear air", origin=1.0),
        _over_clear("ttc_50"),
    ),
    Finding(
        "signs_lower_spread",
        "signs lower the standard deviation of speed slightly (ours: 100 m)",
        "A16",
        Sign(rises=False, unit="km/h"),
        _sign_effect("speed_sd", 100.0),
    ),
)

_FOLLOWERS: tuple[Finding, ...] = (
    Finding(
        "fog_splits_at_22_4mps",
        "behind 22.4 m/s fog splits drivers, some lag out of sight (ours: V_met 40 m): share",
        "Broughton",
        Bound(5.0, 95.0, "%"),
        lambda look: 100.0 * look.pair("out_of_sight", FAST, PAIRS_IN),
    ),
    Finding(
        "no_split_at_13_4mps",
        "behind 13.4 m/s it does not: share out of sight, less than at 22.4 m/s by",
        "Broughton",
        Sign(rises=True, unit="points"),
        lambda look: 100.0 * (look.pair("out_of_sight", FAST, PAIRS_IN) - look.pair("out_of_sight", SLOW, PAIRS_IN)),
    ),
    Finding(
        "short_headways_in_sight",
        "those who stay in sight at 22.4 m/s keep less than the recommended 2 s",
        "Broughton",
        Bound(0.0, 2.0, "s"),
        lambda look: look.pair("headway_in_sight", FAST, PAIRS_IN),
    ),
    Finding(
        "headway_of_careful",
        "headways grow in fog without time pressure (ours: `careful` drivers behind 13.4 m/s, 40 m)",
        "van der Hulst",
        Sign(rises=True, unit="of clear air", origin=1.0),
        _kind_over_clear(CAREFUL),
    ),
    Finding(
        "headway_of_misjudging",
        "headways shorten where only lamps are seen (ours: misjudgement 0.45, night, behind 13.4 m/s, 40 m)",
        "Cavallo",
        Sign(rises=False, unit="of clear air", origin=1.0),
        _kind_over_clear(MISJUDGING),
    ),
)

FINDINGS = SIX + _OTHER_SIZES + _SIGNS_OF_CHANGE + _FOLLOWERS
"""All findings; the six sizes come first."""
