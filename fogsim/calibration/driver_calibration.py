"""Fits drivers' speeds and headways in fog to measured passages of vehicles, from loops or trajectories.

In fog a driver without a slower vehicle ahead drives the smaller of f·c(V) and s(V)·v₀: v₀ is the speed in clear air
and f the driver's own factor, both log-normal; c and s are `ObservedSpeed`'s limits (docs/explanation/drivers.md). The
likelihood of the smaller of two independent values gives c's ratio, s's lowest value and the spreads; intervals are
those of the profile likelihood, wider by the sandwich covariance over sessions where the data have them. Shares of the
kinds of drivers are those of a mixture: each kind turns the headways measured in clear air into headways in fog.
"""

import csv
import io
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, special, stats

from fogsim.core.files.readers import column_names, number_in_text, read_text, refuse_other_length
from fogsim.core.linear_algebra import inverse_of, matrix_product
from fogsim.errors import InputError, shown
from fogsim.traffic.drivers.following import FOLLOWING_MODELS, OBSERVED_MIXTURE, Surroundings
from fogsim.traffic.drivers.sight import DriverSight, leader_reach
from fogsim.traffic.drivers.speed_choice import UNAFFECTED_ABOVE, ObservedSpeed
from fogsim.units import DAY_ILLUMINANCE, KMH_PER_MPS

Floats = NDArray[np.float64]

FOLLOWING_BELOW = 4.0
"""Headway up to which a vehicle follows the one ahead; above, its speed is the driver's own choice [s]."""

LEAST = 30
"""Fewest vehicles in fog, and in clear air, that a fit needs; and in fog those who drive at the limit that a constant
describes, by the fit: over fewer, intervals do not hold."""

_LEAST_SESSIONS = 10
"""Fewest sessions with fog whose spread gives intervals: over fewer, the sandwich tends to zero."""

_SPEEDS = {"speed_mps": 1.0, "speed_kmh": KMH_PER_MPS}
FITTED = ("slowest_share", "overdriving", "speed_spread")
_NORMAL_90 = 1.6448536
_LEAST_DEVIATION = 0.005
"""Smallest standard deviation of the logarithm of speeds in clear air; below, they are classes or limits [-]."""
_FIRST_STEP = 0.1
"""First step of the search for the end of an interval, in logarithms [-]."""
_END = 1e-3
"""Accuracy of the ends of an interval, in logarithms [-]."""
_STEP = 1e-4
"""Step of numerical derivatives, in logarithms [-]."""

_RESAMPLES, _ITERATIONS = 200, 300
_MINIMUM_GAP = 2.5
"""Gap at a standstill of SUMO's vehicles [m]."""

_CLEAR_HEADWAYS, _KERNEL = 100, 0.05
"""Quantiles that stand for the headways in clear air, and the width of each in fog [log s]."""


