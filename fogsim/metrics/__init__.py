"""Safety, comfort and delay of the ego and of all vehicles near it, and the accuracy of estimators."""

from fogsim.core.kinematics import stopping_sight_distance
from fogsim.metrics.metric import Definition, JsonValue, Metric, Sample
from fogsim.metrics.run_metrics import (
    METRICS,
    MetricFactory,
    MetricsOfRun,
    RunMetrics,
    RunSummary,
    TrafficRunMetrics,
    metric_definitions,
    metric_topics,
)
from fogsim.metrics.safety import DEFAULT_STANDARD, step_metrics
from fogsim.metrics.surrogate import (
    SafetyStandard,
    crash_potential,
    deceleration_rate_to_avoid_crash,
    modified_deceleration_rate_to_avoid_crash,
    potential_collision_speed,
    stopping_distance_difference,
    time_exposed_time_to_collision,
    time_headway,
    time_integrated_time_to_collision,
    time_to_collision,
)

__all__ = [
    "DEFAULT_STANDARD",
    "METRICS",
    "Definition",
    "JsonValue",
    "Metric",
    "MetricFactory",
    "MetricsOfRun",
    "RunMetrics",
    "RunSummary",
    "SafetyStandard",
    "Sample",
    "TrafficRunMetrics",
    "crash_potential",
    "deceleration_rate_to_avoid_crash",
    "metric_definitions",
    "metric_topics",
    "modified_deceleration_rate_to_avoid_crash",
    "potential_collision_speed",
    "step_metrics",
    "stopping_distance_difference",
    "stopping_sight_distance",
    "time_exposed_time_to_collision",
    "time_headway",
    "time_integrated_time_to_collision",
    "time_to_collision",
]
