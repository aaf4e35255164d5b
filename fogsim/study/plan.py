"""A study file: a scenario, its variations, the number of seeds, and the baseline."""

import contextlib
import functools
import hashlib
import itertools
import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, ValidationError, model_validator

from fogsim.core.files.readers import open_regular
from fogsim.core.parameters import checked_parameters
from fogsim.core.registry.user_code import MayImport, import_anything
from fogsim.errors import InputError, UnknownNameError, shown, suggest
from fogsim.scenario import Scenario, build, catalogue, scenario_from_config
from fogsim.scenario.document import Document, apply_overrides, read_document, read_scenario_document
from fogsim.scenario.expect.conditions import refuse
from fogsim.scenario.loading import CountWatch, scenario_file, scenario_reader
from fogsim.scenario.mistakes import mistake_lines
from fogsim.scenario.plain_yaml import KeyPath, parse_yaml
from fogsim.scenario.section import Id, Section, Seed, Share, Text
from fogsim.scenario.traffic_alone import NO_EGO
from fogsim.scenario.variation import differing_cases, grid_mistake
from fogsim.scenario.written_form import deciding
from fogsim.simulation.run_config import NO_RENDERER
from fogsim.study.main_metrics import METHODS_KEY, OF_THE_BELIEF, OF_WARNINGS, unknown_metrics
from fogsim.study.table import column_mistake

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9]([A-Za-z0-9_.+ -]{0,58}[A-Za-z0-9_.+-])?$")]
"""Name of a factor or a level: it becomes a column or a legend."""


def _as_key(value: object) -> object:
    """A number as it is as a key, which is text."""
    return json.dumps(value) if isinstance(value, int | float) else value


_Level = Annotated[Name, BeforeValidator(_as_key, json_schema_input_type=str | float)]

_MOST_EQUAL = 5


class StudyFile(Section):
    """What stands in a study file."""

    scenario: Text | None = None
    """A scenario of the catalogue, or a file or folder relative to the study's."""

    sumocfg: Path | None = None
    """In its place: a SUMO configuration, relative to the study's folder."""

    ego: Id | None = None
    """With `sumocfg`: id of the ego vehicle; none, the default, for traffic alone."""

    settings: tuple[Text, ...] = ()
    """`key.path=value` each, put in place of the scenario's in every run."""

    factors: Annotated[dict[Name, dict[Name, tuple[Text, ...]]], Field(min_length=1)]
    """What is varied: a name and the levels of each factor, each level with the settings that make it."""

    seeds: Annotated[int, Field(strict=True, ge=1, le=100_000)] | Annotated[tuple[Seed, ...], Field(min_length=1)] = 10
    """How many seeds, from 0 on, or a list of them; every cell of the grid has the same ones."""

    baseline: dict[Name, _Level] = Field(default_factory=dict)
    """Level of one factor or several to which the others are compared; by default the first factor's first level."""

    confidence: Annotated[Share, Field(ge=0.5, le=0.999)] = 0.95
    """Confidence of the intervals."""

    frames: Literal["where_needed", "always"] = "where_needed"
    """Whether runs draw frames in which nothing goes by what the camera sees."""

    metrics: tuple[Text, ...] = ()
    """Metrics of the comparison and the report; by default all, the main ones first."""

    wanted_interval: Annotated[float, Field(gt=0, le=10)] = 0.1
    """Half-width of an interval, as a share of the baseline's mean, for which the seeds needed are given."""

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        refuse(self._mistakes())
        return self

    def _mistakes(self) -> Iterator[tuple[KeyPath, str]]:
        if (self.scenario is None) == (self.sumocfg is None):
            yield (), "give either scenario, or sumocfg, perhaps with ego"
        elif self.scenario is not None and self.ego is not None:
            yield (
                ("ego",),
                "goes with sumocfg; a scenario names its own, which settings: [traffic.ego=ID] changes",
            )
        yield from ((("metrics",), wrong) for wrong in unknown_metrics(self.metrics))
        if len(set(self.metrics)) < len(self.metrics):
            yield ("metrics",), "a metric is named twice"
        if not isinstance(self.seeds, int) and len(set(self.seeds)) < len(self.seeds):
            yield ("seeds",), "a seed is given twice"
        yield from self._mistakes_of_factors()

    def _mistakes_of_factors(self) -> Iterator[tuple[KeyPath, str]]:
        for name, levels in self.factors.items():
            mistake = column_mistake(name)
            if mistake is not None:
                yield ("factors", name), mistake
            if not levels:
                yield ("factors", name), "a factor needs at least one level"
        for name, level in self.baseline.items():
            if name not in self.factors:
                yield ("baseline", name), f"unknown factor; {suggest(name, self.factors)}"
            elif self.key_of(name, level) not in self.factors[name]:
                yield ("baseline", name), f"unknown level {shown(level)}; {suggest(level, self.factors[name])}"

    def key_of(self, factor: str, level: str) -> str:
        """A level of the baseline as it stands among the levels, where ``off`` and ``1e3`` are text."""
        return next((one for one in self.factors[factor] if level in (one, _as_key(parse_yaml(one)[0]))), level)


