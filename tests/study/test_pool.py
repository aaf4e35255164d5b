import io
import json
import multiprocessing
import os
import re
import signal
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from fogsim.scenario import load_scenario
from fogsim.study import StudyRun
from fogsim.study.execution import result_file
from fogsim.study.pool import ProcessPool, _end
from tests.helpers.command import run_python

SCENARIO = load_scenario("motorway_fog_bank")
WORK = """
import os, signal
def work(scenario, seed, folder):
    mark = folder.with_suffix(".begun")
    if seed == 3 or (seed == 1 and not mark.exists()):
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return {"status": "complete", "seed": seed, **({"message": "odd"} if seed == 2 else {})}
"""
"""Seed 3 kills its process always, seed 1 the first time."""


def test_a_process_that_dies_costs_no_other_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    name = f"work_of_{tmp_path.name.replace('-', '_')}"
    (tmp_path / f"{name}.py").write_text(WORK, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    work = __import__(name).work
    runs = [StudyRun(seed, {"policy": "none"}, seed, SCENARIO, f"k{seed}") for seed in range(5)]
    told: dict[int, str | None] = {}
    ProcessPool(2, work).run(runs, tmp_path, lambda run, message: told.update({run.seed: message}))
    assert told == {0: None, 1: None, 2: "odd", 3: "the process that ran it died", 4: None}
    for run in runs:
        status = json.loads(result_file(tmp_path, run).read_text(encoding="utf-8"))["status"]
        assert status == ("failed" if run.seed == 3 else "complete")
    sys.modules.pop(name)


def test_ctrl_c_ends_all_processes_and_keeps_what_is_done(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "slow_work.py").write_text(
        WORK.replace("seed == 3 or (seed == 1 and not mark.exists())", "False").replace(
            "    return", "    import time; time.sleep(0 if seed == 0 else 60)\n    return"
        ),
        encoding="utf-8",
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    runs = [StudyRun(seed, {}, seed, SCENARIO, f"k{seed}") for seed in range(3)]

    def interrupt(run: StudyRun, _: str | None) -> None:
        raise KeyboardInterrupt

    stranger = multiprocessing.get_context("spawn").Process(target=time.sleep, args=(600,), daemon=True)
    stranger.start()
    with pytest.raises(KeyboardInterrupt):
        ProcessPool(2, __import__("slow_work").work).run(runs, tmp_path, interrupt)
    assert stranger.is_alive()
    stranger.kill()
    stranger.join()
    assert result_file(tmp_path, runs[0]).exists()
    assert not result_file(tmp_path, runs[1]).exists()


def test_a_signal_waits_until_a_process_has_started(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    submitted: list[int] = []

    def submit(_: ProcessPoolExecutor, __: Any, ___: Any, seed: int, ____: Path, _____: Any) -> None:
        signal.raise_signal(signal.SIGINT)
        submitted.append(seed)

    monkeypatch.setattr(ProcessPoolExecutor, "submit", submit)
    runs = [StudyRun(seed, {}, seed, SCENARIO, f"k{seed}") for seed in range(2)]
    with pytest.raises(KeyboardInterrupt):
        ProcessPool(2).run(runs, tmp_path, lambda *_: None)
    assert submitted == [0]


def test_a_thread_that_a_method_leaves_keeps_no_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "lingering_work.py").write_text(
        "import threading, time\ndef work(scenario, seed, folder):\n"
        "    late = lambda: (time.sleep(60), folder.touch())\n    threading.Thread(target=late).start()\n"
        "    return {}\n",
        encoding="utf-8",
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    run = StudyRun(0, {}, 0, SCENARIO, "k0")
    ProcessPool(1, __import__("lingering_work").work).run([run], tmp_path, lambda *_: None)
    assert not result_file(tmp_path, run).with_suffix("").exists()


def test_a_process_ends_even_if_its_output_cannot_be_written(monkeypatch: pytest.MonkeyPatch) -> None:
    ended: list[int] = []
    monkeypatch.setattr(os, "_exit", ended.append)
    closed = io.TextIOWrapper(io.BytesIO())
    closed.close()
    monkeypatch.setattr(sys, "stdout", closed)
    with pytest.raises(ValueError, match="closed file"):
        _end()
    assert ended == [0]


def test_the_death_of_the_server_of_processes_costs_no_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    submit, dead = ProcessPoolExecutor.submit, [EOFError(), ConnectionRefusedError()]

    def submitted(pool: ProcessPoolExecutor, *call: Any) -> Any:
        if dead:
            raise dead.pop()
        return submit(pool, *call)

    monkeypatch.setattr(ProcessPoolExecutor, "submit", submitted)
    (tmp_path / "plain_work.py").write_text("def work(scenario, seed, folder):\n    return {}\n", encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    runs = [StudyRun(seed, {}, seed, SCENARIO, f"k{seed}") for seed in range(2)]
    told: list[int] = []
    work = __import__("plain_work").work
    ProcessPool(1, work).run(runs, tmp_path, lambda run, _: told.append(run.seed))
    assert told == [0, 1]


SCRIPT = """
from fogsim.study.pool import worker_pool

def begin():
    with worker_pool(1, "fogsim.study.execution"):
        print("begun")

{guard}begin()
"""


@pytest.mark.parametrize("guard", ["", 'if __name__ == "__main__": '])
def test_a_script_that_each_process_would_run_again_is_refused(tmp_path: Path, guard: str) -> None:
    (tmp_path / "script.py").write_text(SCRIPT.format(guard=guard))
    done = run_python("script.py", cwd=tmp_path, check=bool(guard))
    refusal = r'script.py:8: processes that are started here run this script again: .* if __name__ == "__main__":'
    assert done.stdout.strip() == ("begun" if guard else "")
    assert bool(re.search(refusal, done.stderr)) != bool(guard)
