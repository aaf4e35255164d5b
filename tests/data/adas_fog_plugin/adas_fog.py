"""A plug-in as a user would write one: an adviser that goes by its own speed and the gap to its lead vehicle."""

from dataclasses import dataclass
from typing import Annotated

from fogsim import Belief, Observation, SpeedAdvice
from fogsim.core.parameters import Range, checked_parameters


@checked_parameters
@dataclass(frozen=True)
class Cautious:
    """Advise what covers the visibility, or the gap if that is shorter, in a given time."""

    headway: Annotated[float, Range(0.5, 10.0, "s")] = 3.0

    def advise_vehicle(
        self,
        belief: Belief,
        observation: Observation,
        speed_limit: float,
        time: float,  # noqa: ARG002 - the protocol's parameters
        previous: SpeedAdvice,
    ) -> SpeedAdvice:
        """Advise a speed [m/s]."""
        reach = belief.known_visibility(0.25)
        if reach is None:  # The belief says too little to act on.
            return previous
        if observation.lead is not None:
            reach = min(reach, observation.lead.distance)
        return SpeedAdvice(min(speed_limit, reach / self.headway))
