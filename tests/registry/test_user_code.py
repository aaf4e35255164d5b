import math
import sys
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from fogsim import Belief, InputError, LeadMeasurement, Observation, SpeedAdvice, load_scenario
from fogsim.advice import ADVISERS, VehicleAdviser
from fogsim.core.registry.user_code import import_class
from fogsim.errors import UnknownNameError
from fogsim.recorders import Manifest, Status
from fogsim.scenario import build
from fogsim.simulation import chosen_methods
from fogsim.values.belief import certain_belief

PLUGIN = Path(__file__).parents[1] / "data" / "adas_fog_plugin"


def test_an_object_of_a_module_beside_the_scenario_is_found_from_anywhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    adviser = ADVISERS.find("adas_fog:Cautious", PLUGIN)(headway=2.0)
    assert isinstance(adviser, VehicleAdviser)
    frame = np.zeros((4, 4, 3), np.uint8)
    near = Observation(frame, speed=20.0, lead=LeadMeasurement(30.0, 0.0))
    fog: Belief = certain_belief(math.log(20) / 100)
    assert adviser.advise_vehicle(fog, near, 36.0, 0.0, SpeedAdvice()).speed == pytest.approx(15.0)
    assert adviser.advise_vehicle(fog, Observation(frame), 36.0, 0.0, SpeedAdvice()).speed == pytest.approx(36.0)


def test_modules_of_one_name_in_two_folders_are_two(tmp_path):
    for folder, number in (("a", 1), ("b", 2)):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "mine.py").write_text(f"class Mine: number = {number}\n")
    assert import_class("mine:Mine", tmp_path / "a").number == 1
    assert import_class("mine:Mine", tmp_path / "b").number == 2
    assert "mine" not in sys.modules


def test_an_installed_package_announces_its_methods(tmp_path, monkeypatch):
    # What `pip install tests/data/adas_fog_plugin` leaves behind.
    info = tmp_path / "adas_fog-1.2.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: adas-fog\nVersion: 1.2.0\n")
    (info / "entry_points.txt").write_text("[fogsim.advice]\ncautious = adas_fog:Cautious\n")
    (tmp_path / "adas_fog.py").write_text((PLUGIN / "adas_fog.py").read_text())
    monkeypatch.syspath_prepend(tmp_path)
    assert ADVISERS.find("cautious")().headway == 3.0
    assert ADVISERS.version("cautious") == "adas-fog 1.2.0"
    with pytest.raises(UnknownNameError, match="did you mean 'cautious'"):
        ADVISERS.find("cautios")
    monkeypatch.delitem(sys.modules, "adas_fog")


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("own:Cautius", "class Cautious: advise = None", "there is no Cautius in .*own.py; did you mean 'Cautious'"),
        (
            "own:Cautious",
            "import nothing_of_that_name",
            r"import fails: ModuleNotFoundError: No module named .*own\.py:1",
        ),
        ("own:Cautious", "x = 1\ndef f(:", r"SyntaxError.*own\.py:2"),
        ("own:Cautious", "class Cautious: pass", r"must have a method advise\(\) or advise_vehicle\(\)"),
    ],
)
def test_what_is_wrong_with_a_users_module_is_told(tmp_path, name, text, told):
    (tmp_path / "own.py").write_text(text + "\n")
    with pytest.raises(InputError, match=told):
        ADVISERS.find(name, tmp_path)


def test_parameters_of_a_users_method_are_checked_in_the_file(tmp_path):
    base = load_scenario("motorway_fog_bank")
    file = tmp_path / "own.yaml"
    (tmp_path / "adas_fog.py").write_text((PLUGIN / "adas_fog.py").read_text())
    file.write_text(
        f"name: own\nfog: {{visibility: 80 m}}\n"
        f"traffic: {{net: {base.directory / base.traffic.net}, routes: [{base.directory / base.traffic.routes[0]}]}}\n"
        "sut:\n  advice: {method: 'adas_fog:Cautious', parameters: {headway: 20.0}}\n"
    )
    with pytest.raises(InputError, match=r"own\.yaml:5: advice\.parameters\.headway: must be a number 0\.5 … 10 s"):
        load_scenario(file)
    for wrong in ("sut={advice: {method: 'adas_fog:Cautious', parameters: {headway: 20.0}}}", "sut={advise: none}"):
        with pytest.raises(InputError, match=r"headway: must be a number 0\.5 … 10 s|sut\.advise: unknown key"):
            load_scenario(file, [wrong])
    assert load_scenario(file, ["sut={advice: none, lighting: low_beam}"]).advice.method == "none"
    scenario = load_scenario(file, ["sut.advice.parameters.headway=4.0"])
    assert chosen_methods.adviser(build.method(scenario, scenario.advice)).headway == 4.0
    versions = Manifest(Status.RUNNING, 0, {}, datetime.now(UTC), own_methods=build.own_methods(scenario)).to_json()[
        "versions"
    ]
    assert versions["adas_fog:Cautious"].startswith("sha256:")
    with pytest.raises(InputError, match="uses a vehicle's own sensors"):
        chosen_methods.road_adviser(build.method(scenario, scenario.advice))


@pytest.mark.parametrize(
    ("block", "told"),
    [
        ("sut: {advise: none}", r"sut\.advise: unknown key; did you mean 'advice'"),
        ("sut: {advice: none}\nadvice: none", r"sut\.advice: advice stands outside sut too"),
        ("sut: none", r"sut: must be a block of keys"),
    ],
)
def test_what_is_under_test_stands_once(tmp_path, block, told):
    file = tmp_path / "own.yaml"
    file.write_text(f"name: own\nfog: {{visibility: 80 m}}\ntraffic: {{net: a, routes: [b]}}\n{block}\n")
    with pytest.raises(InputError, match=told):
        load_scenario(file)
