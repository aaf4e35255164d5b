"""Calibrations that another process makes while the page goes on answering."""

import multiprocessing
import os
import signal
from collections.abc import Callable
from dataclasses import dataclass, fields
from multiprocessing.pool import AsyncResult, Pool
from typing import Any, cast

from fogsim.core.registry import MethodConfig, Registry
from fogsim.estimators.protocol import Calibrations, TakesCalibrations
from fogsim.values import Estimate, Observation

CALIBRATING = "it is being calibrated for this camera and these lamps; its estimate follows"
"""Reason of an estimate that is not there yet."""

_MOST_KEPT = 20


class _NotReadyError(Exception):
    """A calibration is still being made."""


class Calibrator:
    """Makes the calibrations that methods ask for, one at a time, and keeps some."""

    def __init__(self) -> None:
        self._pool: Pool | None = None
        self._made: dict[tuple[Any, ...], AsyncResult[Any]] = {}
        self.awaited: set[str] = set()  # methods that had no estimate of a frame since this was cleared

    def without_waiting(self, method: MethodConfig) -> MethodConfig:
        """A method that has no estimate, for `CALIBRATING`, until its calibration is there."""
        return _Patient(**{one.name: getattr(method, one.name) for one in fields(method)}, calibrator=self)

    def take(self, make: Callable[..., Any], *arguments: Any) -> Any:
        """A calibration that was made; if it was not, begin it unless another one is being made."""
        key = make.__name__, *arguments
        made = self._made.get(key)
        if made is None and all(one.ready() for one in self._made.values()):
            if self._pool is None:
                # Ctrl-C is for this process: the other one inherits that it ignores it.
                before = signal.signal(signal.SIGINT, signal.SIG_IGN)
                try:
                    self._pool = multiprocessing.get_context("spawn").Pool(1, os.nice, (10,))
                finally:
                    signal.signal(signal.SIGINT, before)
            if len(self._made) == _MOST_KEPT:
                del self._made[next(iter(self._made))]
            made = self._made[key] = self._pool.apply_async(make, arguments)
        if made is None or not made.ready():
            raise _NotReadyError
        return made.get()

    def close(self) -> None:
        """End the other process; closing twice is allowed."""
        if self._pool is not None:
            self._pool.terminate()
        self._pool = None


@dataclass(frozen=True, slots=True)
class _Patient(MethodConfig):
    """A method whose calibrations come from a calibrator."""

    calibrator: Any = None

    def make(self, registry: Registry[Callable[..., Any]], *given: object) -> Any:
        made = MethodConfig.make(self, registry, *given)
        # Methods of users are guarded: what they raise is an error of theirs.
        is_own = type(made).__module__.startswith("fogsim.estimators.")
        return _PatientEstimator(made, self.calibrator) if is_own and isinstance(made, TakesCalibrations) else made


class _PatientEstimator:
    def __init__(self, own: Any, calibrator: Calibrator) -> None:
        self.method: str = own.method
        self.reset: Callable[[], None] = own.reset
        self._own, self._calibrator = own, calibrator

    def update(self, observation: Observation) -> Estimate:
        try:
            return cast("Estimate", self._own.update(observation))
        except _NotReadyError:
            self._calibrator.awaited.add(self.method)
            return Estimate.invalid(self.method, CALIBRATING)

    def take_calibrations(self, source: Calibrations) -> None:
        self._own.take_calibrations(_Asked(source, self._calibrator))


class _Asked:
    """A source whose calibrations are taken from a calibrator."""

    def __init__(self, source: Calibrations, calibrator: Calibrator) -> None:
        self._source, self._calibrator = source, calibrator

    def __getattr__(self, name: str) -> Callable[..., Any]:
        make = getattr(self._source, name)
        return lambda *arguments: self._calibrator.take(make, *arguments)
