"""Recorders of one run, which receive its steps; their files stay readable however it ends."""

import contextlib
import dataclasses
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from typing import Generic, TypeVar

from fogsim.core.interruption import Interruption
from fogsim.errors import RecorderError
from fogsim.metrics import MetricsOfRun
from fogsim.recorders import Manifest, RunDirectory, Status, StepRecorder
from fogsim.values import TrafficStep

AnyStep = TypeVar("AnyStep", bound=TrafficStep)


class Recording(Generic[AnyStep]):
    """Recorders of one run, from its first step until their files are in place.

    `failures` maps failed recorders to their errors; `files` are the names of the closed recording's files.
    """

    def __init__(
        self,
        directory: RunDirectory,
        manifest: Manifest,
        recorders: Mapping[str, StepRecorder[AnyStep]],
        metrics: MetricsOfRun[AnyStep],
    ) -> None:
        self._directory = directory
        self._manifest = manifest
        self._recorders = recorders
        self._metrics = metrics
        self._begun = False
        self.failures: dict[str, str] = {}
        self.files: list[str] = []

    def record(self, step: AnyStep) -> None:
        """Pass a finished step to metrics and recorders; RecorderError if one fails."""
        if not self._begun:
            self._begin()
        self._metrics.update(step)
        derived = self._metrics.derive(step)
        for name, recorder in self._recorders.items():
            try:
                recorder.record(step, derived)
            except Exception as error:
                self.failures[name] = f"{type(error).__name__}: {error}"
                raise RecorderError(self.failures, self._directory.path) from error

    def _begin(self) -> None:
        self._directory.begin(self._manifest.to_json())
        self._begun = True

    def begin_if_nothing_is_lost(self) -> None:
        """Begin without a step, unless earlier results exist."""
        if not (self._begun or self._directory.earlier or self._directory.unfinished.exists()):
            self._begin()

    def close(self, manifest: Manifest, interruption: Interruption) -> Status:
        """Close all recorders, even if some fail, and write metrics and manifest; nothing if it never began.

        Signals are let through while a complete run's recorders are closed. Returns the final status.
        """
        if not self._begun:
            self._directory.clear_sumo_outputs()
            return manifest.status
        status = manifest.status
        for name, recorder in reversed(list(self._recorders.items())):
            status = self._close(name, recorder, status, interruption)
        complete = status is Status.COMPLETE
        with self._noting_failure("metrics"):
            self._directory.write_metrics({"complete": complete, **self._metrics.summary().to_json()})
        if self.failures and complete:
            status = Status.FAILED
        message = manifest.message or "; ".join(f"{name}: {reason}" for name, reason in self.failures.items())
        ended = dataclasses.replace(
            manifest, status=status, message=message, failed_recorders=self.failures, ended=datetime.now(UTC)
        )
        self._directory.finish(ended.to_json())
        self.files = self._directory.files()
        return status

    def _close(self, name: str, recorder: StepRecorder[AnyStep], status: Status, interruption: Interruption) -> Status:
        with self._noting_failure(name):
            if status is Status.COMPLETE:
                try:
                    with interruption.allowed():
                        recorder.close(complete=True)
                        return status
                except KeyboardInterrupt:
                    status = Status.INTERRUPTED
            recorder.close(complete=False)
        return status

    @contextlib.contextmanager
    def _noting_failure(self, name: str) -> Iterator[None]:
        """Record why a recorder failed, unless the reason is already known."""
        try:
            yield
        except Exception as error:  # noqa: BLE001 - a recorder may be anybody's, and must not cost the others their files
            self.failures.setdefault(name, f"{type(error).__name__}: {error}")
