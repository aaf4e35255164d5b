"""Advice to sections of road: to each what its own visibility asks for, in steps down towards fog."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace

from fogsim.advice.presentation import harmonised_speeds
from fogsim.errors import InputError
from fogsim.simulation.chosen_methods import road_adviser
from fogsim.simulation.run_config import AdviceConfig
from fogsim.values import Belief, Display, SpeedAdvice, Step, Stretch, StretchAdvice, TrafficStep
from fogsim.values.belief import certain_belief
from fogsim.values.result_checks import checked_advice


class RoadAdvice:
    """What the sections of the ego's route are advised in one run; it remembers what each was advised last.

    Informed by the truth, each section goes by the visibility meter on it and the speed limit of its own road, and the
    ego hears what others hear there. Informed by sensors, each goes by the latest report of the nearest one, and a
    section without any report has no advice. Informed by the ego's belief, the ego goes by its own advice and
    passes it to the section on which it is; a section that it has left keeps the last one, and one that it has not
    reached knows nothing.
    """

    def __init__(self, config: AdviceConfig) -> None:
        sections = config.sections
        if sections is None:
            raise InputError("advice to sections of road needs sections, got None")
        self._adviser, self._config = road_adviser(config.adviser), config
        self._display, self._harmonisation = sections.display, sections.harmonisation
        self._read_before = sections.reading_distance
        self._advised: dict[Stretch, SpeedAdvice] = {}
        self._egos = SpeedAdvice()
        self._read: tuple[Stretch, float] | None = None

    def advise(self, step: Step) -> tuple[SpeedAdvice, tuple[StretchAdvice, ...]]:
        """Advice to the ego, and to all on the sections that have any."""
        if step.index == 0:
            self._advised, self._egos, self._read = {}, SpeedAdvice(), None
        sections = tuple(section.stretch for section in step.truth.sections)
        here = next((s for s in sections if s.start <= step.route_position < s.end), None)
        if self._config.informed_by == "belief":
            self._egos = self._ask(step, step.speed_limit, step.belief, self._egos)
            if here is not None:
                self._advised[here] = self._egos
        else:
            self._ask_meters(step)
        shown = self._shown(step)
        if self._config.informed_by != "belief":
            read = next((s for s in sections if s.start <= step.route_position + self._read_before < s.end), None)
            self._egos = SpeedAdvice(self._heard(read, dict(zip(sections, shown, strict=True))))
        return self._egos, self._advices(sections, shown)

    def advise_traffic(self, step: TrafficStep) -> tuple[StretchAdvice, ...]:
        """Advice to all on the sections that have any, by the meters, where there is no ego."""
        if step.index == 0:
            self._advised = {}
        self._ask_meters(step)
        sections = tuple(section.stretch for section in step.truth.sections)
        return self._advices(sections, self._shown(step))

    def _advices(self, sections: Sequence[Stretch], speeds: Sequence[float]) -> tuple[StretchAdvice, ...]:
        """What is heard where, which begins where a sign can be read."""
        heard = [
            replace(one, start=max(one.start - self._read_before, 0.0), end=one.end - self._read_before)
            for one in sections
        ]
        return stretch_advices(heard, speeds, self._display)

    def _ask_meters(self, step: TrafficStep) -> None:
        for section in step.truth.sections:
            previous = self._advised.get(section.stretch, SpeedAdvice())
            measured = section.reported if self._config.informed_by == "sensors" else section.extinction
            if measured is not None:
                known = certain_belief(measured)
                self._advised[section.stretch] = self._ask(step, section.speed_limit, known, previous)

    def _ask(self, step: TrafficStep, limit: float, known: Belief, previous: SpeedAdvice) -> SpeedAdvice:
        return checked_advice(self._config.adviser.name, self._adviser.advise(known, limit, step.time, previous))

    def _shown(self, step: TrafficStep) -> tuple[float, ...]:
        sections, steps = step.truth.sections, self._harmonisation
        speeds = tuple(self._advised.get(section.stretch, SpeedAdvice()).speed for section in sections)
        if steps is None:
            return speeds
        starts, limits = [s.stretch.start for s in sections], [s.speed_limit for s in sections]
        lengths = [*(following - start for start, following in itertools.pairwise(starts)), math.inf]
        return harmonised_speeds(speeds, lengths, limits, steps.largest_step, steps.deceleration)

    def _heard(self, here: Stretch | None, shown: dict[Stretch, float]) -> float:
        """What the ego has heard where it is [m/s]; a sign says in passing what holds to the end of its section."""
        if here is None:
            self._read = None
            return math.inf
        if self._display != Display.MESSAGE_SIGN:
            return shown[here]
        if self._read is None or self._read[0] != here:
            self._read = here, shown[here]
        return self._read[1]


def stretch_advices(
    sections: Sequence[Stretch], speeds: Sequence[float], display: Display
) -> tuple[StretchAdvice, ...]:
    """Advice to all on sections of road, as far as there is any (`speeds` [m/s])."""
    advices: list[StretchAdvice] = []
    for section, speed in zip(sections, speeds, strict=True):
        last = advices[-1] if advices else None
        if last and display != Display.MESSAGE_SIGN and (last.speed, last.stretch.end) == (speed, section.start):
            # Advice that is heard anywhere continues where the next section has the same.
            advices[-1] = StretchAdvice(speed, Stretch(last.stretch.start, section.end), display)
        elif speed < math.inf:
            advices.append(StretchAdvice(speed, section, display))
    return tuple(advices)
