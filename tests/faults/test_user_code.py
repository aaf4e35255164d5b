"""Methods of a user's own that misbehave, and files that name what is none: kinds of fault by the ways in."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from early_motorway import ROUTES

from fogsim import Camera, Frame, Observation, SecondView, load_scenario
from fogsim.advice import ADVISERS
from fogsim.errors import InputError, MethodError
from fogsim.simulation import chosen_methods
from fogsim.study.execution import run_outcome
from fogsim.testing.execution import ThisProcess
from fogsim.values.image import for_kernels
from tests.helpers.command import Command

ROOT = Path(__file__).parents[2]

MINE = """
import sys, time
from typing import NamedTuple
from fogsim import Estimate, SpeedAdvice

class Base:
    def __init__(self, camera):
        self.method = f"mine:{type(self).__name__}"
    def reset(self):
        pass
    def update(self, observation):
        return Estimate(self.method, 0.05, 0.005)

class Fine(Base):
    def update(self, observation):
        try:
            return self.fails()
        except ValueError:  # of its own, and none of FogSim's business
            return super().update(observation)
    def fails(self):
        raise ValueError

class ExitsInUpdate(Base):
    def update(self, observation):
        sys.exit(0)  # ExitsInUpdate

class FailsInUpdate(Base):
    def update(self, observation):
        raise ValueError("boom")  # FailsInUpdate

class FailsInReset(Base):
    def reset(self):
        raise ValueError("boom")  # FailsInReset

class ExitsInConstructor(Base):
    def __init__(self, camera):
        sys.exit(0)  # ExitsInConstructor

class TakesNoCamera(Base):
    def __init__(self):  # TakesNoCamera
        pass

class PaintsTheFrame(Base):
    def update(self, observation):
        observation.frame.image[:] = 0  # PaintsTheFrame
        return super().update(observation)

class Dawdles(Base):
    def update(self, observation):
        while True:
            try:
                time.sleep(0.01)
            except Exception:
                pass

class ExitsInProperty(Base):
    def __init__(self, camera):
        pass
    @property
    def method(self):
        sys.exit(0)  # ExitsInProperty

class ExitsInAdvise:
    def advise(self, belief, speed_limit, time, previous):
        sys.exit(0)

class Tuple(NamedTuple):
    speed: float = 20.0
    def advise(self, belief, speed_limit, time, previous):
        return SpeedAdvice(self.speed)
"""

SCENARIO = f"""
name: short
traffic: {{net: {ROOT}/scenarios/motorway_fog_bank/motorway.net.xml, routes: [{ROUTES}], ego: ego}}
duration: 1 s
clocks: {{camera_period: 0.5 s, decision_period: 0.5 s}}
camera: {{width: 64, height: 48}}
fog: {{visibility: 60 m}}
sut: {{estimators: [NAME], advice: none}}
expect: {{safe: {{never: ego.collision}}}}
"""

STUDY = """
scenario: short.fog.yaml
frames: always
factors: {fog: {thick: [fog.visibility_m=50]}}
seeds: 1
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "mine.py").write_text(MINE)
    (tmp_path / "study.yaml").write_text(STUDY)
    return tmp_path


MISBEHAVING = {
    "ExitsInUpdate": "update() failed: SystemExit: 0, at",
    "FailsInUpdate": "update() failed: ValueError: boom, at",
    "FailsInReset": "reset() failed: ValueError: boom, at",
    "ExitsInConstructor": "its constructor failed: SystemExit: 0, at",
    "TakesNoCamera": "failed: TypeError: TakesNoCamera.__init__() takes 1 positional argument but 2 were given, at",
    "PaintsTheFrame": "update() failed: ValueError: assignment destination is read-only, at",
    "ExitsInProperty": "method failed: SystemExit: 0, at",
}


def place_of(name: str, folder: Path) -> str:
    """File and line at which a class misbehaves."""
    line = next(i for i, text in enumerate(MINE.splitlines(), 1) if text.endswith(f"# {name}"))
    return f"{folder / 'mine.py'}:{line}"


