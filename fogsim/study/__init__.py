"""Studies: policies, fogs, demands, drivers and estimators compared over seeds, in parallel, with intervals."""

import os
from collections.abc import Callable
from pathlib import Path

from fogsim.files.writer_lock import WriterLock
from fogsim.study.comparison import Difference
from fogsim.study.directory import StudyDirectory
from fogsim.study.plan import Study, StudyRun, load_study
from fogsim.study.pool import run_in_pool
from fogsim.study.pooled_profiles import pool_profiles
from fogsim.study.report import write_report
from fogsim.study.table import Row, write_table

__all__ = ["Difference", "Row", "Study", "StudyRun", "Watch", "load_study", "run_study"]


Watch = Callable[[int, str | None], None]
"""Called with the number of runs that are done, and with what went wrong with the last one or None."""


def _unwatched(_: int, __: str | None) -> None:
    """Show nothing."""


def run_study(study: Study, out: Path, *, processes: int | None = None, watch: Watch = _unwatched) -> list[Row]:
    """Run what a directory has no result of yet, and write its table, comparison and report.

    Parameters
    ----------
    study : Study
        From `load_study`.
    out : Path
        Directory: ``study.parquet`` and ``study.csv`` (a row for each run: factors, seed, metrics), ``comparison.csv``,
        ``report.html``, ``figures/`` (SVG and CSV); ``runs/`` holds a file for each run, by which a study is continued.
    processes : int or None
        Runs at once; None for one a core.
    watch : callable
        Called at the beginning and after each run, with the number of runs that are done, and with what went wrong with
        the last one or None.

    Returns
    -------
    list of Row
        The table.

    Raises
    ------
    InputError
        If the directory holds something else, another study, or is written by another process.
    KeyboardInterrupt
        On Ctrl-C: all runs that were done are kept, and the same call goes on.
    """
    directory = StudyDirectory(out, study)
    with WriterLock(out):
        missing = directory.missing()
        done = len(study.runs) - len(missing)
        watch(done, None)

        def count(_: StudyRun, message: str | None) -> None:
            nonlocal done
            done += 1
            watch(done, message)

        run_in_pool(missing, directory.results, processes or os.cpu_count() or 1, count)
        rows = directory.rows()
        write_table(rows, out)
        write_report(study, rows, pool_profiles(directory.profiles()), out)
    return rows
