"""Differences to the baseline: the same seeds under two policies, with intervals and a paired test.

Every comparison changes the levels of the factors that the baseline names and keeps all others. Runs of the same seed
have the same traffic and noise, so the difference is taken run by run.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from fogsim.study.main_metrics import metric_words, short_number, signed
from fogsim.study.plan import Study
from fogsim.study.table import Row

RESAMPLES = 9_999
"""Resamples of bootstraps and permutation tests."""

_DENOMINATORS = (
    *("traffic_vehicle_distance_in_fog_m", "traffic_vehicle_distance_m", "traffic_vehicle_time_s"),
    *("distance_in_fog_m", "traffic_cohort_vehicles"),
)
"""Metrics that others are divided by."""

_MOVED_SHARE = 0.05
"""Change of a denominator, and share of unfinished vehicles of a cohort, from which the report says so [-]."""

_SATURATED_SHARE = 0.9
"""Share of runs at a metric's extreme value above which it shows little about the rest [-]."""


@dataclass(frozen=True, slots=True)
class Difference:
    """One metric under one policy, compared to the baseline with the same seeds.

    Attributes
    ----------
    metric : str
        The metric; its name ends in its unit.
    levels : mapping from str to str
        Levels of all factors of the compared policy.
    baseline_mean, mean : float
        Means under the baseline and here, in the metric's unit.
    difference : float
        Mean of the differences of runs with the same seed.
    low, high : float or None
        Ends of its bootstrap interval (BCa; Efron 1987); None if all differences are equal, or it is `untested`.
    p_value : float or None
        Of a paired permutation test of no difference, two-sided; None if no run differs, there is only one, or it is
        `untested`.
    pairs : int
        Number of seeds with a value in both runs.
    seeds_for_half_width : int or None
        Seeds needed for an interval of the study's wanted half-width, by the normal distribution.
    adjusted_p_value : float or None
        The p-value adjusted for a family of comparisons (Benjamini & Hochberg 1995), once `adjust_p_values` has run.
    unpaired : int
        Of a metric that ranks policies: number of seeds with a value in only one of both runs.
    """

    metric: str
    levels: Mapping[str, str]
    baseline_mean: float
    mean: float
    difference: float
    low: float | None
    high: float | None
    p_value: float | None
    pairs: int
    seeds_for_half_width: int | None
    adjusted_p_value: float | None = None
    unpaired: int = 0

    @property
    def untested(self) -> str:
        """Why nothing is tested: a missing value may be the best, as without any approach; empty if it is."""
        return f"{self.unpaired} of {self.pairs + self.unpaired} pairs lack a value" if self.unpaired else ""

    def is_shown(self, confidence: float) -> bool:
        """Whether the data show a difference: the interval excludes 0, and the test agrees.

        A difference that is the same in every run has no interval; only the test counts. With few seeds, the bootstrap
        alone would claim too much: three differences of one sign exclude 0, and occur by chance in one case of four.

        Parameters
        ----------
        confidence : float
            Confidence of the interval.
        """
        if self.p_value is None or self.p_value > 1.0 - confidence:
            return False
        return self.low is None or self.high is None or self.low > 0.0 or self.high < 0.0


def numeric_metrics(rows: Sequence[Row], factors: Iterable[str]) -> list[str]:
    """Columns other than `factors` and the run's own that are numbers in at least one run."""
    others = {*factors, "run", "seed", "status", "message"}
    names = dict.fromkeys(key for row in rows for key, v in row.items() if number_of(v) is not None)
    return [name for name in names if name not in others]


def number_of(value: object) -> float | None:
    """Value of a cell as a number; None if it is not one."""
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


def compare_to_baseline(study: Study, rows: Sequence[Row], metrics: Sequence[str]) -> list[Difference]:
    """Compare every policy to the baseline, by metric and in grid order, without pairs that share no seed."""
    pairs = list(_paired_rows(study, rows))
    found = (_difference(study, metric, levels, both) for metric in metrics for levels, both in pairs)
    return [one for one in found if one is not None]


def incomplete_metrics(study: Study, rows: Sequence[Row], metrics: Sequence[str]) -> set[str]:
    """Metrics that rank policies and have a value in only one run of some pair."""
    pairs = list(_paired_rows(study, rows))
    return {metric for metric in metrics if any(_unpaired(both, metric) for _, both in pairs)}


def moved_denominators(study: Study, rows: Sequence[Row]) -> list[str]:
    """Sentences on where a policy moves a denominator by more than 5 %, or leaves as much of a cohort unfinished."""
    said = []
    pairs = [(" · ".join(levels.values()), both) for levels, both in _paired_rows(study, rows)]
    for metric in _DENOMINATORS:
        words = metric_words(metric)
        for policy, both in pairs:
            values = words.scale * _paired_values(both, metric)
            baseline, here = values.mean(axis=0) if len(values) else (0.0, 0.0)
            change = here / baseline - 1.0 if baseline > 0.0 else 0.0
            if abs(change) > _MOVED_SHARE:
                said.append(
                    f"{words.label}: {short_number(here)} {words.unit} with {policy}, {short_number(baseline)} "
                    f"{words.unit} under the baseline ({signed(100.0 * change, 2)} %). Metrics divided by it compare "
                    "different amounts of traffic."
                )
    cohorts: dict[str, NDArray[np.float64]] = {}
    for row in rows:
        counts = [number_of(row.get(f"traffic_cohort_{key}")) or 0.0 for key in ("unfinished", "vehicles")]
        cell = " · ".join(str(row[name]) for name in study.factors)
        cohorts[cell] = cohorts.get(cell, np.zeros(2)) + np.array(counts)
    said += [
        f"Cohort: {100.0 * unfinished / vehicles:.0f} % of its vehicles have not left when the run ends with {cell}; "
        "their later conflicts are not counted. Raise duration_s."
        for cell, (unfinished, vehicles) in cohorts.items()
        if unfinished > _MOVED_SHARE * vehicles
    ]
    return said


