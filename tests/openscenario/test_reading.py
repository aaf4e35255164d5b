"""OpenSCENARIO files as scenarios: places, speeds, fog, triggers, and what is refused."""

import math
from pathlib import Path
from typing import Any

import pytest

from fogsim.errors import InputError, LeftOutWarning
from fogsim.openscenario import read_openscenario
from fogsim.scenario.document import read_scenario_document
from fogsim.scenario.loading import load_scenario
from tests.openscenario.writing import DATA, QUIET, changed, entry


@pytest.fixture(scope="module")
def cut_in() -> dict[str, Any]:
    return read_openscenario(DATA / "cut_in_in_fog.xosc").data


SLOW_LEAD = DATA / "slow_lead.xosc"


def test_fog_light_and_parameters(cut_in: dict[str, Any]) -> None:
    assert cut_in["fog"] == {"visibility_m": 140.0}
    assert 5_000.0 < cut_in["light"]["illuminance_lx"] < 12_000.0
    assert entry(cut_in, "Init")["do"]["Overtaker"]["speed"]["to_kmh"] == pytest.approx(72 * 1.25)
    assert entry(cut_in, "thicker_fog") == {
        "name": "thicker_fog",
        "when": "time >= 4 s",
        "do": {"fog": {"visibility_m": 60.0}},
    }


def test_triggers_are_conditions_of_the_language(cut_in: dict[str, Any]) -> None:
    # Reference points are 4.8 m farther apart than bumpers: 1.4 + 2.4 before the one, 1 behind the other.
    assert entry(cut_in, "cut_in")["when"] == "headway(ego, Overtaker, 4.8 m) rises above 0.5 s"
    assert entry(cut_in, "brake")["do"]["Overtaker"]["speed"] == {
        "to_kmh": pytest.approx(28.8),
        "shape": "linear",
        "rate_mps2": 2.0,
    }
    assert cut_in["end_when"] == "happened(stop)"
    assert entry(cut_in, "stop")["delay_s"] == 2.0


def test_a_box_of_fog_is_a_bank_along_the_route() -> None:
    with pytest.warns(LeftOutWarning, match="ObjectController"):
        scenario = load_scenario(DATA / "slow_lead.xosc", QUIET)
    (bank,) = scenario.fog.banks
    # The ego's road begins at x = 100 m, the box at 250 m.
    assert (bank.start_m, bank.end_m) == (pytest.approx(150.0, abs=1.0), pytest.approx(450.0, abs=1.0))
    assert (bank.visibility_m, scenario.fog.outside_visibility_m, scenario.fog.top_m) == (200.0, math.inf, 40.0)
    assert scenario.light.illuminance_lx == 20_000.0


def test_a_box_of_fog_beside_the_way_is_told(tmp_path: Path) -> None:
    controller = '<ObjectController><CatalogReference catalogName="Controllers" entryName="driver"/></ObjectController>'
    centre = '<Center x="400" y="0" z="0"/>'
    file = changed(tmp_path, SLOW_LEAD, (controller, ""), (centre, centre.replace('y="0"', 'y="500"')))
    with pytest.warns(LeftOutWarning, match="next to the ego's route"):
        assert load_scenario(file, QUIET).fog.banks == ()


def test_what_is_not_supported_is_told_at_once_with_paths_and_lines(tmp_path: Path) -> None:
    file = changed(
        tmp_path,
        SLOW_LEAD,
        ('value="3.2" freespace="true" rule="lessThan"', 'value="3.2" freespace="true" rule="equalTo"'),
        ('<StandStillCondition duration="0.5"/>', '<OffroadCondition duration="0.5"/>'),
        ('vehicleCategory="truck"', 'vehicleCategory="trailer"'),
        ('<LightStateAction transitionTime="0">', '<AnimationAction/><LightStateAction transitionTime="0">'),
    )
    with pytest.raises(InputError) as refused:
        load_scenario(file)
    lines = str(refused.value).splitlines()
    assert len(lines) == 4
    assert "slow_lead.xosc:8: /OpenSCENARIO/Entities/ScenarioObject[Lead]/Vehicle[lorry]: vehicleCategory" in lines[0]
    assert any("/EntityCondition/TimeToCollisionCondition: rule: " in line for line in lines)
    assert any("/EntityCondition/OffroadCondition: FogSim has no such condition" in line for line in lines)
    assert any("/AppearanceAction/AnimationAction: nothing moves on a body; actions are " in line for line in lines)


