"""Artefacts of failed cases: a video around the failure, and a plot of the signals."""

import hashlib
import itertools
import math
import re
import shutil
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fogsim.conditions import (
    SIGNALS,
    Always,
    Comparison,
    Condition,
    Edge,
    Eventually,
    Finding,
    History,
    Quantity,
    Reference,
    Whenever,
    signals_of,
)
from fogsim.conditions.signal import LanePlace, Value
from fogsim.conditions.syntax import comparisons_of
from fogsim.core.files.atomic import write_text
from fogsim.metrics import step_metrics
from fogsim.recorders import VideoRecorder
from fogsim.scenario import Scenario
from fogsim.scenario.expect.schema import clauses_of
from fogsim.simulation.loop import run
from fogsim.simulation.run_config import NO_RENDERER
from fogsim.simulation.traffic_run import run_traffic
from fogsim.study.drawing import INK, MUTED, WIDTH, dress, svg_of
from fogsim.study.execution import outcome_of
from fogsim.study.plan import StudyRun
from fogsim.study.pool import ProcessPool
from fogsim.testing.collection import FogTest, label_of
from fogsim.testing.judgement import Outcome
from fogsim.testing.session import FileOutcome
from fogsim.units.quantities import parse_quantity
from fogsim.values import Step, TrafficStep

_MOST_PANELS = 6
"""Maximum number of signals in a figure."""

_ALARM, _LIMIT = "#cf3a34", "#9a6700"
_PANEL_HEIGHT = 1.25


class _SignalLog:
    """Signals of some conditions, step by step."""

    def __init__(self, conditions: Iterable[Condition]) -> None:
        asked = list(dict.fromkeys(conditions))
        self.limits = list(dict.fromkeys(limit for one in asked for limit in _limits(one)))
        signals = dict.fromkeys(signal for one in asked for signal in signals_of(one))
        self.values: dict[Reference, list[Value]] = {signal: [] for signal in signals}
        self.times: list[float] = []
        self._history = History()

    def update(self, step: TrafficStep) -> None:
        """Record the signals at the next step."""
        moment = self._history.moment(step)
        self.times.append(step.time)
        for signal, values in self.values.items():
            values.append(SIGNALS[signal.signal].read(moment, signal.arguments))


def _limits(condition: Condition) -> list[tuple[Reference, Quantity]]:
    return [
        (one.left, one.right)
        for one in comparisons_of(condition)
        if isinstance(one, Comparison | Edge) and isinstance(one.right, Quantity)
    ]


def _plot_signals(log: _SignalLog, title: str, failures: Sequence[float]) -> str:
    """Draw signals over time as SVG, with marks where something failed [s]."""
    shown = list(log.values)[:_MOST_PANELS]
    figure = Figure(figsize=(WIDTH, 0.7 + _PANEL_HEIGHT * len(shown)), layout="constrained")
    panels = figure.subplots(len(shown), 1, squeeze=False, sharex=True)[:, 0]
    for axes, signal in zip(panels, shown, strict=True):
        dress(axes)
        _draw(axes, signal, log)
        for instant in failures:
            axes.axvline(instant, color=_ALARM, linewidth=1.2, linestyle=(0, (4, 2)))
    panels[0].set_title(title, fontsize=8.5, loc="left", color=INK)
    panels[-1].set_xlabel("time [s]", fontsize=8.5, color=INK)
    return svg_of(figure, title)


def _draw(axes: Axes, signal: Reference, log: _SignalLog) -> None:
    unit, values = SIGNALS[signal.signal].stated_in, log.values[signal]
    texts = sorted({text for text in map(_text, values) if text is not None})
    if texts:
        # Words have no order: each gets a line.
        heights = [math.nan if (text := _text(value)) is None else float(texts.index(text)) for value in values]
        axes.set_yticks(range(len(texts)), texts)
        axes.set_ylim(-0.5, len(texts) - 0.5)
    else:
        size = parse_quantity(f"1 {unit}", SIGNALS[signal.signal].unit) if unit else 1.0
        heights = [_number(value) / size for value in values]
        for limit in (right for left, right in log.limits if left == signal):
            axes.axhline(limit.value / size, color=_LIMIT, linewidth=1.0, linestyle=(0, (1.5, 1.5)))
            axes.annotate(str(limit), (1.0, limit.value / size), xycoords=("axes fraction", "data"), fontsize=7)
    axes.plot(log.times, np.array(heights), color=INK, linewidth=1.4, drawstyle="steps-post" if texts else "default")
    axes.set_ylabel(f"{signal}\n[{unit}]" if unit else str(signal), fontsize=7.5, color=MUTED)