class Interval(NamedTuple):
    """A fitted value and the ends of its 90 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Passages:
    """Vehicles that passed, each array (n,)."""

    visibility: Floats  # [m]
    speed: Floats  # [m/s]
    headway: Floats  # [s]; NaN where unknown
    session: NDArray[np.intp]  # Number of the day or site whose vehicles are not independent; -1 for none


@dataclass(frozen=True, slots=True)
class FittedDrivers:
    """Constants of drivers, each with its 90 % interval, and the number of vehicles behind them."""

    constants: Mapping[str, Interval]  # By name; without those that too few vehicles show
    following: Mapping[str, Interval]  # Shares of kinds with intervals; empty without headways
    clear: int
    fog: int

    def as_yaml(self, source: str) -> str:
        """The block ``drivers`` of a scenario."""
        values = {name: f"{name}: {found.value:.3f}" for name, found in self.constants.items()}
        spread = values.pop("speed_spread", "")
        lines = [
            f"# fogsim calibrate drivers {source}: {self.fog} vehicles in fog, {self.clear} in clear air",
            "drivers:",
            "  speed_choice:",
            "    method: observed",
            f"    parameters: {{{', '.join(values.values())}}}",
            *([f"  {spread}"] if spread else []),
        ]
        if self.following:
            *first, last = ((name, round(value, 3)) for name, (value, _, _) in self.following.items())
            shares = [*first, (last[0], round(1.0 - sum(value for _, value in first), 3))]
            lines.append(f"  following: {{{', '.join(f'{name}: {value:g}' for name, value in shares)}}}")
        return "\n".join(lines) + "\n"


def read_passages(path: Path) -> Passages:
    """Read a CSV of vehicles: visibility_m, speed_kmh or speed_mps, and if known headway_s and session."""
    rows = csv.DictReader(io.StringIO(read_text(path), newline=""))
    values, sessions = [], []
    try:
        names = column_names(path, rows.fieldnames)
        speeds = [name for name in _SPEEDS if name in names]
        if "visibility_m" not in names or len(speeds) != 1:
            raise InputError(
                f"{path}:1: expected columns visibility_m and either speed_kmh or speed_mps, and if known headway_s "
                f"and session; got {', '.join(names) or 'none'}"
            )
        for optional in ("headway_s", "session"):
            # A column of the user's own is left out, but not one that was meant.
            meant = [one for one in names if one.casefold().startswith(optional.removesuffix("_s"))]
            if meant and optional not in meant:
                raise InputError(f"{path}:1: column {shown(meant[0])}: did you mean {optional!r}?")
        for row in rows:
            where = f"{path}:{rows.line_num}"
            refuse_other_length(where, row)
            speed = number_in_text(where, speeds[0], row[speeds[0]], 0.1, 500.0) / _SPEEDS[speeds[0]]
            visibility = number_in_text(where, "visibility_m", row["visibility_m"], 1.0, 1e6)
            headway = row.get("headway_s")
            gap = number_in_text(where, "headway_s", headway, 0.01, 1e6) if headway else math.nan
            values.append((visibility, speed, gap))
            sessions.append(row.get("session") or "")
    except csv.Error as error:
        raise InputError(f"{path}:{rows.line_num + 1}: not valid CSV: {error}") from error
    columns = np.array(values, dtype=float).reshape(-1, 3).T
    if any(sessions) and not all(sessions):
        raise InputError(f"{path}:{2 + sessions.index('')}: session is empty; give one for every vehicle, or for none")
    _, number = np.unique(sessions, return_inverse=True)
    return Passages(columns[0], columns[1], columns[2], number if any(sessions) else np.full(len(sessions), -1))


def fit_drivers(passages: Passages) -> FittedDrivers:
    """Fit speeds of vehicles that do not follow, and headways of those that do; InputError where there are too few."""
    fog, follows = passages.visibility < UNAFFECTED_ABOVE, passages.headway <= FOLLOWING_BELOW
    for words, chosen in (("in fog", fog & ~follows), ("in clear air", ~fog & ~follows)):
        if np.count_nonzero(chosen) < LEAST:
            raise InputError(
                f"expected at least {LEAST} vehicles {words} (visibility below or above {UNAFFECTED_ABOVE:g} m) that "
                f"do not follow another within {FOLLOWING_BELOW:g} s, got {np.count_nonzero(chosen)}"
            )
    if np.log(passages.speed[~fog & ~follows]).std() < _LEAST_DEVIATION:
        raise InputError("expected vehicles of different speeds in clear air, got nearly the same speed for all")
    clear_headways = passages.headway[~fog & follows]
    enough = min(int(np.count_nonzero(fog & follows)), len(clear_headways)) >= LEAST
    for chosen in (fog & ~follows, fog & follows) if enough else (fog & ~follows,):
        sessions = np.unique(passages.session[chosen])
        if sessions[0] >= 0 and len(sessions) < _LEAST_SESSIONS:
            raise InputError(
                f"expected vehicles in fog from at least {_LEAST_SESSIONS} sessions, got {len(sessions)}: too few for "
                "intervals; leave out the column session to count each vehicle as independent"
            )
    constants = _fitted_speeds(passages, ~follows)
    following = _fitted_shares(passages, fog & follows, clear_headways) if enough else {}
    return FittedDrivers(constants, following, int(np.count_nonzero(~fog)), int(np.count_nonzero(fog)))


class _SpeedModel:
    """Likelihood of the speeds of vehicles that do not follow.

    Parameters are the mean and log-deviation of the logarithm of the speed in clear air, the logit of the share that is
    lost in severe fog, and the logarithms of the ratio to the safe speed and of its spread.
    """

    def __init__(self, visibility: Floats, speed: Floats) -> None:
        usual, least = ObservedSpeed(), ObservedSpeed(slowest_share=0.5, overdriving=1.0)
        self._log_speed = np.log(speed)
        self._log_safe = np.log([least(v) for v in visibility])
        self._rise = np.clip((visibility - usual.safe_up_to) / (usual.overdriving_from - usual.safe_up_to), 0.0, 1.0)
        self._density = np.array([1.0 - least.share(v) for v in visibility]) / 0.5
        clear = self._log_speed[visibility >= UNAFFECTED_ABOVE]
        lost = 1.0 - usual.slowest_share
        begin = [clear.mean(), math.log(clear.std()), math.log(lost / (1.0 - lost)), math.log(usual.overdriving), -2.3]
        # The second begins where sight limits none.
        self.starts = (np.array(begin), np.array([*begin[:3], math.log(8.0), begin[4]]))

    def losses(self, parameters: Floats) -> Floats:
        """Negative logarithm of each vehicle's likelihood (n,)."""
        return np.asarray(-np.logaddexp(*self._by_limit(parameters)))

    def most_likely(self, starts: Iterable[Floats], fixed: int | None = None) -> Floats:
        """The parameters of the least loss that a search from any of the starts finds; one may stay as it is there."""
        fits = []
        for start in starts:
            bounds = [
                (at, at) if i == fixed else bound for i, (at, bound) in enumerate(zip(start, _BOUNDS, strict=True))
            ]
            fits.append(optimize.minimize(self._loss, start, method="L-BFGS-B", bounds=bounds))
        return np.asarray(min(fits, key=lambda fit: float(fit.fun)).x)

    def interval(self, found: Floats, index: int, excess: float) -> tuple[float, float]:
        """Ends of the 90 % interval of a parameter: there, the likelihood of the best others has fallen enough.

        Unlike multiples of a standard deviation, they hold where a parameter is nearly unlimited on one side.
        """
        limit = self._loss(found) + 0.5 * excess * _NORMAL_90**2 / len(self._log_speed)
        nearest = found

        def rise(value: float) -> float:
            nonlocal nearest
            starts = [np.where(np.arange(len(found)) == index, value, one) for one in (nearest, self.starts[1])]
            nearest = self.most_likely(starts, index)
            return self._loss(nearest) - limit

        ends = []
        for bound, sign in zip(_BOUNDS[index], (-1.0, 1.0), strict=True):
            nearest, inside, step, is_bracketed = found, float(found[index]), _FIRST_STEP, False
            outside = inside
            while not is_bracketed and outside != bound:
                outside = float(np.clip(inside + sign * step, *sorted((bound, found[index]))))
                is_bracketed = rise(outside) > 0.0
                inside, step = (inside, step) if is_bracketed else (outside, 2.0 * step)
            while is_bracketed and abs(outside - inside) > _END:
                middle = 0.5 * (inside + outside)
                inside, outside = (inside, middle) if rise(middle) > 0.0 else (middle, outside)
            ends.append(outside)
        return ends[0], ends[1]

    def _loss(self, parameters: Floats) -> float:
        return float(self.losses(parameters).mean())

    def seen(self, parameters: Floats) -> Floats:
        """Probability that sight limits each vehicle's speed (n,) [-]."""
        by_own, by_sight = self._by_limit(parameters)
        return np.asarray(np.exp(by_sight - np.logaddexp(by_own, by_sight)))

    def _by_limit(self, parameters: Floats) -> tuple[Floats, Floats]:
        """Logarithms of each vehicle's likelihood with its own wish, or sight, as the limit, but for a constant."""
        centre, log_deviation, logit, log_ratio, log_spread = parameters
        share = 1.0 - self._density / (1.0 + math.exp(-logit))
        own = (self._log_speed - centre - np.log(share)) / math.exp(log_deviation)
        limit = self._log_safe + np.log1p((math.exp(log_ratio) - 1.0) * self._rise)
        seen = (self._log_speed - limit) / math.exp(log_spread)
        by_own = special.log_ndtr(-seen) - 0.5 * own**2 - log_deviation
        by_sight = special.log_ndtr(-own) - 0.5 * seen**2 - log_spread
        return by_own, by_sight


