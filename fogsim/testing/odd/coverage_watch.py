"""Measures the concepts of an ODD at each step of a run."""

import math
from collections.abc import Sequence
from typing import Any

from fogsim.conditions import SIGNALS, Finding, FindingVerdict, History, Moment
from fogsim.errors import FogSimError
from fogsim.testing.odd.odd_file import OddFile
from fogsim.testing.odd.openodd_library import Coverage, Measured, Sample
from fogsim.values import Step, TrafficStep

_METRES_PER_DEGREE = math.pi / 180.0 * 6_378_137.0
"""At the equator."""

_DIGITS = 6
"""Decimals of measured numbers, as the library writes them: 33.33 m/s is then not a neighbour of 120 km/h."""

_AT_ONCE = 256
"""Steps that are counted together, which takes a fifth less time than one by one."""


class CoverageWatch:
    """Collects the coverage of one run by measured values.

    What a signal cannot give (an invalid estimate) is missing; a signal that raises ends the run with an error.
    """

    def __init__(self, odd: OddFile) -> None:
        self._odd, self._coverage, self._history = odd, Coverage(odd), History()
        self._probes = [
            (name, SIGNALS[probe.signal.signal], probe.signal.arguments, probe.divisor)
            for name, probe in odd.probes.items()
        ]
        self._waiting: list[tuple[Sample, float]] = []

    def update(self, step: TrafficStep) -> None:
        """Measure the next step."""
        moment, position = self._history.moment(step), None
        if isinstance(step, Step):
            x, y, z = step.traffic.position[step.ego].tolist()
            position = (x, y, z)
        # Roads have no geographic reference: positions count from 0° N, 0° E.
        geolocation = None if position is None else (position[1] / _METRES_PER_DEGREE, position[0] / _METRES_PER_DEGREE)
        self._waiting.append((Sample(self._measured(moment), position, geolocation), step.time))
        if len(self._waiting) == _AT_ONCE:
            self._count()

    def _count(self) -> None:
        for sample, time in self._waiting:
            self._coverage.add(sample, time)
        self._waiting.clear()

    def _measured(self, moment: Moment) -> dict[str, Measured]:
        values: dict[str, Measured] = {}
        for name, signal, arguments, divisor in self._probes:
            try:
                value = signal.read(moment, arguments)
            except Exception as error:
                what = f"{type(error).__name__}: {error}"
                raise FogSimError(f"{self._odd.path}: probes.{name}.signal: {what}") from error
            if isinstance(value, float) and math.isfinite(value):
                value = round(value / divisor, _DIGITS)
            values[name] = value  # type: ignore[assignment]  # ODD files have numbers, words and flags only
        return values

    def document(self, scenario: str, findings: Sequence[Finding]) -> dict[str, Any]:
        """The run's coverage, with its outcome by what came of its expectations."""
        self._count()
        verdicts = {one.verdict for one in findings}
        failed = [one.time for one in findings if one.verdict is FindingVerdict.FAILED and one.time is not None]
        passed = None
        if FindingVerdict.FAILED in verdicts:
            passed = False
        elif verdicts == {FindingVerdict.PASSED}:
            passed = True
        return self._coverage.document(scenario, passed, min(failed, default=None))
