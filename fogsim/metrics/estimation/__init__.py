"""How right estimators and beliefs were: here and now, ahead, and in other equipped vehicles."""

from fogsim.metrics.estimation.belief_ahead import BeliefAheadError, DenseFogKnown
from fogsim.metrics.estimation.errors import FOG_LIMIT, BeliefError, EquippedBelief, Errors, EstimatorErrors

__all__ = [
    "FOG_LIMIT",
    "BeliefAheadError",
    "BeliefError",
    "DenseFogKnown",
    "EquippedBelief",
    "Errors",
    "EstimatorErrors",
]