@pytest.mark.filterwarnings("ignore::fogsim.errors.LeftOutWarning")
def test_mistakes_are_told(tmp_path: Path) -> None:
    for old, new, told in [
        ('x="150" y="-25.25"', 'x="150" y="-45"', "on no lane that leads there; the nearest is 19.8 m away"),
        ('y="-25.25" h="0"', 'y="-25.25" h="3.14"', "on no lane that leads there"),
        ('roadId="7" s="260"', 'roadId="8" s="260"', "there is no road '8'; there are 7"),
        ('<EntityRef entityRef="Ego"/></Actors>', "</Actors>", "SpeedAction: no vehicle does it"),
        ('<EntityRef entityRef="Ego"/></Actors>', '<EntityRef entityRef="Eho"/></Actors>', "there is no vehicle 'Eho'"),
        ('<EntityRef entityRef="Ego"/></TriggeringEntities>', "</TriggeringEntities>", "expected EntityRef inside"),
        ("<WorldPosition", '<RelativeWorldPosition dx="1" dy="0"/><WorldPosition', "there is no entity ''"),
        ('visualRange="200"', 'visualRange="$sight"', "unknown parameter $sight"),
        ('visualRange="200"', 'visualRange="${200 / 0}"', "cannot evaluate"),
        (
            'visualRange="200"',
            'visualRange="${1e308 * 10}"',
            "cannot evaluate ${1e308 * 10}: cannot convert float infinity",
        ),
        ('visualRange="200"', 'visualRange="1e400"', "expected a number for visualRange, got '1e400'"),
        ("</Actors>", "<ByType/></Actors>", "Actors/ByType: FogSim does"),
        ('revMajor="1"', 'revMajor="2"', "expected OpenSCENARIO XML 1.x"),
        ('filepath="two_lanes.xodr"', 'filepath="none.xodr"', "expected an OpenDRIVE file (.xodr) that is there"),
        ("<OpenSCENARIO>", "<!DOCTYPE x [<!ENTITY e 'x'>]><OpenSCENARIO>", "a document type"),
        ("</OpenSCENARIO>", "", "not XML"),
    ]:
        with pytest.raises(InputError, match="slow_lead") as refused:
            load_scenario(changed(tmp_path, SLOW_LEAD, (old, new)))
        assert told in str(refused.value)


def test_a_yaml_file_lays_expectations_upon_it(tmp_path: Path) -> None:
    file = tmp_path / "test.fog.yaml"
    file.write_text(
        f"scenario: {DATA / 'cut_in_in_fog.xosc'}\nrenderer: none\nestimators: []\nfog: {{visibility: 80 m}}\n"
        "timeline:\n  - {name: late, when: time > 5 s, do: {Overtaker: {hazard_lights: true}}}\n"
        "expect:\n  cuts_in: {happened: cut_in}\n  warns: {happened: late}\n",
        encoding="utf-8",
    )
    scenario = load_scenario(file)
    assert scenario.fog.visibility_m == 80.0
    names = "Init thicker_fog faster cut_in cut_in_ends_others brake brake_overridden brake_over stop late"
    assert [entry.name for entry in scenario.timeline] == names.split()
    assert read_scenario_document(file).where(("timeline", 9)).endswith("test.fog.yaml:6")
    assert read_scenario_document(file).where(("timeline", 1)).endswith("cut_in_in_fog.xosc:59")
