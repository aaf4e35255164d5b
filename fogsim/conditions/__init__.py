"""Conditions on a run, a small language over its steps, and expectations: clauses that these conditions must meet."""

from fogsim.conditions.clauses import (
    Always,
    Clause,
    Eventually,
    Finding,
    FindingVerdict,
    Happened,
    MetricCheck,
    Whenever,
)
from fogsim.conditions.expectation_watch import ExpectationWatch
from fogsim.conditions.moment import EGO, History, Moment
from fogsim.conditions.parsing import mended, parse_condition, parse_signal
from fogsim.conditions.possibility import (
    Limits,
    RunContent,
    condition_mistakes,
    lights_of,
    outcomes,
    pointless_parts,
    vehicles_in,
)
from fogsim.conditions.signal import Kind, Need, Place, Signal
from fogsim.conditions.signals import SIGNALS
from fogsim.conditions.syntax import Comparison, Condition, Edge, Quantity, Reference, signals_of
from fogsim.conditions.watching import Watch

__all__ = [
    "EGO",
    "SIGNALS",
    "Always",
    "Clause",
    "Comparison",
    "Condition",
    "Edge",
    "Eventually",
    "ExpectationWatch",
    "Finding",
    "FindingVerdict",
    "Happened",
    "History",
    "Kind",
    "Limits",
    "MetricCheck",
    "Moment",
    "Need",
    "Place",
    "Quantity",
    "Reference",
    "RunContent",
    "Signal",
    "Watch",
    "Whenever",
    "condition_mistakes",
    "lights_of",
    "mended",
    "outcomes",
    "parse_condition",
    "parse_signal",
    "pointless_parts",
    "signals_of",
    "vehicles_in",
]