_BOUNDS = ((None, None), (-6.0, 2.0), (-8.0, math.log(9.0)), (math.log(0.5), math.log(10.0)), (-5.0, 0.0))
"""Of the parameters; a scenario accepts all constants between them."""


def _fitted_speeds(passages: Passages, free: NDArray[np.bool_]) -> dict[str, Interval]:
    model = _SpeedModel(passages.visibility[free], passages.speed[free])
    found = model.most_likely(model.starts)
    excess = _excess(model, found, passages.session[free])
    low, high = np.transpose([(at, at) if i < 2 else model.interval(found, i, excess[i]) for i, at in enumerate(found)])
    kept = 1.0 / (1.0 + np.exp([found[2], high[2], low[2]]))
    ratio, spread = (np.exp([found[i], low[i], high[i]]) for i in (3, 4))
    seen = model.seen(found)[passages.visibility[free] < UNAFFECTED_ABOVE]
    by_sight = float(seen.sum()) if all(high[i] < _BOUNDS[i][1] for i in (3, 4)) else 0.0
    values = zip(FITTED, (kept, ratio, spread), (len(seen) - by_sight, by_sight, by_sight), strict=True)
    return {name: Interval(*map(float, value)) for name, value, count in values if count >= LEAST}


def _excess(model: _SpeedModel, found: Floats, session: NDArray[np.intp]) -> Floats:
    """Sandwich variance of the fitted parameters, of scores summed over sessions, as a multiple of the model's own."""
    steps = _STEP * np.eye(len(found))

    def scores(at: Floats) -> Floats:
        return np.stack([(model.losses(at + step) - model.losses(at - step)) / (2.0 * _STEP) for step in steps])

    curvature = np.stack([(scores(found + step) - scores(found - step)).sum(axis=1) / (2.0 * _STEP) for step in steps])
    each = scores(found)
    if int(session[0]) >= 0:
        each = np.stack([np.bincount(session, weights=score) for score in each])
    bread, meat = inverse_of(0.5 * (curvature + curvature.T)), matrix_product(each, each.T)
    own, sandwich = np.diag(bread), np.diag(matrix_product(matrix_product(bread, meat), bread))
    return np.divide(sandwich, own, np.ones(len(own)), where=own > 0.0)


