"""``fogsim test`` from file to exit code, and the plug-in for pytest."""

import errno
import json
import os
from pathlib import Path
from typing import Any

import pytest
from early_motorway import ROUTES

from fogsim.core.files.writer_lock import LOCK_NAME
from fogsim.errors import InputError
from fogsim.testing import artefacts, check_one_case
from fogsim.testing.execution import ThisProcess
from tests.helpers.command import Command

pytest_plugins = ["pytester"]

ROOT = Path(__file__).parents[2]

SCENARIO = f"""
name: short
traffic: {{net: {ROOT}/scenarios/motorway_fog_bank/motorway.net.xml, routes: [{ROUTES}], ego: ego}}
duration_s: 1.5
renderer: none
estimators: []
fog: {{visibility: $visibility}}
advice: {{method: stopping_sight_distance, informed_by: truth}}
expect:
  slower: {{eventually: ego.speed < 92 km/h}}
  safe: {{never: ego.collision}}
  stops: {{whenever: ego.speed falls below 5 km/h, require: advice < 50 km/h}}
vary: {{visibility: [60 m, 5 km]}}
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    (tmp_path / "short.fog.yaml").write_text(SCENARIO)
    return tmp_path / "short.fog.yaml"


def test_a_sweep_from_file_to_exit_code(file: Path, command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    # The command lines in the docs are run in processes of their own.
    monkeypatch.setattr("fogsim.study.pool.ProcessPool", lambda _, work: ThisProcess(work))
    monkeypatch.setattr("fogsim.testing.artefacts.ProcessPool", lambda _, work: ThisProcess(work))
    locked, keep = [], artefacts.keep_artefacts

    def watched(outcomes: Any, out: Path, *rest: Any) -> Any:
        locked.append((out / LOCK_NAME).exists())
        return keep(outcomes, out, *rest)

    monkeypatch.setattr(artefacts, "keep_artefacts", watched)
    done = command("test", str(file), "-j", "1", "--junit", "ci/j.xml", "--html", "ci/page.html", cwd=file.parent)
    assert done.returncode == 1, done.stderr
    assert locked == [True], "evidence is gathered under the lock of the results"
    lines = [line.strip() for line in done.stdout.splitlines()]
    told = "slower.eventually: 1 of 2 cases passed; visibility=5 km: expected eventually ego.speed < 92 km/h"
    assert any(line.startswith("FAILED") and told in line for line in lines)
    assert f"fogsim test {file} --case 'visibility=5 km'" in lines
    assert any(line.startswith("PASSED       safe.never: ") and "2 of 2 cases passed" in line for line in lines)
    assert any(line.startswith("INCONCLUSIVE stops.whenever: 2 of 2 cases inconclusive") for line in lines)
    assert any(line.startswith("1 passed, 1 failed, 1 inconclusive; 2 runs of 1 file in") for line in lines)
    assert sum(line.startswith("::error file=") for line in lines) == 2
    page = (file.parent / "ci" / "page.html").read_text(encoding="utf-8")
    assert "data:image/svg+xml" in page
    assert next(line for line in lines if line.startswith("1 passed, 1 failed")) in page
    assert (file.parent / "ci" / "j.xml").is_file()
    session = json.loads((file.parent / "runs" / "tests" / "session.json").read_text())
    assert session["not_passed"] == {str(file): ["visibility=60 m", "visibility=5 km"]}


def test_reports_are_written_though_the_output_is_not_read(
    file: Path, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fogsim.study.pool.ProcessPool", lambda _, work: ThisProcess(work))

    def closed(*_: object) -> None:
        raise BrokenPipeError(errno.EPIPE, "Broken pipe")

    monkeypatch.setattr("fogsim.cli.test._print_outcome", closed)
    command("test", str(file), "--no-evidence", "--junit", "j.xml", "--html", "page.html", cwd=file.parent)
    reports = [file.parent / "j.xml", file.parent / "page.html"]
    assert all(report.is_file() for report in reports)
    # A call that fails leaves none of an earlier one, nor removes a file that is no report.
    for junit in ("j.xml", file.name):
        done = command("test", "none.fog.yaml", "--junit", junit, "--html", "page.html", cwd=file.parent)
        assert done.returncode == 2
    assert not any(report.exists() for report in reports)
    assert file.is_file()


def test_bad_input_and_no_tests_have_their_codes(file: Path, command: Command) -> None:
    folder = file.parent
    for arguments, code, told in (
        ([str(file), "--case", "visiblity=60 m"], 2, "varies no visiblity; did you mean 'visibility'?"),
        ([str(file), "-k", "safe and"], 2, "expected a word, got the end"),
        ([str(file), "-k", "night"], 5, "No tests: no selected expectation in 1 file."),
        ([str(folder / "none.fog.yaml")], 2, "there is no such scenario file"),
        ([str(folder / "empty")], 5, "No tests: no selected expectation in 0 files."),
    ):
        (folder / "empty").mkdir(exist_ok=True)
        done = command("test", *arguments, cwd=folder)
        assert done.returncode == code
        assert told in done.stdout + done.stderr


BROKEN = """
class Broken:
    def advise(self, belief, speed_limit, time, previous):
        raise RuntimeError("no advice")