@pytest.mark.parametrize("name", MISBEHAVING)
def test_a_method_that_misbehaves_is_told_with_its_place(folder: Path, name: str) -> None:
    (folder / "short.fog.yaml").write_text(SCENARIO.replace("NAME", f"'mine:{name}'"))
    config = load_scenario(folder / "short.fog.yaml").run_config()
    with pytest.raises(MethodError, match=re.escape(f"{MISBEHAVING[name]} {place_of(name, folder)}")):  # noqa: PT012 - in any of these
        (estimator,) = chosen_methods.estimators(config.estimators, config.camera.assumed_on())
        estimator.reset()
        estimator.update(Observation(Frame(0.0, np.zeros((48, 64, 3), np.uint8), config.camera.assumed_on())))


def test_a_run_of_a_method_that_misbehaves_has_failed(folder: Path, command: Command) -> None:
    name = "ExitsInUpdate"
    (folder / "short.fog.yaml").write_text(SCENARIO.replace("NAME", f"'mine:{name}'"))
    told = f"{MISBEHAVING[name]} {place_of(name, folder)}"
    done = command("run", "short.fog.yaml", "--out", "out", "--no-video", "--no-report", cwd=folder)
    assert done.returncode == 1
    assert told in done.stderr.replace("\n", "")
    assert f"importing: {folder / 'mine.py'}" in done.stderr.replace("\n", "")
    manifest = json.loads((folder / "out" / "manifest.json").read_text())
    assert (manifest["status"], told in manifest["message"]) == ("failed", True)


@pytest.mark.parametrize("command_line", ["test short.fog.yaml --no-evidence", "study study.yaml"])
def test_tests_and_studies_fail_and_say_why(
    folder: Path, command: Command, monkeypatch: pytest.MonkeyPatch, command_line: str
) -> None:
    monkeypatch.setattr("fogsim.study.pool.ProcessPool", lambda _, work: ThisProcess(work))
    monkeypatch.setattr("fogsim.study.ProcessPool", lambda _: ThisProcess(run_outcome))
    (folder / "short.fog.yaml").write_text(SCENARIO.replace("NAME", "'mine:ExitsInUpdate'"))
    done = command(*command_line.split(), "-j", "1", "--out", "out", cwd=folder)
    assert done.returncode == 1
    assert "estimator 'mine:ExitsInUpdate': update() failed" in done.stdout.replace("\n", "")


def test_others_read_and_record_what_the_camera_took(folder: Path) -> None:
    image = np.full((4, 4, 3), 7, np.uint8)
    camera = Camera(width=4, height=4, focal_length=4, principal_point=(2, 2), mount_height=1.3, pitch=0.0)
    observation = Observation(Frame(0.0, image, camera), right=SecondView(image, 0.5))
    for array in (observation.image, observation.right.image, Observation(image).image):
        with pytest.raises(ValueError, match="read-only"):
            array[:] = 0
    image[:] = 9  # the caller's own stays theirs
    assert image.flags.writeable


def test_pixels_that_cannot_be_written_are_read_by_the_usual_kernels() -> None:
    fixed = np.frombuffer(bytes(range(48)), np.uint8).reshape(4, 4, 3)
    for image in (fixed, Observation(fixed).image, Observation(np.zeros((4, 4, 3), np.uint8)).image):
        assert not image.flags.writeable
        given = for_kernels(image)
        assert given.flags.writeable
        assert (given == image).all()


def test_methods_may_catch_their_own_errors_and_be_named_tuples(folder: Path) -> None:
    (folder / "short.fog.yaml").write_text(SCENARIO.replace("NAME", "'mine:Fine'"))
    advice = "advice={method: 'mine:Tuple', parameters: {speed: 11.0}}"
    config = load_scenario(folder / "short.fog.yaml", [advice]).run_config()
    (estimator,) = chosen_methods.estimators(config.estimators, config.camera.assumed_on())
    assert estimator.update(Observation(np.zeros((48, 64, 3), np.uint8))).extinction == 0.05
    assert chosen_methods.adviser(config.advice.adviser).speed == 11.0
    with pytest.raises(MethodError, match=r"'mine:ExitsInAdvise': advise\(\) failed: SystemExit: 0, at .*mine.py"):
        ADVISERS.find("mine:ExitsInAdvise", folder)().advise(None, 30.0, 0.0, None)


