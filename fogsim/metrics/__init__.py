"""Safety, comfort and delay of the ego and of everybody near it, and how right estimators were."""

from fogsim.kinematics import stopping_sight_distance
from fogsim.metrics.metric import JsonValue, Metric, Sample
from fogsim.metrics.run_metrics import (
    METRICS,
    MetricFactory,
    MetricsOfRun,
    RunMetrics,
    RunSummary,
    TrafficRunMetrics,
    metric_keys,
    metric_topics,
)
from fogsim.metrics.step_metrics import DEFAULT_STANDARD, step_metrics
from fogsim.metrics.surrogate import (
    SafetyStandard,
    deceleration_rate_to_avoid_crash,
    modified_deceleration_rate_to_avoid_crash,
    potential_collision_speed,
    time_exposed_time_to_collision,
    time_headway,
    time_integrated_time_to_collision,
    time_to_collision,
)

__all__ = [
    "DEFAULT_STANDARD",
    "METRICS",
    "JsonValue",
    "Metric",
    "MetricFactory",
    "MetricsOfRun",
    "RunMetrics",
    "RunSummary",
    "SafetyStandard",
    "Sample",
    "TrafficRunMetrics",
    "deceleration_rate_to_avoid_crash",
    "metric_keys",
    "metric_topics",
    "modified_deceleration_rate_to_avoid_crash",
    "potential_collision_speed",
    "step_metrics",
    "stopping_sight_distance",
    "time_exposed_time_to_collision",
    "time_headway",
    "time_integrated_time_to_collision",
    "time_to_collision",
]
