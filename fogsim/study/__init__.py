"""Studies: policies, fogs, demands, drivers and estimators compared over seeds, in parallel, with intervals."""

import os
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

from fogsim.core.files.output_targets import refuse_unwritable_folder
from fogsim.core.files.writer_lock import WriterLock
from fogsim.core.parameters import Range, checked_parameters
from fogsim.errors import InputError
from fogsim.study.comparison import Difference
from fogsim.study.directory import StudyDirectory
from fogsim.study.execution import Engine
from fogsim.study.plan import Study, StudyRun, load_study, shipped_studies
from fogsim.study.pool import ProcessPool
from fogsim.study.profiles import pool_profiles
from fogsim.study.ray_cluster import RayCluster
from fogsim.study.report import write_report
from fogsim.study.table import Row, check_factors, write_table

__all__ = [
    "Difference",
    "Engine",
    "RayCluster",
    "Row",
    "Study",
    "StudyRun",
    "Watch",
    "load_study",
    "run_study",
    "shipped_studies",
]


Watch = Callable[[int, str | None], None]
"""Called with the number of completed runs, and with the error of the last one or None."""


def _unwatched(_: int, __: str | None) -> None:
    """Show nothing."""


@checked_parameters
def run_study(
    study: Study,
    out: str | Path,
    *,
    processes: Annotated[int, Range(1, 10_000)] | None = None,
    engine: Engine | None = None,
    watch: Watch = _unwatched,
) -> list[Row]:
    """Run what a directory has no results of yet, and write its table, comparison and report.

    Parameters
    ----------
    study : Study
        From `load_study`.
    out : str or Path
        Directory: ``study.parquet`` and ``study.csv`` (a row for each run: factors, seed, metrics), ``comparison.csv``,
        ``report.html``, ``figures/`` (SVG and CSV); ``runs/`` has a file for each run, from which a study is continued.
    processes : int or None
        Concurrent processes on this machine; None for one per core.
    engine : Engine or None
        Replaces the processes: `RayCluster`.
    watch : callable
        Called at the beginning and after each run, with the number of completed runs, and with the error of
        the last one or None.

    Returns
    -------
    list of Row
        The table.

    Raises
    ------
    InputError
        If the directory holds something else, another study, or is written by another process; if both processes and
        an engine are given; if one of your metrics has the name of a factor; or if a Ray cluster does not answer or
        cannot run the study.
    MissingDependencyError
        If Ray is needed and not installed.
    OSError
        If something cannot be written, as on a full disk: completed runs are kept, and the same call resumes.
    KeyboardInterrupt
        On Ctrl-C: all completed runs are kept, and the same call resumes.
    """
    if engine is not None and processes is not None:
        raise InputError("processes are this machine's: give either processes or an engine")
    engine = engine or ProcessPool(processes or os.cpu_count() or 1)
    out = Path(out)
    refuse_unwritable_folder(out)
    out.mkdir(parents=True, exist_ok=True)
    with WriterLock(out):
        directory = StudyDirectory(out, study)
        missing = directory.missing()
        done = len(study.runs) - len(missing)
        watch(done, None)
        # Cells whose settings make the same scenario share a result.
        sharing = Counter(run.key for run in missing)

        def count(run: StudyRun, message: str | None) -> None:
            nonlocal done
            done += sharing[run.key]
            watch(done, message)

        engine.run(list({run.key: run for run in missing}.values()), directory.results, count)
        rows = directory.rows()
        check_factors(rows, [run.levels for run in study.runs])
        write_table(rows, out)
        write_report(study, rows, pool_profiles(directory.profiles()), out)
    return rows
