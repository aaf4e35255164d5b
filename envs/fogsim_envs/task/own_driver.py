"""The ego's own driver: how fast one goes in fog where no one advises less."""

import dataclasses
import math

from fogsim.traffic import SPEED_CHOICES
from fogsim.traffic.drivers.speed_choice import speed_share
from fogsim.values import Command, SpeedAdvice, Step


class OwnDriver:
    """A driver who goes by the advice, or by an own choice of speed where that is lower."""

    def __init__(self, choice: str) -> None:
        self._choice = SPEED_CHOICES[choice]

    def follow(self, command: Command, step: Step) -> Command:
        """Command that the vehicle gets."""
        if command.control is not None:
            return command
        visibility = step.truth.visibility_ahead
        free = step.traffic.free_speed
        in_clear_air = float(free[step.ego]) if len(free) else step.speed_limit
        own = min(self._choice(visibility), speed_share(self._choice, visibility) * in_clear_air)
        if own >= min(command.advice.speed, in_clear_air) or not math.isfinite(own):
            return command
        return dataclasses.replace(command, advice=SpeedAdvice(own))