"""


def test_a_run_that_fails_is_told_with_its_place(file: Path, command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fogsim.study.pool.ProcessPool", lambda _, work: ThisProcess(work))
    (file.parent / "mine.py").write_text(BROKEN)
    # The case that does not stand in the file is named like those that do.
    wanted = ["--case", "visibility=70 m", "--set", "advice={method: 'mine:Broken', informed_by: truth}"]
    done = command("test", str(file), *wanted, "--no-evidence", cwd=file.parent)
    assert done.returncode == 1
    told = f"adviser 'mine:Broken': advise() failed: RuntimeError: no advice, at {file.parent / 'mine.py'}:4"
    assert f"the run went wrong: visibility=70 m: {told}" in done.stdout
    assert "1 error; 1 run of 1 file" in done.stdout


def test_one_case_in_this_process(file: Path) -> None:
    result = check_one_case(file, ["duration_s=0.3"], "visibility=5 km", seed=3)
    assert [(one.name, str(one.verdict)) for one in result.findings] == [
        ("slower", "failed"),
        ("safe", "passed"),
        ("stops", "inconclusive"),
    ]
    assert (result.run.seed, result.is_passed, result.has_failed) == (3, False, True)
    assert result.metrics["ego_collisions"] == 0


PYTHON_TEST = """
def test_it(fogsim_run):
    result = fogsim_run("short.fog.yaml", "duration_s=0.3", case="visibility=5 km")
    assert [one.name for one in result.findings if str(one.verdict) == "passed"] == ["safe"]
"""


def test_pytest_collects_files_and_runs(file: Path, pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    # What is imported within is forgotten afterwards, so that SUMO must have been there before.
    check_one_case(file, ["duration_s=0.3"])
    (file.parent / "bad.fog.yaml").write_text(SCENARIO.replace("never", "nevr"))
    (file.parent / "test_it.py").write_text(PYTHON_TEST)
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    monkeypatch.chdir(file.parent)
    options = ["-p", "fogsim.cli.pytest_plugin", "-p", "no:cacheprovider", "--fogsim-processes", "1", "-c", os.devnull]
    done = pytester.runpytest_inprocess(*options, "--continue-on-collection-errors", ".")
    done.assert_outcomes(passed=2, failed=2, errors=1)
    told = done.stdout.str()
    assert "expect.safe.nevr: unknown key; did you mean 'never'?" in told
    assert "failed: slower.eventually: 1 of 2 cases passed; visibility=5 km: expected" in told
    assert "short.fog.yaml --case 'visibility=5 km'" in told
    assert "inconclusive: stops.whenever" in told


def test_mistakes_in_pytest_have_no_traceback(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    (pytester.path / "short.fog.yaml").write_text(SCENARIO)
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    options = ["-p", "fogsim.cli.pytest_plugin", "-p", "no:cacheprovider", "-c", os.devnull, "short.fog.yaml"]
    done = pytester.runpytest_inprocess(*options, "--fogsim-processes", "-1")
    assert done.ret == pytest.ExitCode.USAGE_ERROR
    done.stderr.fnmatch_lines(["*--fogsim-processes: expected 1 … 1024, got '-1'*"])

    def refuse(*_: object) -> None:
        raise InputError("no space for results")

    monkeypatch.setattr("fogsim.testing.check_test", refuse)
    done = pytester.runpytest_inprocess(*options)
    done.assert_outcomes(failed=3)
    assert "no space for results" in done.stdout.str()
    assert "pytest_plugin.py" not in done.stdout.str()
