"""An engine executes the runs of a study, and leaves each run's outcome in its own file."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol

from fogsim.study.plan import StudyRun

RunWatch = Callable[[StudyRun, str | None], None]
"""Called with each completed run, and its error."""

PROCESS_DIED = "the process that ran it died"
"""Message for a run whose process died twice."""


class Engine(Protocol):
    """Processes of this machine (`fogsim.study.pool.ProcessPool`), a cluster (`fogsim.study.ray_cluster.RayCluster`).

    With any engine the files are the same, byte for byte; and completed runs are kept however it ends.
    """

    def run(self, runs: Sequence[StudyRun], folder: Path, watch: RunWatch) -> None:
        """Execute runs, each outcome into its `result_file`.

        Parameters
        ----------
        runs : sequence of StudyRun
            The runs to execute.
        folder : Path
            Folder of the results, one ``KEY.json`` each.
        watch : RunWatch
            Called with each completed run, in this process.
        """


def result_file(folder: Path, run: StudyRun) -> Path:
    """Path of a run's result in the folder of results."""
    return folder / f"{run.key}.json"
