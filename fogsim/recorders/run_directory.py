"""The directory of one run's results."""

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

from fogsim.core.files.atomic import Reserve, partial_path, write_json
from fogsim.core.files.output_targets import refuse_unwritable_folder
from fogsim.core.files.readers import read_json
from fogsim.core.files.writer_lock import WriterLock, WritingProcess
from fogsim.errors import InputError
from fogsim.recorders.manifest import Status

UNFINISHED = "unfinished"
"""Folder in the directory that holds the results of a run until its end."""

LOG_SUFFIX = ".arrows"
"""Suffix of the unfinished folder's row files, until they become ``….parquet``."""

ROW_LOG = "steps" + LOG_SUFFIX
"""Rows of ``steps.parquet``."""

TRAJECTORY_LOG = "trajectories" + LOG_SUFFIX
"""Rows of ``trajectories.parquet``."""

EVENT_LOG = "events" + LOG_SUFFIX
"""Rows of ``events.parquet``."""

_SUMO_OUTPUTS = "sumo_outputs"
"""Folder of SUMO's own outputs; ``sumo_outputs.part`` until the end of the run."""

_NAMES = {
    "manifest": "manifest.json",
    "metrics": "metrics.json",
    "table": "steps.parquet",
    "trajectories": "trajectories.parquet",
    "events": "events.parquet",
    "openscenario": "scenario.xosc",
    "osi": "ground_truth.osi",
    "video": "video.mp4",
    "restored_video": "restored.mp4",
    "report": "report.html",
}
_RESERVE = "reserve"


class RunDirectory:
    """The directory of one run and the names of its files; it has one writer at a time.

    Files are written into its folder ``unfinished`` from the first step (`begin`) to the end of the run (`finish`),
    when they replace earlier results at once. `overwrite` allows replacing FogSim's own files, never others.
    """

    def __init__(self, path: Path, overwrite: bool = False) -> None:
        self.path = Path(path)
        refuse_unwritable_folder(self.path)
        self._made = [folder for folder in (self.path, *self.path.parents) if not folder.exists()]
        self.path.mkdir(parents=True, exist_ok=True)
        try:
            self._lock = WriterLock(self.path)
            try:
                self._check(overwrite)
            except BaseException:
                self._lock.release()
                raise
        except BaseException:
            self._unmake()
            raise

    def _unmake(self) -> None:
        """Remove the created directories that are empty."""
        for folder in self._made:
            if not folder.is_dir() or any(folder.iterdir()):
                break
            folder.rmdir()

    def _check(self, overwrite: bool) -> None:
        for name in (UNFINISHED, *_NAMES.values()):
            there = self.path / name
            if there.exists() and there.is_dir() != (name == UNFINISHED):
                raise InputError(f"{there} is in the way of the results; choose another directory with --out")
        refuse_living(self.unfinished)
        outputs = self.path / _SUMO_OUTPUTS
        if outputs.exists() and _SUMO_OUTPUTS not in (*_listed(self.path), *_listed(self.unfinished)):
            raise InputError(f"{outputs} is not of an earlier run; move it, or choose another directory with --out")
        if overwrite:
            return
        # Without a manifest, a run was killed when all its results were in place.
        if self.file("manifest").exists():
            raise InputError(
                f"{self.path} contains rows of an unfinished run: {_fate_of_run(self.unfinished)}. "
                f"fogsim recover {self.path} makes them readable, --overwrite replaces them, --out goes elsewhere"
            )
        if self.earlier:
            raise InputError(
                f"{self.path} holds results of an earlier run ({', '.join(self.earlier)}); "
                "choose another directory with --out, or replace them with --overwrite"
            )

    @property
    def earlier(self) -> list[str]:
        """Names of existing results, of an earlier run until `finish`, including incomplete ones."""
        whole = [self.path / name for name in _NAMES.values()]
        return [name.name for name in whole + [partial_path(name) for name in whole] if name.is_file()]

    @property
    def unfinished(self) -> Path:
        """Folder of unfinished results."""
        return self.path / UNFINISHED

    @property
    def sumo_outputs(self) -> Path:
        """Folder of SUMO's own outputs, from before the first step on."""
        return partial_path(self.path / _SUMO_OUTPUTS)

    def clear_sumo_outputs(self) -> None:
        """Remove SUMO's outputs of a run that never finished."""
        try:
            if self.sumo_outputs.exists():
                shutil.rmtree(self.sumo_outputs)
        except OSError as error:
            raise InputError(f"cannot remove {self.sumo_outputs}: {error.strerror}") from error

    def begin(self, manifest: Mapping[str, object]) -> None:
        """Create the folder of unfinished results, replacing an unfinished run's; OSError if the disk is full."""
        new = partial_path(self.unfinished)
        shutil.rmtree(new, ignore_errors=True)
        try:
            new.mkdir()
            Reserve(new / _RESERVE)
            write_json(new / _NAMES["manifest"], manifest)
        except BaseException:
            shutil.rmtree(new, ignore_errors=True)
            raise
        shutil.rmtree(self.unfinished, ignore_errors=True)
        new.rename(self.unfinished)

    def write_metrics(self, metrics: Mapping[str, object]) -> None:
        """Write ``metrics.json``, after releasing the space reserved for it and the manifest."""
        (self.unfinished / _RESERVE).unlink(missing_ok=True)
        write_json(self.file("metrics"), metrics)

    def finish(self, manifest: Mapping[str, object]) -> None:
        """Write the manifest and replace all earlier results; if rows are left over, both old and new ones stay."""
        finish_folder(self.path, manifest)

    def close(self) -> None:
        """Release the lock; created directories stay if they are not empty."""
        self._lock.release()
        self._unmake()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def file(self, result: str) -> Path:
        """Path of a result, ``manifest``, ``metrics`` or that of a recorder, until the end of the run."""
        return self.unfinished / _NAMES[result]

    def files(self) -> list[str]:
        """Sorted names of the complete result files of a finished run."""
        return whole_files(self.path)


