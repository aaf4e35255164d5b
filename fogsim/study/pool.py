"""Runs of a study in parallel processes of this machine; completed runs are kept however it ends."""

import contextlib
import multiprocessing.util
import os
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path

from fogsim.core.files.atomic import write_json
from fogsim.core.files.standard_streams import open_standard_streams
from fogsim.core.interruption import Interruption
from fogsim.core.processes import refuse_to_run_again
from fogsim.study.execution import PROCESS_DIED, RunWatch, Work, failure, result_file, run_outcome, run_to_file
from fogsim.study.plan import StudyRun


@dataclass(frozen=True, slots=True)
class ProcessPool:
    """Parallel processes on this machine; `work` must be a function of a module.

    When a process dies, the runs that were in progress are run again, each alone; the one that dies again counts as
    failed.
    """

    processes: int
    work: Work = run_outcome

    def run(self, runs: Sequence[StudyRun], folder: Path, watch: RunWatch) -> None:
        """Run studies' runs, each outcome into its `result_file`; `watch` is called in this process after each."""
        waiting = list(reversed(runs))
        while waiting:
            for suspect in _run_until_broken(waiting, folder, self.processes, watch, self.work):
                alone = [suspect]
                while alone:
                    if _run_until_broken(alone, folder, 1, watch, self.work):
                        write_json(result_file(folder, suspect), failure(PROCESS_DIED))
                        watch(suspect, PROCESS_DIED)


def _run_until_broken(
    waiting: list[StudyRun], folder: Path, processes: int, watch: RunWatch, work: Work
) -> list[StudyRun]:
    """Execute runs from the end of a list, removing them; return those in progress when a process died."""
    under_way: dict[Future[str | None], StudyRun] = {}
    try:
        with worker_pool(processes, work.__module__) as pool:
            while waiting or under_way:
                while waiting and len(under_way) < processes:
                    run = waiting[-1]
                    future = _submitted(pool, work, run, result_file(folder, run))
                    under_way[future] = waiting.pop()
                for done in wait(under_way, return_when=FIRST_COMPLETED).done:
                    message = done.result()
                    watch(under_way.pop(done), message)
    except BrokenProcessPool:
        return list(under_way.values())
    return []


def _submitted(pool: ProcessPoolExecutor, work: Work, run: StudyRun, result: Path) -> Future[str | None]:
    """Submit a run; BrokenProcessPool also if the fork server died, which the next pool starts again."""
    # A signal while a process starts would leave it behind, and it would print a traceback.
    with Interruption():
        try:
            return pool.submit(run_to_file, run.scenario, run.seed, result, work)
        except (EOFError, ConnectionError, BrokenProcessPool) as error:
            broken = BrokenProcessPool(str(error))
    raise broken


@contextlib.contextmanager
def worker_pool(processes: int, module: str) -> Iterator[ProcessPoolExecutor]:
    """Processes that end with this one, and at once if the block raises an error; `module` has their work."""
    refuse_to_run_again()
    # One SUMO per process, without threads or contexts of this one: all are forked from a process that has only
    # imported what they need.
    open_standard_streams()
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["fogsim.study.execution", module])
    others = multiprocessing.active_children()
    pool = ProcessPoolExecutor(processes, mp_context=context, initializer=_prepare_worker)
    try:
        yield pool
    except BaseException:
        for worker in multiprocessing.active_children():
            if worker not in others:
                worker.terminate()
        pool.shutdown(wait=True, cancel_futures=True)
        raise
    pool.shutdown(wait=True)


def _prepare_worker() -> None:
    """Let Ctrl-C, which a terminal sends to all processes, end the one that waits for the runs, which ends this one."""
    for signum in (signal.SIGINT, signal.SIGHUP):
        signal.signal(signum, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    # The last of all: Python would wait for threads that a user's method has left.
    multiprocessing.util.Finalize(None, _end, exitpriority=-100)


def _end() -> None:
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    finally:
        os._exit(0)


def _end_with_parent() -> None:
    """End this process when the one that waits for it is killed, so that it does not continue unnoticed."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
