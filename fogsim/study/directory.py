"""The directory of a study: its plan, and a file for each completed run."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, Field, ValidationError

from fogsim.core.files.atomic import partial_path, write_json
from fogsim.core.files.output_targets import refuse_unwritable_folder
from fogsim.core.files.readers import read_json
from fogsim.core.files.writer_lock import LOCK_NAME
from fogsim.errors import InputError, shown
from fogsim.recorders.manifest import versions
from fogsim.study.execution import result_file
from fogsim.study.main_metrics import OF_THE_BELIEF, OF_WARNINGS
from fogsim.study.plan import Study, StudyRun, goes_by_reports
from fogsim.study.profiles import Profiles
from fogsim.study.run_file import STUDY_RUN, CompleteRun, FailedRun, Value, read_run
from fogsim.study.table import Row

_MOST_LISTED = 5


class _Manifest(BaseModel):
    """Contents of `study.json` that are compared."""

    versions: dict[str, str | None]
    files: dict[str, str]
    cells: dict[str, dict[str, Any]]
    own_methods: dict[str, str] = Field(default_factory=dict)


class StudyDirectory:
    """Directory of a study's results, created if missing and continued if it is of the same study.

    InputError if it holds something else, or a study with other runs. Results of completed runs are in the folder
    `results`.
    """

    def __init__(self, path: Path, study: Study) -> None:
        self._study = study
        self.path, self.results = path, path / "runs"
        refuse_unwritable_folder(path)
        described = {"study": study.name, **study.description()}
        manifest, of_software = path / "study.json", versions()
        if manifest.exists():
            of_software = self._check_same(manifest, described)
        else:
            # A process that was killed there, or a full disk, may have left this much.
            begun = {partial_path(manifest), path / LOCK_NAME}
            if path.exists() and set(path.iterdir()) - begun:
                raise InputError(f"--out {path} holds something else than a study; choose another directory")
            path.mkdir(parents=True, exist_ok=True)
        # The baseline and the number of seeds may have changed.
        write_json(manifest, {**described, "versions": of_software})
        self.results.mkdir(exist_ok=True)

    def _check_same(self, manifest: Path, described: dict[str, Any]) -> dict[str, str | None]:
        """Versions of software with which the study was begun; InputError if it is another study."""
        try:
            there = _Manifest.model_validate(read_json(manifest)).model_dump()
        except (InputError, ValidationError) as error:
            raise InputError(
                f"{manifest}: not the description of a study; choose another directory with --out, or remove the file "
                "and the results next to it"
            ) from error
        now = {**described, "versions": _deciding_versions(versions())}
        before = {**there, "versions": _deciding_versions(there["versions"])}
        kinds = ("versions", "files", "cells", "own_methods")
        changed = [change for kind in kinds for change in _changes(before[kind], now.get(kind, {}))]
        if changed:
            more = f"; and {len(changed) - _MOST_LISTED} more" if len(changed) > _MOST_LISTED else ""
            raise InputError(
                f"--out {self.path} holds another study, whose results would be mixed with these: "
                f"{'; '.join(changed[:_MOST_LISTED])}{more}. Choose another directory, or undo the change"
            )
        of_software: dict[str, str | None] = there["versions"]
        return of_software

    def missing(self) -> list[StudyRun]:
        """Runs without a complete result; failed ones are tried again."""
        return [run for run in self._study.runs if not isinstance(self._result(run), CompleteRun)]

    def _result(self, run: StudyRun) -> CompleteRun | FailedRun | None:
        return read_run(result_file(self.results, run), STUDY_RUN)

    def rows(self) -> list[Row]:
        """The table: a row for each run, including those without a result."""
        return [self._row(run) for run in self._study.runs]

    def profiles(self) -> Iterator[tuple[Mapping[str, str], int, Profiles]]:
        """Levels, seed and profiles of each completed run."""
        for run in self._study.runs:
            found = self._result(run)
            if isinstance(found, CompleteRun):
                yield run.levels, run.seed, found.profiles.model_dump()

    def _row(self, run: StudyRun) -> Row:
        found = self._result(run)
        metrics = found.metrics if isinstance(found, CompleteRun) else {}
        if not run.scenario.estimators and not goes_by_reports(run.scenario, self._study.metrics):
            # Without a camera or reports the belief stays at its prior: there is no error to compare.
            unknown = OF_THE_BELIEF if run.scenario.controller else OF_THE_BELIEF | OF_WARNINGS
            metrics = {key: None if key in unknown else value for key, value in metrics.items()}
        about = {
            "seed": run.seed,
            "status": "missing" if found is None else found.status,
            "message": getattr(found, "message", None),
        }
        outputs = result_file(self.results, run).with_suffix("")
        kept: dict[str, Value] = {"sumo_outputs": f"{self.results.name}/{outputs.name}"} if outputs.is_dir() else {}
        return {"run": run.number, **run.levels, **about, **kept, **metrics}


def _deciding_versions(found: Mapping[str, str | None]) -> dict[str, str | None]:
    """Versions whose runs must not be mixed: those of FogSim and of SUMO."""
    return {f"version of {name}": found.get(name) for name in ("fogsim", "libsumo")}


def _changes(before: object, now: object, place: Sequence[str] = ()) -> Iterator[str]:
    """Differences between two trees of plain data, in words."""
    if isinstance(before, dict) and isinstance(now, dict):
        for key in dict.fromkeys((*before, *now)):
            if key not in before or key not in now:
                yield f"{' · '.join((*place, str(key)))} is {'new' if key in now else 'gone'}"
            else:
                yield from _changes(before[key], now[key], (*place, str(key)))
    elif before != now:
        yield f"{' · '.join(place)} was {shown(before)} and is {shown(now)}"