def whole_files(folder: Path) -> list[str]:
    """Sorted names of the complete result files in a folder and of its folder of SUMO's outputs."""
    files = [name for name in _NAMES.values() if (folder / name).is_file()]
    return sorted([*files, *([_SUMO_OUTPUTS] if (folder / _SUMO_OUTPUTS).is_dir() else [])])


def read_manifest(folder: Path) -> dict[str, Any]:
    """Manifest in a folder; empty if it is missing or damaged."""
    try:
        content = read_json(folder / _NAMES["manifest"])
    except InputError:
        return {}
    return content if isinstance(content, dict) and content.get("status") in list(Status) else {}


def finish_folder(path: Path, manifest: Mapping[str, object]) -> None:
    """Finish a run directory: see `RunDirectory.finish`. The next call completes an interrupted one."""
    folder = path / UNFINISHED
    (folder / _RESERVE).unlink(missing_ok=True)
    # Files that an earlier call has moved already are named in the manifest that it wrote.
    names = {_NAMES["manifest"], *whole_files(folder), *_listed(folder)}
    outputs = partial_path(path / _SUMO_OUTPUTS)
    if outputs.is_dir() and any(outputs.iterdir()):
        names.add(_SUMO_OUTPUTS)
    write_json(folder / _NAMES["manifest"], {**manifest, "files": sorted(names)})
    if any((folder / log).exists() for log in (ROW_LOG, TRAJECTORY_LOG, EVENT_LOG)):
        return
    # Without a manifest the directory claims nothing while new files replace old ones.
    (path / _NAMES["manifest"]).unlink(missing_ok=True)
    for name in _NAMES.values():
        partial_path(path / name).unlink(missing_ok=True)
        if name == _NAMES["manifest"]:
            continue
        if (folder / name).is_file():
            (folder / name).replace(path / name)
        elif name not in names:
            (path / name).unlink(missing_ok=True)
    _place_sumo_outputs(path, _SUMO_OUTPUTS in names)
    (folder / _NAMES["manifest"]).replace(path / _NAMES["manifest"])
    shutil.rmtree(folder)


def _place_sumo_outputs(path: Path, there_are: bool) -> None:
    """Replace an earlier run's SUMO outputs; without new ones, the old ones are removed."""
    outputs, final = partial_path(path / _SUMO_OUTPUTS), path / _SUMO_OUTPUTS
    if outputs.exists() or not there_are:
        shutil.rmtree(final, ignore_errors=True)
    if there_are and outputs.exists():
        outputs.rename(final)
    shutil.rmtree(outputs, ignore_errors=True)


def _listed(folder: Path) -> list[str]:
    """Results that a folder's manifest names."""
    listed = read_manifest(folder).get("files", [])
    known = (*_NAMES.values(), _SUMO_OUTPUTS)
    return [name for name in listed if name in known] if isinstance(listed, list) else []


def refuse_living(folder: Path) -> None:
    """Refuse a folder whose process is alive, in case its lock was removed."""
    manifest = read_manifest(folder)
    process = WritingProcess.from_json(manifest.get("process"))
    if process is None or manifest.get("status") != "running" or process == WritingProcess.this():
        return
    if process.lives():
        raise InputError(
            f"{folder.parent}: process {process.id} is writing there; wait for its end, or choose another directory "
            "with --out"
        )


def _fate_of_run(folder: Path) -> str:
    """Status of the run of an unfinished folder."""
    manifest = read_manifest(folder)
    process = WritingProcess.from_json(manifest.get("process"))
    if process is not None and manifest.get("status") == "running":
        return f"process {process.id} has died in it"
    return str(manifest.get("message") or manifest.get("status") or "nothing is known of it")
