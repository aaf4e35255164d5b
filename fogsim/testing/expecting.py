"""What a case is watched by, and what comes of it."""

from fogsim.expectations import ExpectationWatch, Finding, FindingVerdict
from fogsim.scenario import Scenario
from fogsim.scenario.expect.schema import clauses_of

__all__ = ["Finding", "FindingVerdict", "watch_of"]


def watch_of(scenario: Scenario) -> ExpectationWatch:
    """What watches a run of a scenario.

    Parameters
    ----------
    scenario : Scenario
        With what it expects.
    """
    return ExpectationWatch(clauses_of(scenario.expect))
