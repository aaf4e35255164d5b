"""What a scenario says of the roads' asphalt."""

from fogsim.scenario.schema import Scenario
from fogsim.values import Pavement


def pavement(scenario: Scenario) -> Pavement:
    """What roads are like."""
    given = scenario.pavement
    return Pavement(given.surface, given.wheel_tracks, given.repairs)
