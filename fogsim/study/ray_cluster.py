"""Runs of a study on a Ray cluster; this process writes their results, so no node needs the study's directory."""

import contextlib
import logging
import os
import platform
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fogsim.core.files.atomic import write_bytes, write_json
from fogsim.errors import FogSimError, InputError, MissingDependencyError, SimulationError, shown
from fogsim.recorders.manifest import versions
from fogsim.scenario import Scenario, build
from fogsim.study.execution import PROCESS_DIED, RunWatch, Work, failure, result_file, run_outcome
from fogsim.study.plan import StudyRun, file_digests

_MOST_PROCESSES, _MOST_NODES = 2, 10
"""Lost processes, and lost nodes, after which a run has failed: a node's end is hardly a run's fault."""

_CONNECTION_TIME, _ANSWER_TIME = 5.0, 15.0
"""Time for a cluster's port to open, and for Ray to answer there [s]."""

_SAME = "a study on Ray needs the same version of FogSim, and the scenario's files under the same path, on every node"


@dataclass(frozen=True, slots=True)
class _Result:
    """Result from a node: the outcome, and SUMO's outputs by name, or None without outputs."""

    outcome: dict[str, Any]
    outputs: dict[str, bytes] | None

    def write(self, file: Path) -> None:
        """Write SUMO's outputs into the folder of the result's name, then the result, which completes the run."""
        if self.outputs is not None:
            folder = file.with_suffix("")
            folder.mkdir(exist_ok=True)
            for name, content in self.outputs.items():
                write_bytes(folder / name, content)
        write_json(file, self.outcome)


@dataclass(frozen=True, slots=True)
class RayCluster:
    """A Ray cluster; each run is a task on one processor, in a process of a node.

    A process that dies loses only its own run, which is run again, and fails if its process dies again.
    Runs of a node that dies are moved to others.

    Attributes
    ----------
    address : str or None
        ``HOST:PORT`` of the cluster's head, "auto" for the one that this machine belongs to, or "local" for a new one
        on this machine only. None for the environment variable ``RAY_ADDRESS`` or, without it, "local".
    at_once : int or None
        Maximum number of concurrent runs; None for one per processor of the cluster.
    work : Work
        Function that executes each run on a node, from a module that the nodes have.
    """

    address: str | None = None
    at_once: int | None = None
    work: Work = run_outcome

    def run(self, runs: Sequence[StudyRun], folder: Path, watch: RunWatch) -> None:
        """Execute runs, each outcome into its `result_file`.

        Parameters
        ----------
        runs : sequence of StudyRun
            The runs to execute.
        folder : Path
            Folder of the results on this machine, one ``KEY.json`` each.
        watch : RunWatch
            Called with each completed run, in this process.

        Raises
        ------
        MissingDependencyError
            If Ray is not installed.
        InputError
            If no cluster answers at the address, or a node has another FogSim or other files of the scenario.
        OSError
            If a result cannot be written, as on a full disk.
        """
        ray = _import_ray()
        if not runs:
            return
        with _connection(ray, self.address or os.environ.get("RAY_ADDRESS") or "local", self.at_once):
            tasks = _Tasks(ray, runs, self.at_once, self.work)
            for run, result in tasks.results():
                result.write(result_file(folder, run))
                watch(run, result.outcome.get("message"))


class _Tasks:
    """Runs as tasks of Ray: waiting ones, those in progress, and how often each lost its process or its node."""

    def __init__(self, ray: Any, runs: Sequence[StudyRun], at_once: int | None, work: Work) -> None:
        self._ray, self._work = ray, work
        self._waiting = list(reversed(runs))
        self._at_once = at_once
        self._under_way: dict[Any, StudyRun] = {}
        self._lost_processes, self._lost_nodes = Counter[str](), Counter[str]()
        # Retries are decided here, since Ray's own count nodes and processes alike.
        self._task = ray.remote(max_retries=0, num_cpus=1)(_run_on_node)
        self._versions = _running_versions()

    def results(self) -> Iterator[tuple[StudyRun, _Result]]:
        """Results of the runs as they arrive."""
        while self._waiting or self._under_way:
            self._submit()
            done, _ = self._ray.wait(list(self._under_way))
            for task in done:
                run = self._under_way.pop(task)
                result = self._result(task, run)
                if result is None:
                    self._waiting.append(run)
                else:
                    yield run, result

    def _submit(self) -> None:
        """Keep enough tasks in progress that no processor waits, including nodes that are still starting."""
        limit = self._at_once or 2 * max(1, int(self._ray.cluster_resources().get("CPU", 1)))
        while self._waiting and len(self._under_way) < limit:
            run = self._waiting.pop()
            task = self._task.remote(self._work, run.scenario, run.seed, deciding_files(run.scenario), self._versions)
            self._under_way[task] = run

    def _result(self, task: Any, run: StudyRun) -> _Result | None:
        """Result of a finished task; None if it must be run again."""
        errors = self._ray.exceptions
        try:
            found = self._ray.get(task)
        except (errors.WorkerCrashedError, errors.OutOfMemoryError):
            self._lost_processes[run.key] += 1
            return _failed(PROCESS_DIED) if self._lost_processes[run.key] == _MOST_PROCESSES else None
        except (errors.NodeDiedError, errors.ObjectLostError):
            self._lost_nodes[run.key] += 1
            return _failed("the nodes that ran it died") if self._lost_nodes[run.key] == _MOST_NODES else None
        except errors.RayError as error:
            # FogSim is missing or cannot be imported: otherwise no run would end.
            last = str(error).strip().splitlines()[-1]
            raise InputError(f"a node of the Ray cluster cannot run FogSim: {last}; {_SAME}") from error
        if not isinstance(found, _Result):
            raise InputError(found)
        return found