def _text(value: Value) -> str | None:
    """Word of a value that is not a number; None for a number or an unknown value."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, frozenset):
        return " ".join(sorted(value)) or "none"
    return value if isinstance(value, str) else None


def _number(value: Value) -> float:
    """Number to draw; NaN, a gap, if it is unknown or infinite."""
    if isinstance(value, LanePlace):
        return float(value.number)
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else math.nan


BEFORE, AFTER = 6.0, 2.0
"""Time of a video before a failure, and after it [s]."""

_VIDEO = "video.mp4"

FOLDER = "failures"
"""Folder in the directory of the tests."""


@dataclass(frozen=True, slots=True)
class Artefacts:
    """Files about a failure: an SVG plot of the signals, and a video around it."""

    plot: Path | None = None
    video: Path | None = None

    @property
    def files(self) -> list[Path]:
        """The existing files."""
        return [one for one in (self.plot, self.video) if one is not None]


Kept = Mapping[tuple[str, str, str], Artefacts]
"""Artefacts by key of the run, name and clause."""


def keep_artefacts(
    outcomes: Sequence[FileOutcome], out: Path, processes: int, watch: Callable[[int, int], None] = lambda _, __: None
) -> Kept:
    """Run each failed clause's representative case again and keep plots and videos; `watch` gets number and total."""
    failed: dict[str, tuple[StudyRun, list[Finding]]] = {}
    for one in outcomes:
        for judgement in one.judgements:
            if judgement.outcome is not Outcome.PASSED:
                name = _folder_name(one.test, judgement.run)
                failed.setdefault(name, (judgement.run, []))[1].append(judgement.telling)
    folder = out / FOLDER
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    work = KeepFailures({name: tuple(findings) for name, (_, findings) in failed.items()})
    runs, done = [replace(run, key=name) for name, (run, _) in failed.items()], itertools.count()
    watch(next(done), len(runs))
    ProcessPool(processes, work).run(runs, folder, lambda *_: watch(next(done), len(runs)))
    return {
        (run.key, finding.name, finding.clause): Artefacts(
            _if_there(folder / name / f"{_title_of(finding)}.svg"), _if_there(folder / name / _VIDEO)
        )
        for name, (run, findings) in failed.items()
        for finding in findings
    }


def _folder_name(test: FogTest, run: StudyRun) -> str:
    """Name of a case's folder: a description and a digest that makes it unique."""
    label = label_of(run)
    digest = hashlib.sha256(f"{test.path.resolve()} {label}".encode()).hexdigest()[:6]
    return re.sub(r"[^A-Za-z0-9_.,=-]", "_", f"{test.name}-{digest}{'-' if label else ''}{label}")[:150]


def _title_of(finding: Finding) -> str:
    """Name of an expectation and its clause, for file names."""
    return re.sub(r"[^A-Za-z0-9_.-]", "_", f"{finding.name}.{finding.clause}")


def _if_there(path: Path) -> Path | None:
    return path if path.is_file() else None


@dataclass(frozen=True, slots=True)
class KeepFailures:
    """Runs cases again until shortly after their failures, and keeps videos and plots; findings are by folder name."""

    findings: Mapping[str, tuple[Finding, ...]]

    def __call__(self, scenario: Scenario, seed: int, folder: Path) -> dict[str, Any]:
        """Run a case again into a folder; the outcome."""
        folder.mkdir(exist_ok=True)
        return outcome_of(lambda: _kept(scenario, seed, self.findings[folder.name], folder))


def _conditions_of(scenario: Scenario, finding: Finding) -> Iterator[Condition]:
    """Conditions of the clause that a finding is about."""
    for clause in clauses_of(scenario.expect):
        if (clause.name, clause.clause) == (finding.name, finding.clause):
            if isinstance(clause, Whenever):
                yield from (clause.trigger, clause.require)
            elif isinstance(clause, Always | Eventually):
                yield clause.condition
                yield from () if clause.during is None else (clause.during,)


def _kept(scenario: Scenario, seed: int, findings: Sequence[Finding], folder: Path) -> dict[str, Any]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        _keep(scenario, seed, findings, folder)
    return {}


def _keep(scenario: Scenario, seed: int, findings: Sequence[Finding], folder: Path) -> None:
    instants = [one.time for one in findings if one.time is not None]
    logs = {_title_of(one): _SignalLog(_conditions_of(scenario, one)) for one in findings}
    has_frames = scenario.traffic.has_ego and scenario.renderer != NO_RENDERER
    steps: Iterable[TrafficStep] = run(scenario, seed) if scenario.traffic.has_ego else run_traffic(scenario, seed)
    video = VideoRecorder(folder / _VIDEO, scenario.clocks.camera_period_s) if has_frames and instants else None
    complete = False
    try:
        for step in steps:
            for log in logs.values():
                log.update(step)
            if video is not None and isinstance(step, Step) and -BEFORE <= step.time - min(instants) <= AFTER:
                video.record(step, step_metrics(step))
            if instants and step.time >= max(instants) + AFTER:
                break
        complete = True
    finally:
        # Otherwise its encoder would wait for more.
        if video is not None:
            video.close(complete)
    for title, log in logs.items():
        if log.values:
            write_text(folder / f"{title}.svg", _plot_signals(log, title, instants))
