"""A run whose results are written down, and stay readable if it is interrupted."""

import contextlib
import dataclasses
from collections.abc import Callable, Iterable, Sequence
from datetime import UTC, datetime
from pathlib import Path

from fogsim.errors import InputError
from fogsim.interruption import interruptible
from fogsim.loop import run
from fogsim.metrics import RunMetrics, RunSummary, step_metrics
from fogsim.recorders import (
    RECORDERS,
    Manifest,
    Recorder,
    RunDirectory,
    RunInformation,
    Status,
    write_json,
    write_manifest,
    write_sign_map,
)
from fogsim.scenario import Scenario, build, resolved
from fogsim.traffic.configuration import configured_files
from fogsim.traffic.network import read_net
from fogsim.traffic.signs import geographic_position, sign_map
from fogsim.values import Ending, SignMap, Step


@dataclasses.dataclass(frozen=True, slots=True)
class RecordedRun:
    """What came of a recorded run.

    Attributes
    ----------
    status : Status
        Complete or interrupted.
    ending : Ending or None
        Why the simulated run was over, None if it was interrupted.
    summary : RunSummary
        Its metrics.
    directory : Path
        Where the results are.
    files : tuple of str
        Their names.
    """

    status: Status
    ending: Ending | None
    summary: RunSummary
    directory: Path
    files: tuple[str, ...]


def record_run(
    scenario: Scenario,
    seed: int,
    out: Path,
    *,
    overwrite: bool = False,
    recorders: Iterable[str] = RECORDERS,
    command_line: Sequence[str] = (),
    watch: Callable[[Step], None] = lambda _: None,
) -> RecordedRun:
    """Run a scenario and write its results.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    seed : int
        Its seed.
    out : Path
        Directory for the results.
    overwrite : bool
        True to replace results that are there.
    recorders : iterable of str
        Which of `RECORDERS` write.
    command_line : sequence of str
        How it was started, for the manifest.
    watch : callable
        Called with each finished step, for a progress bar.

    Returns
    -------
    RecordedRun
        Interrupted (KeyboardInterrupt, as from Ctrl-C) or complete; in both cases every file is readable and says
        which it is.

    Raises
    ------
    InputError
        If the directory holds results already and must not be overwritten.
    FogSimError
        If a part of the loop cannot start, which leaves nothing behind, or fails on the way; the manifest then says so.
    """
    directory = RunDirectory(out, overwrite)
    metrics = RunMetrics()
    manifest = Manifest(Status.RUNNING, seed, resolved(scenario), datetime.now(UTC), command_line=command_line)
    write_manifest(directory.manifest, manifest)
    try:
        opened = _open(recorders, scenario, seed, directory, metrics)
    except Exception:
        directory.discard()
        raise
    status, ending, message, begun = Status.FAILED, None, "", False
    try:
        with interruptible():
            for step in run(scenario, seed):
                begun = True
                metrics.update(step)
                derived = step_metrics(step)
                for recorder in opened:
                    recorder.record(step, derived)
                watch(step)
                ending = step.ending
        status = Status.COMPLETE
    except KeyboardInterrupt:
        status = Status.INTERRUPTED
    except Exception as error:
        message = f"{type(error).__name__}: {error}"
        raise
    finally:
        # The stack runs every step from the last to the first, also when one of them fails.
        with contextlib.ExitStack() as finishing:
            if status is Status.FAILED and not begun:
                finishing.callback(directory.discard)
            ended = dataclasses.replace(manifest, status=status, ending=ending, message=message)
            finishing.callback(_write_ended, directory, ended)
            complete = status is Status.COMPLETE
            finishing.callback(write_json, directory.metrics, {"complete": complete, **metrics.summary().to_json()})
            for recorder in opened:
                finishing.callback(recorder.close, complete)
    return RecordedRun(status, ending, metrics.summary(), directory.path, tuple(directory.files()))


def _write_ended(directory: RunDirectory, manifest: Manifest) -> None:
    write_manifest(directory.manifest, dataclasses.replace(manifest, ended=datetime.now(UTC), files=directory.files()))


def _open(
    recorders: Iterable[str], scenario: Scenario, seed: int, directory: RunDirectory, metrics: RunMetrics
) -> list[Recorder]:
    information = RunInformation(
        directory=directory,
        title=scenario.name,
        description=scenario.description,
        seed=seed,
        methods=tuple(e.method for e in scenario.estimators),
        frame_period=scenario.clocks.camera_period_s,
        summary=lambda: metrics.summary().values,
        meanings=metrics.summary().meanings,
    )
    return [RECORDERS[name](information) for name in recorders]


def record_signs(scenario: Scenario, out: Path) -> SignMap:
    """Write the sign map of a scenario as GeoJSON; no simulation is started.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    out : Path
        The file.

    Raises
    ------
    InputError
        If the network, or a sign of the additional files, cannot be read.
    """
    setup = build.traffic_setup(scenario)
    net_file, additional = setup.net, setup.additional
    if net_file is None and setup.config is not None:
        net_file, additional = configured_files(setup.config)
    if net_file is None:
        raise InputError(f"{scenario.name}: the scenario names neither a SUMO network nor a SUMO configuration")
    net = read_net(net_file)
    signs = sign_map(net, additional)
    out.parent.mkdir(parents=True, exist_ok=True)
    write_sign_map(out, signs, scenario.name, geographic_position(net))
    return signs