def _failed(message: str) -> _Result:
    return _Result(failure(message), None)


def _run_on_node(
    work: Work, scenario: Scenario, seed: int, files: Mapping[str, str], wanted: Mapping[str, str | None]
) -> _Result | str:
    """Run in a process of a node; return the result, or what makes the node unfit for it."""
    unfit = _unfitness(scenario, files, wanted)
    if unfit is not None:
        return unfit
    with tempfile.TemporaryDirectory(prefix="fogsim-") as folder:
        outputs = Path(folder, "outputs")
        outcome = work(scenario, seed, outputs)
        there = {path.name: path.read_bytes() for path in sorted(outputs.iterdir())} if outputs.is_dir() else None
    return _Result(outcome, there)


def _unfitness(scenario: Scenario, files: Mapping[str, str], wanted: Mapping[str, str | None]) -> str | None:
    """What this node lacks to produce the same results as elsewhere."""
    node = f"the node {platform.node()} of the Ray cluster"
    for name, version in _running_versions().items():
        if version != wanted[name]:
            return f"{node} has {name} {version}, this machine {wanted[name]}; {_SAME}"
    try:
        there = deciding_files(scenario)
    except (FogSimError, OSError) as error:
        return f"{node}: {error}; {_SAME}"
    for name, digest in files.items():
        if there.get(name) != digest:
            how = "has another" if name in there else "does not have"
            return f"{node} {how} {scenario.directory / name}; {_SAME}"
    return None


def deciding_files(scenario: Scenario) -> dict[str, str]:
    """Digests of a scenario's SUMO files, and versions of its methods that are not FogSim's, by name."""
    return {**file_digests(scenario), **build.own_methods(scenario)}


def _running_versions() -> dict[str, str | None]:
    """Versions that a run's numbers depend on."""
    return {name: versions().get(name) for name in ("fogsim", "libsumo")}


def _import_ray() -> Any:
    # Send no usage statistics to Ray's makers.
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    try:
        import ray  # noqa: PLC0415 - an extra, and a second to import
    except ImportError as error:
        raise MissingDependencyError(f"--engine ray needs Ray ({error}): pip install 'fogsim[ray]'") from error
    return ray


@contextlib.contextmanager
def _connection(ray: Any, address: str, processes: int | None) -> Iterator[None]:
    """Connection to a cluster; its end ends the running tasks."""
    local = address == "local"
    if not local:
        _refuse_silence(address)
    handler = signal.getsignal(signal.SIGTERM)
    try:
        ray.init(
            address=address,
            num_cpus=processes if local else None,
            include_dashboard=False if local else None,
            log_to_driver=False,
            logging_level=logging.CRITICAL,
        )
    except (ConnectionError, RuntimeError, ValueError) as error:
        raise InputError(f"no Ray cluster could be used at {shown(address)}: {_first_line(error)}") from error
    # Ray handles SIGTERM itself.
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, handler)
    try:
        yield
    except ray.exceptions.RaySystemError as error:
        raise SimulationError(f"the Ray cluster was lost: {_first_line(error)}; the same command goes on") from error
    finally:
        ray.shutdown()


def _refuse_silence(address: str) -> None:
    """Raise InputError if no Ray answers at an address; Ray itself would try for two minutes and end the process."""
    if address == "auto":
        return
    host, _, port = address.rpartition(":")
    if not host or "/" in host or not port.isdecimal():
        raise InputError(
            f"--address {shown(address)} is none of a Ray cluster: expected HOST:PORT (its head, from a node of it), "
            "auto (the cluster of this machine) or local (a new one on this machine)"
        )
    try:
        socket.create_connection((host, int(port)), _CONNECTION_TIME).close()
    except (OSError, OverflowError) as error:
        raise InputError(f"no Ray cluster answers at {address}: {error}") from error
    command = [sys.executable, "-P", "-m", "ray.scripts.scripts", "health-check", "--address", address]
    try:
        subprocess.run(command, capture_output=True, timeout=_ANSWER_TIME, check=True)  # noqa: S603 - Ray's own, a checked address
    except subprocess.SubprocessError as error:
        raise InputError(f"what answers at {address} is no Ray cluster of this version of Ray") from error


def _first_line(error: BaseException) -> str:
    return next(iter(str(error).strip().splitlines()), type(error).__name__)
