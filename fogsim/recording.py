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
    """Run a scenario and write its results into a directory.

    Of these files each is whole under its name; docs/results.md tells what is in them:

    - ``manifest.json``, always: status, ending, seed, resolved scenario, versions, command line, times [UTC]. It is
      written before the first step (status "running") and again at the end.
    - ``metrics.json``, always, at the end: `RunSummary`'s keys, which end in their units, and ``complete``.
    - ``steps.parquet``, by the recorder ``table``: a row for each step, columns in SI units and radians.
    - ``video.mp4``, by ``video``: a frame of 1024×480 px (H.264) for each step, at real speed.
    - ``report.html``, by ``report``: metrics, figures and pictures in one file.

    Parameters
    ----------
    scenario : Scenario
        From `load_scenario`; the step is its camera period [s], the run ends at its duration [s] or earlier.
    seed : int
        At least 0; the same scenario and seed give the same steps, bit for bit.
    out : Path
        Directory for the results; it is made with its parents where it is not there.
    overwrite : bool
        True to remove the results that are there, before anything is started; files that are not FogSim's stay.
    recorders : iterable of str
        Which of `RECORDERS` write, each at most once; all by default.
    command_line : sequence of str
        Program and arguments of the command that started it, for the manifest; empty if none did.
    watch : callable
        Called with each finished `Step` after all recorders have taken it, for a progress bar. What it raises ends the
        run as any other error does, KeyboardInterrupt as Ctrl-C.

    Returns
    -------
    RecordedRun
        Complete, or interrupted by KeyboardInterrupt (Ctrl-C), which is not raised again; in both cases every file is
        readable and says which it is.

    Raises
    ------
    InputError
        If `out` is a file, cannot be made, or holds results and must not be overwritten.
    UnknownNameError
        If there is no such recorder.
    MissingDependencyError
        If a video is to be written and there is no ffmpeg.
    FogSimError
        If a part of the loop cannot start or fails on the way.
    ValueError, TypeError
        If the seed is negative or no integer.

    Notes
    -----
    Any error is raised again. One before the first step leaves none of the files and none of the directories that were
    made for them; one after it leaves what was recorded until then, and a manifest of status "failed" with the error's
    message.
    """
    directory = RunDirectory(out, overwrite)
    metrics = RunMetrics(build.safety_standard(scenario))
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
                derived = step_metrics(step, metrics.standard)
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