@dataclass(frozen=True, slots=True)
class StudyRun:
    """One run of a study.

    Attributes
    ----------
    number : int
        Its index in the table, from 0.
    levels : mapping from str to str
        Level of each factor.
    seed : int
        Seed of the run.
    scenario : Scenario
        The scenario that is run.
    key : str
        A digest of the scenario and the seed, which identifies its result.
    """

    number: int
    levels: Mapping[str, str]
    seed: int
    scenario: Scenario
    key: str


@dataclass(frozen=True, slots=True)
class Study:
    """A study that has been checked.

    Attributes
    ----------
    name : str
        Name of its file, without its ending.
    factors : mapping from str to tuple of str
        Levels of each factor, in the order of the file.
    baseline : mapping from str to str
        Levels to which the others are compared.
    confidence : float
        Confidence of the intervals, 0 … 1.
    runs : tuple of StudyRun
        All runs, in the order of the table.
    metrics : tuple of str
        Metrics of the comparison and the report; empty for all, the main ones first.
    wanted_interval : float
        Half-width of an interval, as a share of the baseline's mean, for which the needed seeds are reported.
    level_settings : mapping from str to mapping
        Settings of each level of each factor.
    file : Path
        The study file.
    """

    name: str
    factors: Mapping[str, tuple[str, ...]]
    baseline: Mapping[str, str]
    confidence: float
    runs: tuple[StudyRun, ...]
    metrics: tuple[str, ...] = ()
    wanted_interval: float = 0.1
    level_settings: Mapping[str, Mapping[str, tuple[str, ...]]] = field(default_factory=dict)
    file: Path = Path("study.yaml")

    def cells(self) -> dict[str, Scenario]:
        """Scenario of each cell, by the levels of all factors as text."""
        return {_label(run.levels): run.scenario for run in self.runs}

    def description(self) -> dict[str, Any]:
        """Everything that determines its runs, as JSON data: each cell's scenario by its levels, and the seeds."""
        of_cells = self.cells()
        cells = {label: deciding(scenario) for label, scenario in of_cells.items()}
        seeds = list(dict.fromkeys(run.seed for run in self.runs))
        factors = {name: list(levels) for name, levels in self.factors.items()}
        files = dict(item for scenario in of_cells.values() for item in file_digests(scenario).items())
        told = {"factors": factors, "baseline": dict(self.baseline), "seeds": seeds, "files": files, "cells": cells}
        methods = dict(item for scenario in of_cells.values() for item in build.own_methods(scenario).items())
        return {**told, "own_methods": methods} if methods else told


def _label(levels: Mapping[str, str]) -> str:
    return ", ".join(f"{name}={level}" for name, level in levels.items())


