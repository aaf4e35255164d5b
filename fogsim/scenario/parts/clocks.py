"""The clocks of a scenario as whole numbers."""

import dataclasses

from fogsim.scenario.schema import Scenario
from fogsim.units import clock_time


@dataclasses.dataclass(frozen=True, slots=True)
class Periods:
    """The clocks as whole numbers."""

    camera_period: float  # Time between frames [s]
    traffic_steps: int  # Traffic steps in one camera period
    decision_frames: int  # Camera periods in one decision period
    frames: int  # Most camera periods that a run may last

    def time(self, index: int) -> float:
        """Time of a camera period since the run began [s]."""
        return clock_time(index * self.camera_period)


def periods(scenario: Scenario) -> Periods:
    """Clocks of a scenario."""
    clocks = scenario.clocks
    return Periods(
        camera_period=clocks.camera_period_s,
        traffic_steps=round(clocks.camera_period_s / clocks.traffic_step_s),
        decision_frames=round(clocks.decision_period_s / clocks.camera_period_s),
        frames=max(1, round(scenario.duration_s / clocks.camera_period_s)),
    )
