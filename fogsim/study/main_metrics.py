"""Metrics that a study's report shows first, in words, and all that it can choose from."""

from collections.abc import Iterable
from typing import Literal, NamedTuple

from fogsim.errors import suggest
from fogsim.metrics import Definition, metric_definitions
from fogsim.metrics.metric import definitions_of

METHODS_KEY = "estimators"
"""Key of the estimators' own metrics, ``estimators.METHOD.KEY``."""


MAIN_METRICS = (
    "collisions",
    "ego_collisions",
    "traffic_collisions_per_cohort_vehicle",
    "traffic_conflicts_per_cohort_vehicle",
    "traffic_hard_braking_events_per_cohort_vehicle",
    "minimum_time_to_collision_s",
    "traffic_overdriven_m_per_vehicle_km_in_fog",
    "traffic_sight_margin_by_distance_m",
    "overdriven_m_per_km_in_fog",
    "sight_margin_by_distance_m",
    "traffic_delay_s_per_cohort_vehicle",
    "traffic_delay_s_per_vehicle_km",
    "traffic_mean_speed_mps",
    "traffic_speed_standard_deviation_mps",
    "mean_speed_mps",
    "belief_median_error_percent",
)
"""Default metrics, in this order, if the table has them: those that rank policies, then context."""

SAFETY_METRICS = (
    ("traffic_collisions_per_cohort_vehicle", "collisions"),
    ("traffic_conflicts_per_cohort_vehicle", "minimum_time_to_collision_s"),
    ("traffic_overdriven_m_per_vehicle_km_in_fog", "overdriven_m_per_km_in_fog"),
)
"""Vertical axes of trade-off figures: from each group the first that the table has and that varies; all rank."""

DELAY_METRICS = (
    *("traffic_delay_s_per_cohort_vehicle", "traffic_delay_s_per_vehicle_km"),
    *("traffic_mean_speed_mps", "mean_speed_mps"),
)
"""Their horizontal axes, chosen in the same way."""


OF_THE_BELIEF = frozenset(
    key
    for metric in ("belief", "belief_ahead", "dense_fog_known", "equipped")
    for key in definitions_of(metric)
    if key != "equipped_vehicles_mean"
)
"""Metrics of what is believed of the fog; without a camera, they are those of its prior."""

OF_WARNINGS = frozenset(definitions_of("fog_warnings"))
"""Metrics of the driver's warnings, which without a camera only a controller gives."""


class MetricWords(NamedTuple):
    """A metric as a report names it; `scale` converts the metric's own unit to `unit`."""

    label: str
    unit: str
    scale: float
    better: Literal["lower", "higher"] | None

    @property
    def axis(self) -> str:
        """Label of an axis."""
        return f"{self.label} [{self.unit}]" if self.unit else self.label


def metric_words(metric: str) -> MetricWords:
    """Label, unit and direction of a metric from its definition; the label is its own name by default."""
    found = metric_definitions().get(metric) or Definition("")
    return MetricWords(found.label or metric, found.unit, found.scale, found.better)


def unknown_metrics(names: Iterable[str]) -> list[str]:
    """What is wrong with names of metrics, one line each."""
    known = [key for key in metric_definitions() if key != "ending"]
    return [
        f"unknown metric {name!r}; {suggest(name, known)}"
        for name in names
        if name not in known and not (name.startswith(f"{METHODS_KEY}.") and name.count(".") >= 2)
    ]


def main_metrics(chosen: Iterable[str], known: Iterable[str]) -> list[str]:
    """Metrics that the report shows first: those that the study file chose, or the default ones that exist."""
    there = set(known)
    return [name for name in tuple(chosen) or MAIN_METRICS if name in there]


def percent(share: float) -> str:
    """A share in percent, with all of its digits."""
    return f"{100.0 * share:g}%"


def short_number(value: float, digits: int = 3, sign: str = "-") -> str:
    """A number to `digits` significant digits, or all of a longer whole part; `sign` as in format strings."""
    text = f"{value:{sign}.{digits}g}"
    return (f"{value:{sign}.0f}" if "e+" in text else text).replace("-", "−")


def signed(value: float, digits: int = 3) -> str:
    """A difference with its sign, to `digits` significant digits."""
    return short_number(value, digits, "+")