def _fitted_shares(passages: Passages, following: NDArray[np.bool_], clear: Floats) -> dict[str, Interval]:
    """Shares of drivers' kinds among followers in fog, with intervals; `careful` to `out_of_sight` is assumed."""
    kinds = ("in_sight", "unaffected", "careful")
    own = np.quantile(clear, (np.arange(_CLEAR_HEADWAYS) + 0.5) / _CLEAR_HEADWAYS)
    sight = DriverSight(DAY_ILLUMINANCE)
    density = np.empty((np.count_nonzero(following), len(kinds)))
    rows = zip(*(values[following] for values in (passages.visibility, passages.speed, passages.headway)), strict=True)
    for i, (visibility, speed, headway) in enumerate(rows):
        around = Surroundings(visibility, leader_reach(sight, visibility), speed, _MINIMUM_GAP)
        for j, kind in enumerate(kinds):
            expected = np.log([FOLLOWING_MODELS[kind].headway(one, around) for one in own])
            density[i, j] = stats.norm.pdf(math.log(headway), expected, _KERNEL).mean()
    session = passages.session[following]
    blocks = np.arange(len(session)) if int(session[0]) < 0 else np.unique(session, return_inverse=True)[1]
    rng, count = np.random.default_rng(0), int(blocks.max()) + 1
    weights = [np.bincount(rng.integers(count, size=count), minlength=count)[blocks] for _ in range(_RESAMPLES)]
    ends = np.quantile([_mixture(density, weight) for weight in weights], (0.05, 0.95), axis=0)
    found = np.stack([_mixture(density, np.ones(len(blocks))), *ends], axis=1)
    shares = {kind: Interval(*row) for kind, row in zip(kinds, found.tolist(), strict=True)}
    careful, hidden = OBSERVED_MIXTURE["careful"], OBSERVED_MIXTURE["out_of_sight"]
    both = shares.pop("careful")
    for kind, part in (("careful", careful), ("out_of_sight", hidden)):
        shares[kind] = Interval(*(part / (careful + hidden) * value for value in both))
    return shares


def _mixture(density: Floats, weight: NDArray[Any]) -> Floats:
    """Shares of a mixture of known densities (n, kinds) with the greatest weighted likelihood (kinds,)."""
    shares = np.full(density.shape[1], 1.0 / density.shape[1])
    for _ in range(_ITERATIONS):
        joint = shares * density + 1e-300
        shares = (weight[:, None] * joint / joint.sum(axis=1, keepdims=True)).sum(axis=0) / weight.sum()
    return shares
