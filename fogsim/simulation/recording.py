"""A run with recorded results, which stay readable if it is interrupted."""

import contextlib
import dataclasses
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from fogsim.core.files.output_targets import refuse_unwritable
from fogsim.core.interruption import Interruption
from fogsim.core.parameters import checked_parameters
from fogsim.core.randomness import Seed
from fogsim.core.registry import Registry
from fogsim.errors import InputError, MethodError, RecorderError
from fogsim.metrics import MetricsOfRun, RunMetrics, RunSummary, TrafficRunMetrics, metric_topics
from fogsim.metrics.road_speeds import RoadSpeeds
from fogsim.recorders import (
    RECORDERS,
    TRAFFIC_RECORDERS,
    USUAL_RECORDERS,
    USUAL_TRAFFIC_RECORDERS,
    Manifest,
    RunDirectory,
    RunInformation,
    Status,
    StepRecorder,
    write_sign_map,
)
from fogsim.simulation.loop import Processes, run, warn_of_unplayed
from fogsim.simulation.run_config import RunConfig, RunRecord, ScenarioLike
from fogsim.simulation.traffic_run import run_traffic
from fogsim.traffic.road.configuration import configured_files
from fogsim.traffic.road.network import read_net
from fogsim.traffic.road.signs import geographic_position, sign_map
from fogsim.values import NOTHING_UNPLAYED, Ending, SignMap, Step, TrafficStep, Unplayed
from fogsim.values.result_checks import checked_recorder

AnyStep = TypeVar("AnyStep", bound=TrafficStep)


class _Recording(Generic[AnyStep]):
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


@dataclasses.dataclass(frozen=True, slots=True)
class RecordedRun:
    """Result of a recorded run.

    `ending` is None and `unplayed` empty if it was interrupted; `files` are names in the directory, and none if it was
    interrupted before its first step and earlier results are there.
    """

    status: Status
    ending: Ending | None
    summary: RunSummary
    directory: Path
    files: tuple[str, ...]
    unplayed: Unplayed = NOTHING_UNPLAYED


@checked_parameters
def record_run(
    scenario: ScenarioLike,
    seed: Seed,
    out: str | Path,
    *,
    overwrite: bool = False,
    recorders: Iterable[str] = USUAL_RECORDERS,
    command_line: Sequence[str] = (),
    watch: Callable[[Step], None] = lambda _: None,
    camera_processes: Processes = 0,
) -> RecordedRun:
    """Run a scenario and write its results into a directory.

    Files are written into its folder ``unfinished`` from the first step on, and replace earlier results at once when
    the run is over; docs/reference/results.md describes them. `recorders` names members of `RECORDERS`, and `watch` is
    called with each finished `Step` after them. KeyboardInterrupt gives an interrupted run and is not raised again; its
    files are readable.

    Other errors are raised again. Before the first step they leave the directory as it was; later they leave what was
    recorded and a manifest of status "failed" with the message. An error of a user's method leaves that manifest in
    either case, if there are no earlier results.
    """
    config = scenario.run_config()

    def of_ego() -> _Recorded[Step]:
        return _Recorded(
            lambda folder: run(config, seed, sumo_outputs=folder, camera_processes=camera_processes),
            RunMetrics(),
            RECORDERS,
            watch,
        )

    return _record(of_ego, config, scenario.run_record, int(seed), Path(out), overwrite, recorders, command_line)


@checked_parameters
def record_traffic(
    scenario: ScenarioLike,
    seed: Seed,
    out: str | Path,
    *,
    overwrite: bool = False,
    recorders: Iterable[str] = USUAL_TRAFFIC_RECORDERS,
    command_line: Sequence[str] = (),
    watch: Callable[[TrafficStep], None] = lambda _: None,
) -> RecordedRun:
    """Run a scenario without an ego and write its results into a directory, as `record_run` does.

    There is no video; table and report cover all vehicles.
    """
    config = scenario.run_config()

    def alone() -> _Recorded[TrafficStep]:
        road = RoadSpeeds()
        return _Recorded(
            lambda folder: run_traffic(config, seed, folder),
            TrafficRunMetrics(watchers=[road]),
            TRAFFIC_RECORDERS,
            watch,
            road,
        )

    return _record(alone, config, scenario.run_record, int(seed), Path(out), overwrite, recorders, command_line)


