"""Metrics that a study's report shows first, in words, and all that it can choose from."""

from collections.abc import Iterable
from typing import Literal, NamedTuple

from fogsim.errors import suggest
from fogsim.metrics import metric_keys

METHODS_KEY = "estimators"
"""Key of the estimators' own metrics, ``estimators.METHOD.KEY``."""


class MetricWords(NamedTuple):
    """A metric as a paper would name it; `scale` converts the metric's own unit to `unit`."""

    label: str
    unit: str
    scale: float = 1.0
    better: Literal["less", "more", "neither"] = "less"

    @property
    def axis(self) -> str:
        """Label of an axis."""
        return f"{self.label} [{self.unit}]" if self.unit else self.label


MAIN_METRICS = {
    "collisions": MetricWords("Collisions of all", "1/run"),
    "ego_collisions": MetricWords("Collisions of the ego", "1/run"),
    "max_impact_speed_mps": MetricWords("Highest impact speed", "km/h", 3.6),
    "traffic_conflicts_per_vehicle_km": MetricWords("Conflicts (TTC < 3 s)", "1/veh·km"),
    "traffic_exposed_time_share": MetricWords("Time at TTC < 3 s", "%", 100.0),
    "traffic_serious_conflict_time_share": MetricWords("Time at DRAC > 3.4 m/s²", "%", 100.0),
    "traffic_overdriving_time_share": MetricWords("Time of overdriving sight", "%", 100.0),
    "negative_margin_time_share": MetricWords("The ego's time of overdriving sight", "%", 100.0),
    "traffic_mean_speed_mps": MetricWords("Mean speed of all", "km/h", 3.6, "neither"),
    "traffic_speed_standard_deviation_mps": MetricWords("Standard deviation of speed", "km/h", 3.6),
    "traffic_delay_s_per_vehicle_km": MetricWords("Delay", "s/veh·km"),
    "mean_speed_mps": MetricWords("Mean speed of the ego", "km/h", 3.6, "neither"),
    "above_advice_time_share": MetricWords("The ego's time above the advice", "%", 100.0),
    "belief_median_error_percent": MetricWords("Median error of believed visibility", "%"),
}
"""Default metrics, in this order, if the table has them."""

SAFETY_METRICS = (
    ("collisions",),
    ("traffic_conflicts_per_vehicle_km", "traffic_exposed_time_share"),
    ("traffic_overdriving_time_share", "negative_margin_time_share"),
)
"""Vertical axes of trade-off figures: from each group the first that the table has and that varies."""

DELAY_METRICS = ("traffic_delay_s_per_vehicle_km", "traffic_mean_speed_mps", "mean_speed_mps")
"""Their horizontal axes, chosen in the same way."""


def metric_words(metric: str) -> MetricWords:
    """Label and unit of a metric; by default its own name, which ends in its unit."""
    return MAIN_METRICS.get(metric) or MetricWords(metric, "", better="neither")


def unknown_metrics(names: Iterable[str]) -> list[str]:
    """What is wrong with names of metrics, one line each."""
    known = [key for key in metric_keys() if key != "ending"]
    return [
        f"unknown metric {name!r}; {suggest(name, known)}"
        for name in names
        if name not in known and not (name.startswith(f"{METHODS_KEY}.") and name.count(".") == 2)
    ]


def main_metrics(chosen: Iterable[str], known: Iterable[str]) -> list[str]:
    """Metrics that the report shows first: those that the study file chose, or the default ones that exist."""
    there = set(known)
    return [name for name in tuple(chosen) or MAIN_METRICS if name in there]


def signed(value: float, digits: int = 3) -> str:
    """A difference with its sign, to `digits` significant digits."""
    text = f"{value:+.{digits}g}"
    return (f"{value:+.0f}" if "e+" in text else text).replace("-", "−")