def _paired_rows(study: Study, rows: Sequence[Row]) -> Iterator[tuple[dict[str, str], list[tuple[Row, Row]]]]:
    """Levels of each compared policy, and its runs, each after the baseline's run with the same seed."""
    by_cell: dict[tuple[str, ...], dict[int, Row]] = {}
    for row in rows:
        cell = tuple(str(row[name]) for name in study.factors)
        by_cell.setdefault(cell, {})[int(str(row["seed"]))] = row
    for cell, runs in by_cell.items():
        levels = dict(zip(study.factors, cell, strict=True))
        of_baseline = tuple({**levels, **study.baseline}.values())
        if of_baseline != cell and of_baseline in by_cell:
            baseline = by_cell[of_baseline]
            yield levels, [(baseline[seed], run) for seed, run in runs.items() if seed in baseline]


def _paired_values(both: Sequence[tuple[Row, Row]], metric: str) -> NDArray[np.float64]:
    """Values of a metric under the baseline and here (n, 2), where both runs have one."""
    values = [(number_of(baseline.get(metric)), number_of(run.get(metric))) for baseline, run in both]
    return np.array([pair for pair in values if None not in pair], dtype=np.float64).reshape(-1, 2)


def _unpaired(both: Sequence[tuple[Row, Row]], metric: str) -> int:
    """Pairs in which only one run has a value of a metric; 0 for one that does not rank policies."""
    if metric_words(metric).better is None:
        return 0
    return sum((number_of(one.get(metric)) is None) != (number_of(other.get(metric)) is None) for one, other in both)


def _difference(
    study: Study, metric: str, levels: Mapping[str, str], both: Sequence[tuple[Row, Row]]
) -> Difference | None:
    values, unpaired = _paired_values(both, metric), _unpaired(both, metric)
    if not len(values):
        return None
    differences = values[:, 1] - values[:, 0]
    tested = differences[:0] if unpaired else differences
    low, high = mean_interval(tested, study.confidence)
    baseline_mean = float(values[:, 0].mean())
    return Difference(
        metric=metric,
        levels=levels,
        baseline_mean=baseline_mean,
        mean=float(values[:, 1].mean()),
        difference=float(differences.mean()),
        low=low,
        high=high,
        p_value=_p_value(tested),
        pairs=len(values),
        seeds_for_half_width=_seeds_wanted(tested, study.wanted_interval * abs(baseline_mean), study.confidence),
        unpaired=unpaired,
    )


def adjust_p_values(differences: Sequence[Difference]) -> list[Difference]:
    """Adjust the p-values of a family of comparisons to their number, by Benjamini & Hochberg (1995).

    Of the differences with an adjusted value of at most 0.05, one in twenty is expected to be false.
    """
    found = [one.p_value for one in differences if one.p_value is not None]
    adjusted = iter(scipy.stats.false_discovery_control(found).tolist() if found else [])
    return [one if one.p_value is None else replace(one, adjusted_p_value=next(adjusted)) for one in differences]


def mean_interval(values: NDArray[np.float64], confidence: float) -> tuple[float | None, float | None]:
    """Bootstrap interval (BCa) of the mean of values, one per seed; (None, None) if resampling is degenerate."""
    if len(values) < 2 or np.ptp(values) == 0.0:
        return None, None
    ends = scipy.stats.bootstrap(
        (values,), np.mean, n_resamples=RESAMPLES, confidence_level=confidence, rng=np.random.default_rng(0)
    ).confidence_interval
    return (float(ends.low), float(ends.high)) if math.isfinite(ends.low) and math.isfinite(ends.high) else (None, None)


def _p_value(differences: NDArray[np.float64]) -> float | None:
    """Two-sided paired permutation test: without a difference, both signs are equally likely."""
    if len(differences) < 2 or not differences.any():
        return None
    test = scipy.stats.permutation_test(
        (differences, np.zeros_like(differences)),
        lambda x, y, axis: np.mean(x - y, axis=axis),
        permutation_type="samples",
        vectorized=True,
        n_resamples=RESAMPLES,
        rng=np.random.default_rng(0),
    )
    return float(test.pvalue)


def _seeds_wanted(differences: NDArray[np.float64], half_width: float, confidence: float) -> int | None:
    if len(differences) < 2 or half_width == 0.0:
        return None
    quantile = float(scipy.stats.norm.ppf(0.5 + 0.5 * confidence))
    return max(2, math.ceil((quantile * float(differences.std(ddof=1)) / half_width) ** 2))


def uninformative(rows: Sequence[Row], metrics: Sequence[str]) -> dict[str, str]:
    """Metrics that cannot distinguish policies, and why: constant, or nearly all runs at their limit."""
    said = {}
    for metric in metrics:
        values = np.array([v for row in rows if (v := number_of(row.get(metric))) is not None])
        if not len(values) or np.ptp(values) == 0.0:
            said[metric] = "does not vary"
            continue
        for end, word in ((values.min(), "least"), (values.max(), "highest")):
            share = float(np.mean(np.isclose(values, end, rtol=1e-3, atol=1e-9)))
            if share >= _SATURATED_SHARE:
                said[metric] = f"saturated: {share:.0%} of the runs have the {word} value, {end:.4g}"
    return said