def test_a_method_changes_the_working_directory_for_itself_alone(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And one that removes it fails not for that."""
    text = "import os\nos.chdir('/')\nclass Method:\n    def advise(self, *_):\n        os.chdir('/')\n"
    (folder / "wandering.py").write_text(text)
    monkeypatch.chdir(folder)
    method = ADVISERS.find("wandering:Method", folder)()
    assert Path.cwd().samefile(folder)
    method.advise(None, 30.0, 0.0, None)
    assert Path.cwd().samefile(folder)
    text = "import os, pathlib\nclass Method:\n    def advise(self, *_):\n        pathlib.Path.cwd().rmdir()\n"
    (folder / "leaving.py").write_text(text)
    (folder / "here").mkdir()
    monkeypatch.chdir(folder / "here")
    ADVISERS.find("leaving:Method", folder)().advise(None, 30.0, 0.0, None)


def test_a_call_that_takes_too_long_fails_the_run(folder: Path, command: Command) -> None:
    (folder / "short.fog.yaml").write_text(SCENARIO.replace("NAME", "'mine:Dawdles'"))
    done = command("run", "short.fog.yaml", "--out", "out", "--method-timeout", "0.2", cwd=folder)
    assert done.returncode == 1
    told = "estimator 'mine:Dawdles': update() failed: TimeLimitError: took longer than 0.2 s, at"
    assert told in done.stderr.replace("\n", "")
    assert json.loads((folder / "out" / "manifest.json").read_text())["status"] == "failed"


FILES = {
    "os:system": "there is no os.py in",
    "subprocess:Popen": "there is no subprocess.py in",
    "builtins:object": "there is no builtins.py in",
    "numpy.ma:MaskedArray": "there is no numpy/ma.py in",
    "os.path:PurePath": "there is no os/path.py in",
    "borrowed:OrderedDict": "expected a class defined in .*, got one of collections",
    "borrowed:make": "expected a class, got <function make",
}


def test_only_classes_beside_the_scenario_are_methods(folder: Path) -> None:
    for name, told in FILES.items():
        for kind in ["estimators", "fusion", "advice", "lighting"]:
            (folder / "borrowed.py").write_text("from collections import OrderedDict\ndef make(): pass\n")
            (folder / "short.fog.yaml").write_text(SCENARIO.replace("NAME", "joint_road"))
            written = f"['{name}']" if kind == "estimators" else f"'{name}'"
            with pytest.raises(InputError, match=told):
                load_scenario(folder / "short.fog.yaml", [f"{kind}={written}"])


@pytest.mark.parametrize(
    ("name", "told"),
    [("ran:Method", ""), ("ran:Metod", "no Metod in .*ran.py; did you mean 'Method'"), ("rain:M", "no rain")],
)
def test_validate_runs_no_code_unless_it_is_allowed(folder: Path, command: Command, name: str, told: str) -> None:
    touches = "import pathlib\npathlib.Path(__file__).with_name('ran').touch()\nclass Method: pass\n"
    (folder / "ran.py").write_text(touches)
    (folder / "short.fog.yaml").write_text(SCENARIO.replace("NAME", f"'{name}'"))
    for line in ("validate short.fog.yaml", "new other --from short.fog.yaml", "signs short.fog.yaml"):
        done = command(*line.split(), cwd=folder)
        assert (done.returncode, re.search(told, done.stderr) is not None) == (2 if told else 0, True)
    assert command("study", "study.yaml", "--check", cwd=folder).returncode == (2 if told else 0)
    assert not (folder / "ran").exists()
    done = command("validate", "--allow-code", "short.fog.yaml", cwd=folder)
    assert done.returncode == 2
    if not told:
        assert "must have a method update() and reset()" in done.stderr
        assert (folder / "ran").exists()


@pytest.mark.parametrize("text", ["import sys\nsys.exit(0)", "raise BaseException", "import time\ntime.sleep('x')"])
def test_a_module_that_ends_the_program_is_bad_input(folder: Path, command: Command, text: str) -> None:
    (folder / "ends.py").write_text(f"{text}\nclass Method: pass\n")
    (folder / "short.fog.yaml").write_text(SCENARIO.replace("NAME", "'ends:Method'"))
    done = command("run", "short.fog.yaml", "--out", "out", cwd=folder)
    assert done.returncode == 2
    assert "ends:Method: its import fails: " in done.stderr
    assert not (folder / "out").exists()
