"""A forward-scatter visibility sensor on board: it measures the extinction by the light that a little air scatters."""

import math

import numpy as np


class Scatterometer:
    """Averages the extinction where it is, with an error of its calibration and noise (`averaging_time` [s]).

    Both are factors e^(σ x), as for the sensors next to the road. The noise is averaged as the fog is, so that its
    deviation is that of the values that come out, however often they are asked for. The volume that it looks at is some
    0.1 dm³ (of Vaisala's FD12P: de Haij, KNMI): it measures the fog at its place and nothing of the road ahead.
    """

    def __init__(self, relative_deviation: float, calibration_deviation: float, averaging_time: float) -> None:
        self._relative_deviation, self._calibration_deviation = relative_deviation, calibration_deviation
        self._averaging_time = averaging_time
        self.reset(np.random.default_rng(0))

    def reset(self, rng: np.random.Generator) -> None:
        """Begin a run."""
        self._rng = rng
        self._calibration = self._calibration_deviation * float(rng.standard_normal())
        self._average: tuple[float, float, float] | None = None

    def measure(self, extinction: float, time: float) -> float:
        """Extinction coefficient that it reports at a time [s], of the true one [1/m]."""
        noise = float(self._rng.standard_normal())
        if self._average is not None:
            before, average, averaged = self._average
            kept = math.exp((before - time) / self._averaging_time) if self._averaging_time > 0.0 else 0.0
            extinction = kept * average + (1.0 - kept) * extinction
            noise = kept * averaged + math.sqrt(1.0 - kept**2) * noise
        self._average = time, extinction, noise
        return extinction * math.exp(self._calibration + self._relative_deviation * noise)
