"""What is refused before any Ray is asked; the rest is in tests/cluster."""

import sys
import types
from pathlib import Path

import pytest

from fogsim.errors import InputError, MissingDependencyError
from fogsim.scenario import load_scenario
from fogsim.scenario.starting import begin_scenario
from fogsim.study import RayCluster, StudyRun, run_study
from fogsim.study.ray_cluster import _running_versions, _unfitness, deciding_files
from tests.helpers.command import Command

SCENARIO = load_scenario("motorway_fog_bank")
RUN = StudyRun(0, {}, 0, SCENARIO, "key")
STUDY = "scenario: motorway_fog_bank\nfactors: {policy: {none: [advice=none]}}\nseeds: 1\n"


def test_without_ray_it_is_said_how_to_get_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(MissingDependencyError, match=r"pip install 'fogsim\[ray\]'"):
        RayCluster().run([RUN], tmp_path, lambda _run, _message: None)


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("nonsense", r"expected HOST:PORT"),
        ("ray://127.0.0.1:10001", r"expected HOST:PORT"),
        ("127.0.0.1:1", r"no Ray cluster answers at 127\.0\.0\.1:1: .*refused"),
        ("127.0.0.1:99999", r"no Ray cluster answers at 127\.0\.0\.1:99999: "),
    ],
)
def test_addresses_that_do_not_answer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, address: str, said: str) -> None:
    monkeypatch.setitem(sys.modules, "ray", types.ModuleType("ray"))
    with pytest.raises(InputError, match=said):
        RayCluster(address).run([RUN], tmp_path, lambda _run, _message: None)


def test_an_address_without_ray_is_refused(tmp_path: Path, command: Command) -> None:
    (tmp_path / "mine.yaml").write_text(STUDY, encoding="utf-8")
    ended = command("study", "mine.yaml", "--address", "127.0.0.1:6379", cwd=tmp_path)
    assert ended.returncode == 2
    assert "--address is a Ray cluster's: give --engine ray with it" in ended.stderr


def test_nodes_that_would_compute_something_else_are_named() -> None:
    files, here = deciding_files(SCENARIO), _running_versions()
    assert files
    assert _unfitness(SCENARIO, files, here) is None
    name = next(iter(files))
    assert f"has another {SCENARIO.directory / name}; a study on Ray needs" in str(
        _unfitness(SCENARIO, {**files, name: "old"}, here)
    )
    assert "does not have" in str(_unfitness(SCENARIO, {"more.xml": "0"}, here))
    assert "has fogsim" in str(_unfitness(SCENARIO, files, {**here, "fogsim": "0.0"}))


def test_a_node_with_another_file_of_a_method_is_named(tmp_path: Path) -> None:
    begin_scenario("mine", "motorway_fog_bank", tmp_path)
    method = tmp_path / "mine" / "mine.py"
    method.write_text("class Slow:\n    def advise(self, belief, speed_limit, time, previous): ...\n")
    scenario = load_scenario(tmp_path / "mine", ["advice=mine:Slow"])
    files, here = deciding_files(scenario), _running_versions()
    assert _unfitness(scenario, files, here) is None
    method.write_text(method.read_text() + "# other\n")
    assert f"has another {tmp_path / 'mine' / 'mine:Slow'};" in str(_unfitness(scenario, files, here))
    method.unlink()
    assert "there is no mine.py in" in str(_unfitness(scenario, files, here))


def test_processes_and_an_engine_are_one_too_many(tmp_path: Path) -> None:
    from fogsim.study import load_study

    (tmp_path / "mine.yaml").write_text(STUDY, encoding="utf-8")
    with pytest.raises(InputError, match="give either processes or an engine"):
        run_study(load_study(tmp_path / "mine.yaml"), tmp_path / "out", processes=1, engine=RayCluster())
