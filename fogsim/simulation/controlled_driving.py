"""The ego driven by a controller: what it requests passes delay, lag and limits of the actuators."""

import dataclasses
import math
from collections import deque
from collections.abc import Callable
from typing import Protocol

from fogsim.advice import BeliefController, Controller
from fogsim.simulation.advised_driving import AdvisedDriving
from fogsim.simulation.chosen_methods import controller
from fogsim.simulation.run_config import ControllerConfig, RunConfig
from fogsim.values import Command, Control, EgoControl, Step
from fogsim.values.result_checks import checked_control

_SPEED_TIME = 1.0
"""Time constant with which a requested speed is reached [s]."""

_SPEED_BRAKING, _SPEED_ACCELERATING = 3.5, 2.0
"""Limits on the way to a requested speed, those of adaptive cruise control (ISO 15622:2018) [m/s²]."""


class Policy(Protocol):
    """Decides after each step."""

    def decide(self, step: Step) -> Command:
        """Command for the next camera period."""

    def periods_until_decision(self, index: int) -> int:
        """For how many camera periods a command after that of a number stays in force."""


def own_policy(config: RunConfig) -> Policy:
    """A run's own policy: advice and lamps, and the controller if there is one."""
    advised = AdvisedDriving(config.advice, config.periods.decision_frames)
    if config.controller is None:
        return advised
    return ControlledDriving(advised, config.controller, config.periods.camera_period)


class ControlledDriving:
    """Asks a controller by its own clock and acts each camera period [s]; it gets what the vehicle knows, no truth."""

    def __init__(self, advised: AdvisedDriving, config: ControllerConfig, period: float) -> None:
        self._advised, self._config, self._period = advised, config, period
        self._ask = _questions_to(controller(config.method))
        self._advice: Command | None = None
        self._request = Control()
        whole, self._late_share = divmod(round(config.delay / period, 9), 1.0)
        self._delayed: deque[float | None] = deque([None] * (int(whole) + 1))
        self._acceleration = 0.0
        self._has_intervened = False

    def periods_until_decision(self, index: int) -> int:  # noqa: ARG002 - the protocol's
        """One: actuators move in each."""
        return 1

    def decide(self, step: Step) -> Command:
        """Command for the next camera period."""
        self._advice = self._advised.decide(step, self._advice)
        if step.index % self._config.frames == 0:
            self._request = checked_control(self._config.method.name, self._ask(step))
        request = self._request
        acceleration = self._actuated(_wanted_acceleration(request, step.observation.speed))
        return dataclasses.replace(
            self._advice,
            lamps=self._advice.lamps if request.lamps is None else request.lamps,
            warning=self._advice.warning if request.warning is None else request.warning,
            control=None
            if acceleration is None
            else EgoControl(acceleration, brakes_with_driver=self._config.driver == "human"),
        )

    def _actuated(self, wanted: float | None) -> float | None:
        """Acceleration of the next period [m/s²]; None while a human drives."""
        config = self._config
        self._delayed.append(wanted)
        earlier, now = self._delayed.popleft(), self._delayed[0]
        if self._late_share and (earlier, now) != (None, None):
            # Within the period the later request takes the place of the earlier one: their mean over time.
            now = self._late_share * (earlier or 0.0) + (1.0 - self._late_share) * (now or 0.0)
        self._has_intervened |= now is not None
        if now is None and (config.driver == "human" or (config.driver != "none" and not self._has_intervened)):
            self._acceleration = 0.0
            return None
        target = min(max(now or 0.0, -config.braking), config.accelerating)
        share = 1.0 - math.exp(-self._period / config.lag) if config.lag else 1.0
        self._acceleration += share * (target - self._acceleration)
        return self._acceleration


def _questions_to(asked: Controller | BeliefController) -> Callable[[Step], object]:
    if isinstance(asked, BeliefController):
        return lambda step: asked.control_by_belief(step.observation, step.belief)
    return lambda step: asked.control(step.observation)


def _wanted_acceleration(request: Control, speed: float) -> float | None:
    if request.speed is None:
        return request.acceleration
    return min(max((request.speed - speed) / _SPEED_TIME, -_SPEED_BRAKING), _SPEED_ACCELERATING)
