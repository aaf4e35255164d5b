"""Results of a run whose process has died."""

import contextlib
import shutil
from datetime import UTC, datetime
from pathlib import Path

from fogsim.core.files.writer_lock import WriterLock
from fogsim.errors import InputError
from fogsim.recorders.events import write_event_table
from fogsim.recorders.manifest import Status
from fogsim.recorders.run_directory import (
    EVENT_LOG,
    ROW_LOG,
    TRAJECTORY_LOG,
    UNFINISHED,
    finish_folder,
    read_manifest,
    refuse_living,
    whole_files,
)
from fogsim.recorders.table import write_step_table
from fogsim.recorders.trajectories import write_trajectory_table


def recover_run(path: Path, overwrite: bool = False) -> list[str]:
    """Recover the readable results of a run that was killed or could not close its table; return the files' names.

    Its rows become ``steps.parquet``, ``events.parquet`` and ``trajectories.parquet``, marked as partial, and its
    manifest says "dead"; video and report are lost. Raises InputError if there is nothing to recover, the run is not
    over, or earlier results must not be overwritten.
    """
    folder = path / UNFINISHED
    manifest = read_manifest(folder)
    if not manifest and folder.exists() and read_manifest(path):
        # Its process was killed when all results were in place.
        with WriterLock(path):
            shutil.rmtree(folder)
        return whole_files(path)
    if not manifest:
        raise InputError(f"{path} contains no unfinished run")
    with WriterLock(path):
        refuse_living(folder)
        dead = manifest["status"] == Status.RUNNING.value
        earlier = whole_files(path)
        # A run that was over had permission to replace them.
        if dead and earlier and not overwrite:
            raise InputError(
                f"{path} holds results of an earlier run ({', '.join(earlier)}), which would give way; "
                "copy what you need, and replace them with --overwrite"
            )
        _make_readable(folder)
        if dead:
            message = "the process has died; rows are there until then"
            ended = datetime.now(UTC).isoformat(timespec="seconds")
            manifest |= {"status": Status.DEAD.value, "message": message, "ended": ended}
        finish_folder(path, manifest)
    return whole_files(path)


def _make_readable(folder: Path) -> None:
    """Make tables from the rows in a folder."""
    writers = {ROW_LOG: write_step_table, TRAJECTORY_LOG: write_trajectory_table, EVENT_LOG: write_event_table}
    for name, write in writers.items():
        if (log := folder / name).exists():
            # A log without a header is of a process that was killed at its start.
            with contextlib.suppress(InputError):
                write(log.with_suffix(".parquet"), log, complete=False)
            log.unlink()
