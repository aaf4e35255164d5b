"""The clocks of a scenario as whole numbers."""

from fogsim.scenario.schema import ScenarioFile
from fogsim.simulation.run_config import Periods


def periods(scenario: ScenarioFile) -> Periods:
    """Clocks of a scenario."""
    clocks = scenario.clocks
    return Periods(
        camera_period=clocks.camera_period_s,
        traffic_steps=round(clocks.camera_period_s / clocks.traffic_step_s),
        decision_frames=round(clocks.decision_period_s / clocks.camera_period_s),
        frames=max(1, round(scenario.duration_s / clocks.camera_period_s)),
    )
