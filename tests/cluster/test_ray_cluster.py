"""Studies on a real Ray cluster of two nodes, both on this machine. `make cluster` installs Ray and runs this."""

import os
import socket
import threading
import time
import warnings
from collections.abc import Iterator
from pathlib import Path

import node_work
import pytest
import ray
from ray.cluster_utils import Cluster

from fogsim.errors import InputError
from fogsim.study import RayCluster, Row, Study, StudyRun, load_study, run_study
from fogsim.study.directory import StudyDirectory
from fogsim.study.execution import RunWatch
from fogsim.study.table import write_table

FILES = ("study.json", "study.parquet", "study.csv", "comparison.csv", "report.html")
STUDY = """
sumocfg: {town}/grid.sumocfg
ego: veh18
settings: [duration_s=3, fog.visibility_m=80, 'traffic.sumo_options={{summary-output: summary.xml}}']
factors:
  policy:
    none: [advice=none]
    fixed: ['advice={{method: fixed_speed, parameters: {{speed: 5}}}}']
    late: [traffic.warm_up_limit_s=1]
seeds: 2
"""
TOWN = Path(__file__).parents[1] / "data" / "grid"


@pytest.fixture(scope="module")
def marks(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Folder in which processes of the cluster leave word."""
    folder = tmp_path_factory.mktemp("marks")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("FOGSIM_TEST_MARKS", str(folder))
        # As the nodes of a real cluster have modules that its users have installed.
        patch.setenv("PYTHONPATH", f"{Path(__file__).parent}:{os.environ.get('PYTHONPATH', '')}")
        patch.setenv("RAY_USAGE_STATS_ENABLED", "0")
        yield folder


@pytest.fixture(scope="module")
def cluster(marks: Path) -> Iterator[Cluster]:
    """Two nodes of one processor each."""
    with warnings.catch_warnings():
        # Ray leaves files and sockets of its own to the collector of garbage.
        warnings.simplefilter("ignore", ResourceWarning)
        made = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
        made.add_node(num_cpus=1)
        made.wait_for_nodes()
        yield made
        made.shutdown()


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    path = tmp_path_factory.mktemp("study") / "mine.yaml"
    path.write_text(STUDY.format(town=TOWN), encoding="utf-8")
    return load_study(path)


@pytest.fixture(scope="module")
def from_pool(study: Study, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """What the processes of this machine make of it."""
    out = tmp_path_factory.mktemp("pool") / "out"
    rows = run_study(study, out, processes=1)
    assert [row["status"] for row in rows] == ["complete"] * 4 + ["failed"] * 2
    return contents(out)


def contents(out: Path) -> dict[str, bytes]:
    """Content of a study's files by name, of the runs' too; SUMO notes the time of day in its own."""
    files = {str(path.relative_to(out)): path for path in sorted(out.rglob("*")) if path.is_file()}
    return {name: b"" if path.name == "summary.xml" else path.read_bytes() for name, path in files.items()}


def tabulated(study: Study, engine: RayCluster, out: Path, watch: RunWatch = lambda _run, _message: None) -> list[Row]:
    """Run what is missing and write the table, without the report, which takes its time."""
    directory = StudyDirectory(out, study)
    engine.run(directory.missing(), directory.results, watch)
    write_table(directory.rows(), out)
    return directory.rows()


def on_cluster(cluster: Cluster, work: object = None) -> RayCluster:
    return RayCluster(cluster.address) if work is None else RayCluster(cluster.address, work=work)  # type: ignore[arg-type]  # one of node_work


def test_two_nodes_make_what_the_pool_makes(
    cluster: Cluster, study: Study, from_pool: dict[str, bytes], tmp_path: Path
) -> None:
    told: list[tuple[int, bool]] = []
    run_study(study, tmp_path / "out", engine=on_cluster(cluster), watch=lambda n, m: told.append((n, m is not None)))
    made = contents(tmp_path / "out")
    assert made.keys() == from_pool.keys()
    assert [name for name in made if made[name] != from_pool[name]] in ([], ["report.html"])
    assert {*FILES, f"runs/{study.runs[0].key}/summary.xml"} < set(from_pool)
    assert [number for number, _ in told] == list(range(7))
    assert sum(failed for _, failed in told) == 2
    assert not ray.is_initialized()


def test_a_killed_process_costs_only_time(
    cluster: Cluster, study: Study, from_pool: dict[str, bytes], tmp_path: Path, marks: Path
) -> None:
    tabulated(study, on_cluster(cluster, node_work.killed_once), tmp_path / "out")
    assert (marks / "killed").exists()
    assert contents(tmp_path / "out").items() <= from_pool.items()


def test_a_run_whose_process_dies_again_has_failed_alone(cluster: Cluster, study: Study, tmp_path: Path) -> None:
    rows = tabulated(study, on_cluster(cluster, node_work.killed_always), tmp_path / "out")
    for row in rows:
        died = ("failed", "the process that ran it died")
        assert (row["status"], row["message"]) == (died if row["seed"] == 1 else ("complete", None))


def test_ctrl_c_keeps_what_is_done_and_ends_what_is_not(
    cluster: Cluster, study: Study, from_pool: dict[str, bytes], tmp_path: Path
) -> None:
    done: list[int] = []

    def interrupt(run: StudyRun, _: str | None) -> None:
        done.append(run.number)
        if len(done) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        tabulated(study, on_cluster(cluster), tmp_path / "out", interrupt)
    assert not ray.is_initialized()
    assert len(list((tmp_path / "out" / "runs").glob("*.json"))) == 2
    tabulated(study, on_cluster(cluster), tmp_path / "out", lambda run, _: done.append(run.number))
    # Of the two, those that failed as they should are tried again.
    assert sorted(set(done)) == list(range(6))
    assert contents(tmp_path / "out").items() <= from_pool.items()


def test_a_node_with_other_files_is_refused(cluster: Cluster, study: Study, tmp_path: Path) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("fogsim.study.ray_cluster.deciding_files", lambda _: {"grid.net.xml": "of old"})
        with pytest.raises(InputError, match=r"has another .*grid\.net\.xml; a study on Ray needs"):
            tabulated(study, on_cluster(cluster), tmp_path / "out")


def test_what_answers_and_is_no_ray_is_refused(study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fogsim.study.ray_cluster._ANSWER_TIME", 3.0)
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"127.0.0.1:{server.getsockname()[1]}"
        with pytest.raises(InputError, match=rf"what answers at {address} is no Ray cluster"):
            tabulated(study, RayCluster(address), tmp_path / "out")


def test_a_killed_node_costs_only_time(
    cluster: Cluster, study: Study, from_pool: dict[str, bytes], tmp_path: Path, marks: Path
) -> None:
    (node,) = cluster.worker_nodes
    killed: list[bool] = []

    def kill_node() -> None:
        deadline = time.monotonic() + 60.0
        while not (marks / f"on {node.node_id}").exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        killed.append((marks / f"on {node.node_id}").exists())
        cluster.remove_node(node, allow_graceful=False)
        (marks / "go on").touch()

    killer = threading.Thread(target=kill_node)
    killer.start()
    tabulated(study, on_cluster(cluster, node_work.held), tmp_path / "out")
    killer.join()
    assert killed == [True]
    assert contents(tmp_path / "out").items() <= from_pool.items()
