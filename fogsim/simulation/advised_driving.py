"""A run's own policy: from what is believed of the fog to advice, lamps and warning."""

import dataclasses
import math
from collections.abc import Callable, Sequence

from fogsim.advice import Adviser, VehicleAdviser
from fogsim.advice.warning import choose_warning
from fogsim.lighting import LIGHTING_POLICIES, LightingPolicy, VehicleLightingPolicy
from fogsim.simulation.chosen_methods import adviser
from fogsim.simulation.road_advice import RoadAdvice, stretch_advices
from fogsim.simulation.run_config import AdviceConfig
from fogsim.values import Belief, Command, LampChoice, RoadSection, SpeedAdvice, Step
from fogsim.values.belief import certain_belief
from fogsim.values.result_checks import checked_advice, checked_lamp_choice, checked_lamps


class AdvisedDriving:
    """The run's own policy: adviser, lighting rules and the driver's warning, asked once in so many frames."""

    def __init__(self, advice: AdviceConfig, decision_frames: int) -> None:
        self._advice, self._frames, lighting = advice, decision_frames, advice.lighting
        self._ask_adviser = _questions_to(adviser(advice.adviser))
        self._ask_lighting = _lighting_questions(lighting.make(LIGHTING_POLICIES), lighting.name)
        self._road = RoadAdvice(advice) if advice.sections else None

    def periods_until_decision(self, index: int) -> int:
        """For how many camera periods the command stays in force after that of a number."""
        return self._frames - index % self._frames

    def decide(self, step: Step, previous: Command | None = None) -> Command:
        """Command for the next camera period; the one before between decisions."""
        previous = step.command if previous is None else previous
        if step.index % self._frames:
            return previous
        lit = _known_fog(step, self._advice.lighting_informed_by)
        chosen = self._ask_lighting(step, lit, LampChoice(previous.lamps, previous.lamp_wish))
        command = warned(Command(lamps=chosen.lamps, lamp_wish=chosen.wish), step, previous)
        if self._road is not None:
            advice, stretches = self._road.advise(step)
            return dataclasses.replace(command, advice=advice, stretches=stretches)
        known = _known_fog(step, self._advice.informed_by)
        advice = checked_advice(self._advice.adviser.name, self._ask_adviser(step, known, previous.advice))
        return spread_advice(dataclasses.replace(command, advice=advice), self._advice)


def warned(command: Command, step: Step, previous: Command) -> Command:
    """Add the warning of the ego's driver to a command, by what the vehicle itself knows; none without estimators."""
    if not step.estimates:
        return command
    warning, memory = choose_warning(step.belief, step.observation, step.time, previous)
    return dataclasses.replace(command, warning=warning, warning_memory=memory)


def _questions_to(adviser: Adviser | VehicleAdviser) -> Callable[[Step, Belief, SpeedAdvice], SpeedAdvice]:
    """A function that gets an adviser's next advice after a step, from what is known of the fog and the last advice."""
    if isinstance(adviser, VehicleAdviser):
        return lambda step, known, previous: adviser.advise_vehicle(
            known, step.observation, step.speed_limit, step.time, previous
        )
    return lambda step, known, previous: adviser.advise(known, step.speed_limit, step.time, previous)


def _lighting_questions(
    policy: LightingPolicy | VehicleLightingPolicy, name: str
) -> Callable[[Step, Belief, LampChoice], LampChoice]:
    """A function that asks a lighting policy in the same way."""
    if isinstance(policy, VehicleLightingPolicy):
        return lambda step, known, previous: checked_lamp_choice(
            name, policy.choose_lamps(known, step.observation, step.time, previous)
        )
    return lambda _, known, previous: LampChoice(checked_lamps(name, policy.lamps(known, previous.lamps)))


def _known_fog(step: Step, informed_by: str) -> Belief:
    """What a method goes by: what the ego believes, or the truth, as a visibility meter at the road has it."""
    return step.belief if informed_by == "belief" else certain_belief(step.truth.extinction_ahead)


def spread_advice(command: Command, config: AdviceConfig, sections: Sequence[RoadSection] = ()) -> Command:
    """Let others hear the ego's advice too, if they are to."""
    speed = command.advice.speed
    if not math.isfinite(speed):
        return command
    if config.sections is not None:
        stretches = [section.stretch for section in sections]
        advices = stretch_advices(stretches, [speed] * len(sections), config.sections.display)
        return dataclasses.replace(command, stretches=advices)
    if config.stretch is not None:
        return dataclasses.replace(command, stretches=(dataclasses.replace(config.stretch, speed=speed),))
    return dataclasses.replace(command, advice_reach=config.reach) if config.reach else command