@dataclasses.dataclass(frozen=True, slots=True)
class _Recorded(Generic[AnyStep]):
    """How a run is recorded; `steps` starts it, given the folder of SUMO's outputs."""

    steps: Callable[[Path], Generator[AnyStep, None, None]]
    metrics: MetricsOfRun[AnyStep]
    recorders: Registry[Callable[[RunInformation], StepRecorder[AnyStep]]]
    watch: Callable[[AnyStep], None]
    road: RoadSpeeds | None = None

    def along_road(self) -> NDArray[np.float64]:
        """Means along the road, as in `RunInformation`."""
        # The summary makes the metrics hand over the last steps.
        self.metrics.summary()
        return np.zeros((0, 4)) if self.road is None else self.road.means()


def _record(
    make: Callable[[], _Recorded[AnyStep]],
    config: RunConfig,
    about: Callable[[], RunRecord],
    seed: int,
    out: Path,
    overwrite: bool,
    recorders: Iterable[str],
    command_line: Sequence[str],
) -> RecordedRun:
    with Interruption() as interruption, RunDirectory(out, overwrite) as directory:
        record = about()
        manifest = Manifest(
            Status.RUNNING,
            seed,
            record.resolved,
            datetime.now(UTC),
            command_line=command_line,
            own_methods=record.own_methods,
        )
        try:
            what = make()
        except MethodError as error:
            _note_failure(directory, manifest, error)
            raise
        information = _information(what, config, record, seed, directory)
        opened = {name: checked_recorder(name, what.recorders[name](information)) for name in recorders}
        recording = _Recording(directory, manifest, opened, what.metrics)
        status, last, message = Status.FAILED, None, ""
        try:
            directory.clear_sumo_outputs()
            with contextlib.closing(what.steps(directory.sumo_outputs)) as steps, interruption.allowed():
                for step in steps:
                    recording.record(step)
                    what.watch(step)
                    last = step
                    if step.ending is not None:
                        # With warnings as errors, a warning of the loop must not lose a finished run.
                        break
            status = Status.COMPLETE
        except KeyboardInterrupt:
            status = Status.INTERRUPTED
            recording.begin_if_nothing_is_lost()
        except RecorderError:
            raise
        except Exception as error:
            message = f"{type(error).__name__}: {error}"
            if isinstance(error, MethodError):
                recording.begin_if_nothing_is_lost()
            raise
        finally:
            ending, unplayed = (None, NOTHING_UNPLAYED) if last is None else (last.ending, last.unplayed)
            ended = dataclasses.replace(manifest, status=status, ending=ending, message=message, unplayed=unplayed)
            status = recording.close(ended, interruption)
    if recording.failures and not message:
        raise RecorderError(recording.failures, directory.path)
    if last is not None and status is Status.COMPLETE:
        warn_of_unplayed(config.name, last)
    return RecordedRun(status, ending, what.metrics.summary(), directory.path, tuple(recording.files), unplayed)


def _note_failure(directory: RunDirectory, manifest: Manifest, error: MethodError) -> None:
    """Leave a manifest of a run that failed before it began, unless earlier results exist."""
    if not (directory.earlier or directory.unfinished.exists()):
        directory.begin(manifest.to_json())
        ended = dataclasses.replace(
            manifest, status=Status.FAILED, message=f"MethodError: {error}", ended=datetime.now(UTC)
        )
        directory.finish(ended.to_json())


def _information(
    what: _Recorded[AnyStep], config: RunConfig, record: RunRecord, seed: int, directory: RunDirectory
) -> RunInformation:
    return RunInformation(
        directory=directory,
        title=config.name,
        description=config.description,
        seed=seed,
        methods=tuple(one.name for one in config.estimators),
        frame_period=config.periods.camera_period,
        summary=lambda: what.metrics.summary().values,
        meanings=what.metrics.summary().meanings,
        along_road=what.along_road,
        topics=metric_topics(),
        settings=record.settings,
    )


@checked_parameters
def record_signs(scenario: ScenarioLike, out: str | Path, *, overwrite: bool = False) -> SignMap:
    """Write the sign map of a scenario as GeoJSON, without starting a simulation."""
    out = Path(out)
    config = scenario.run_config()
    setup = config.traffic
    net_file, additional = setup.net, setup.additional
    if net_file is None and setup.config is not None:
        net_file, additional = configured_files(setup.config)
    read = [one for one in (setup.config, net_file, *additional) if one is not None]
    refuse_unwritable(out, "--out", overwrite=overwrite, read=read, makes_folder=True)
    if net_file is None:
        raise InputError(f"{config.name}: the scenario names neither a SUMO network nor a SUMO configuration")
    net = read_net(net_file)
    signs = sign_map(net, additional)
    out.parent.mkdir(parents=True, exist_ok=True)
    write_sign_map(out, signs, config.name, geographic_position(net))
    return signs