def file_digests(scenario: Scenario) -> dict[str, str]:
    """Digest of each file that traffic and methods of a scenario read, by name; InputError if SUMO's are missing."""
    files = build.input_files(scenario)
    return {os.path.relpath(path, scenario.directory): _digest(path, path.stat().st_mtime_ns) for path in files}


@functools.lru_cache
def _digest(path: Path, _: int) -> str:
    """Digest of a file's content, computed again after the file has changed."""
    with open_regular(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()[:20]


def shipped_studies() -> dict[str, Path]:
    """Names and files of the shipped studies, which are next to the scenarios."""
    folders = {file.parents[1] / "studies" for file in catalogue().values()}
    return {file.stem: file for folder in folders for file in sorted(folder.glob("*.yaml"))}


def study_file(name_or_path: str | Path) -> Path:
    """Path of a study file or of a shipped study's name; a path is not checked."""
    path = Path(name_or_path)
    if path.suffix or len(path.parts) != 1 or path.exists():
        return path
    known = shipped_studies()
    if str(name_or_path) not in known:
        raise UnknownNameError("study", str(name_or_path), known)
    return known[str(name_or_path)]


@checked_parameters
def load_study(
    name_or_path: str | Path,
    settings: Iterable[str] = (),
    may_import: MayImport = import_anything,
    watch: CountWatch | None = None,
) -> Study:
    """Read a study file and check every scenario of its grid, before anything is run.

    Parameters
    ----------
    name_or_path : str or Path
        The file, or the name of a study that comes with FogSim (`fogsim.study.shipped_studies`).
    settings : iterable of str
        ``key.path=value`` each, replacing the scenario's values in every run, after those of the file.
    may_import : callable
        As in `load_scenario`.
    watch : callable or None
        Called after each cell with the number of checked cells and their total.

    Raises
    ------
    InputError
        If anything does not fit; one line for each mistake, with file, line, key path, value and what is allowed.
    """
    path = study_file(name_or_path)
    document = read_document(path)
    try:
        written = StudyFile.model_validate(document.data)
        written = written.model_copy(update={"settings": (*written.settings, *settings)})
    except ValidationError as error:
        raise InputError(mistake_lines(document, StudyFile, error)) from error
    sizes = {name: len(levels) for name, levels in written.factors.items()}
    mistake = grid_mistake({**sizes, "seeds": written.seeds if isinstance(written.seeds, int) else len(written.seeds)})
    if mistake is not None:
        raise InputError(f"{document.where(('factors',))}: factors: {mistake}")
    first, levels = next(iter(written.factors.items()))
    return Study(
        name=path.stem,
        factors={name: tuple(levels) for name, levels in written.factors.items()},
        baseline={name: written.key_of(name, one) for name, one in written.baseline.items()}
        or {first: next(iter(levels))},
        confidence=written.confidence,
        runs=tuple(_runs(document, written, may_import, watch)),
        metrics=written.metrics,
        wanted_interval=written.wanted_interval,
        level_settings=written.factors,
        file=path,
    )


def _runs(
    document: Document, written: StudyFile, may_import: MayImport, watch: CountWatch | None
) -> Iterator[StudyRun]:
    seeds = range(written.seeds) if isinstance(written.seeds, int) else written.seeds
    load, number = _loader(document, written, may_import), itertools.count()
    grid = list(itertools.product(*written.factors.values()))
    for done, cell in enumerate(grid, 1):
        levels = dict(zip(written.factors, cell, strict=True))
        scenario = _scenario(document, written, levels, load)
        text = json.dumps([deciding(scenario), file_digests(scenario)], sort_keys=True)
        for seed in seeds:
            key = hashlib.sha256(f"{text} {seed}".encode()).hexdigest()[:20]
            yield StudyRun(next(number), levels, seed, scenario, key)
        if watch is not None:
            watch(done, len(grid))


def _loader(document: Document, written: StudyFile, may_import: MayImport) -> Callable[[Sequence[str]], Scenario]:
    """Makes scenarios from settings, from files that are read once."""
    folder = document.path.parent
    if written.sumocfg is not None:
        config, ego = folder / written.sumocfg, written.ego or NO_EGO
        return lambda settings: scenario_from_config(config, ego, settings, may_import=may_import)
    name = str(written.scenario)
    own = folder / name
    try:
        path = scenario_file(own if own.exists() else name)
        _refuse_cases(read_scenario_document(path), written.settings)
        return scenario_reader(path, may_import=may_import)
    except InputError as error:
        raise InputError(f"{document.where(('scenario',))}: scenario: {error}") from error


def _refuse_cases(document: Document, settings: Iterable[str]) -> None:
    """Raise InputError for a scenario whose cases differ in more than their seeds: a study would run only the first."""
    varied = [setting for setting in settings if setting.lstrip().startswith("vary")]
    document = replace(document, data=apply_overrides(document.data, varied))
    cases = differing_cases(document)
    if len(cases) > 1:
        names = ", ".join(cases[0].values)
        raise InputError(
            f"{document.where(('vary',))}: vary: a study runs a single case, and {names} make {len(cases)}; write "
            "factors and seeds in their place"
        )


def _scenario(
    document: Document, written: StudyFile, levels: Mapping[str, str], load: Callable[[Sequence[str]], Scenario]
) -> Scenario:
    settings = [*written.settings]
    for factor, level in levels.items():
        settings += written.factors[factor][level]
    try:
        scenario = load(settings)
        if written.frames == "where_needed" and not needs_camera(scenario, written.metrics):
            # What else needs frames, such as a condition on the belief, refuses to go without.
            with contextlib.suppress(InputError):
                scenario = load([*settings, f"renderer={NO_RENDERER}", "estimators=[]"])
    except InputError as error:
        raise InputError(f"{document.path}: {_label(levels)}: {error}") from error
    return scenario


def needs_camera(scenario: Scenario, metrics: Iterable[str] = ()) -> bool:
    """Whether advice, lamps, a controller or the chosen metrics depend on the camera."""
    if scenario.controller is not None or any(_is_of_camera(metric) for metric in metrics):
        return True
    unmoved = "low_beam", "always_low", "always_high"
    deaf = scenario.advice.method in ("none", "fixed_speed"), scenario.lighting.method in unmoved
    methods = (scenario.advice, scenario.lighting)
    return any(m.informed_by == "belief" and not d for m, d in zip(methods, deaf, strict=True))


def goes_by_reports(scenario: Scenario, metrics: Iterable[str]) -> bool:
    """Whether a belief without estimators is informed by the reports of others, and is what the study asks about."""
    senders = scenario.sensors.reports
    is_deaf = scenario.fusion.method in ("grid_filter", "mixture_filter", "none")
    has_senders = senders.roadside is not None or senders.vehicles is not None
    return has_senders and not is_deaf and needs_camera(scenario, metrics)


def _is_of_camera(metric: str) -> bool:
    return metric in OF_THE_BELIEF | OF_WARNINGS or metric.startswith(f"{METHODS_KEY}.")


def equal_cells(study: Study) -> list[str]:
    """Sentences on cells that have the same scenario: what distinguishes them has no effect."""
    cells: dict[str, dict[str, None]] = {}
    for run in study.runs:
        if run.seed == study.runs[0].seed:
            cells.setdefault(run.key, {})[" · ".join(run.levels.values())] = None
    equal = [" and ".join(labels) for labels in cells.values() if len(labels) > 1]
    more = f"; and {len(equal) - _MOST_EQUAL} more" if len(equal) > _MOST_EQUAL else ""
    said = f"The same scenario, so that no run can differ: {'; '.join(equal[:_MOST_EQUAL])}{more}."
    return [said] if equal else []


def grid_text(study: Study) -> str:
    """Size of a study's grid: ``policy (2) × seed (3) = 6 runs``."""
    sizes = {**{name: len(levels) for name, levels in study.factors.items()}, "seed": len({r.seed for r in study.runs})}
    return " × ".join(f"{name} ({number})" for name, number in sizes.items()) + f" = {len(study.runs)} runs"
