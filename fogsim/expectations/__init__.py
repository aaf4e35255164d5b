"""Expectations of a run: what must hold in it, and what came."""

from fogsim.expectations.clauses import (
    Always,
    Clause,
    Eventually,
    Finding,
    FindingVerdict,
    Happened,
    MetricCheck,
    Whenever,
)
from fogsim.expectations.watching import ExpectationWatch

__all__ = [
    "Always",
    "Clause",
    "Eventually",
    "ExpectationWatch",
    "Finding",
    "FindingVerdict",
    "Happened",
    "MetricCheck",
    "Whenever",
]
