"""What runs the runs of a study: an engine, which leaves each run's outcome in a file of its own."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol

from fogsim.study.plan import StudyRun

RunWatch = Callable[[StudyRun, str | None], None]
"""Called with each run that is done, and what went wrong with it."""

PROCESS_DIED = "the process that ran it died"
"""What is told of a run whose process died twice."""


class Engine(Protocol):
    """Processes of this machine (`fogsim.study.pool.ProcessPool`), a cluster (`fogsim.study.ray_cluster.RayCluster`).

    Whatever it is, the files are the same, byte for byte; and whatever ends it, finished runs are kept.
    """

    def run(self, runs: Sequence[StudyRun], folder: Path, watch: RunWatch) -> None:
        """Run what is given, each run's outcome in its `result_file`.

        Parameters
        ----------
        runs : sequence of StudyRun
            What is to be run.
        folder : Path
            Where the results go, ``KEY.json`` each.
        watch : RunWatch
            Who is told of each run that is done, in this process.
        """


def result_file(folder: Path, run: StudyRun) -> Path:
    """Path of a run's result in the folder of results."""
    return folder / f"{run.key}.json"
