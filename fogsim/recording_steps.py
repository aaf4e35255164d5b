"""Recorders of one run, which take its steps; what they have written stays readable however it ends."""

import contextlib
import dataclasses
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from typing import Generic, TypeVar

from fogsim.errors import RecorderError
from fogsim.interruption import Interruption
from fogsim.metrics import MetricsOfRun
from fogsim.recorders import Manifest, RunDirectory, Status, StepRecorder
from fogsim.values import TrafficStep

AnyStep = TypeVar("AnyStep", bound=TrafficStep)


class Recording(Generic[AnyStep]):
    """Recorders of one run, from its first step to the time when their files take their places.

    Parameters
    ----------
    directory : RunDirectory
        Where the files go.
    manifest : Manifest
        What is known before the first step.
    recorders : mapping from str to StepRecorder
        Recorders by name.
    metrics : MetricsOfRun
        Metrics of the steps.

    Attributes
    ----------
    failures : dict from str to str
        Recorders that failed, and why.
    files : list of str
        Names of the files of the closed recording.
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
        """Hand a step to metrics and recorders.

        Parameters
        ----------
        step : TrafficStep
            The finished step.

        Raises
        ------
        RecorderError
            If one fails.
        """
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
        """Begin without a step, unless earlier results are there."""
        if not (self._begun or self._directory.earlier or self._directory.unfinished.exists()):
            self._begin()

    def close(self, manifest: Manifest, interruption: Interruption) -> Status:
        """Close all recorders, also when some fail, and write metrics and manifest; nothing if it was never begun.

        Parameters
        ----------
        manifest : Manifest
            How the run ended.
        interruption : Interruption
            What holds signals back; they are let through while a whole run's recorders are closed.

        Returns
        -------
        Status
            How it ended now.
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
        """Note why a recorder failed, where the reason is not known already."""
        try:
            yield
        except Exception as error:  # noqa: BLE001 - a recorder may be anybody's, and must not cost the others their files
            self.failures.setdefault(name, f"{type(error).__name__}: {error}")
