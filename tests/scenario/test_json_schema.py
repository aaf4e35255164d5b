import json
import re
import shutil
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

from fogsim import InputError, catalogue, load_scenario
from fogsim.core.registry.user_code import import_nothing
from fogsim.errors import LeftOutWarning
from fogsim.scenario.json_schema import json_schema, scenario_json_schema
from fogsim.scenario.plain_yaml import parse_yaml
from fogsim.scenario.starting import begin_scenario
from fogsim.study.plan import StudyFile

ROOT = Path(__file__).parents[2]
GRID = ROOT / "tests" / "data" / "grid"
STUDIES = sorted((ROOT / "scenarios" / "studies").glob("*.yaml"))


@pytest.fixture(scope="module")
def scenarios():
    schema = scenario_json_schema()
    json.dumps(schema, allow_nan=False)
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema)


def read_yaml(text):
    """As FogSim reads it, and editors do: ``on`` is a word."""
    return parse_yaml(text)[0]


def places(validator, text):
    return [error.json_path for error in validator.iter_errors(read_yaml(text))]


def test_editors_find_nothing_wrong_with_shipped_scenarios(scenarios):
    for name in catalogue():
        assert places(scenarios, catalogue()[name].read_text()) == []


@pytest.mark.parametrize("page", ["tests", "roads"])
def test_editors_find_nothing_wrong_with_whole_scenarios_of_the_docs(scenarios, page):
    text = (ROOT / "docs" / "reference" / f"{page}.md").read_text()
    whole = [block for block in re.findall(r"```yaml\n(.*?)```", text, re.DOTALL) if re.search("^name:", block, re.M)]
    assert whole
    assert [places(scenarios, block) for block in whole] == [[]] * len(whole)


def test_editors_find_nothing_wrong_with_shipped_studies():
    for study in STUDIES:
        assert places(Draft202012Validator(json_schema(StudyFile)), study.read_text()) == []


def test_editors_find_what_is_wrong(scenarios):
    for written, place in [
        ("fog: {visibility: 150 m}", None),
        ("fog: {visibility_m: inf}", None),
        ("fog: {visibility: inf}", None),
        ("fog: {visibility: 80 m, top: inf}", None),
        ("fog: {visibility: 80 m, base: inf}", "$.fog.base"),
        ("fog: {visibility: $fog}", None),
        ("fog: {banks: [{start: 1 km, end_m: 1200, visibility: 50 m}], outside_visibility_m: 500}", None),
        ("fog: {visibility_m: 80}\nsut: {advice: 'mine:Cautious', estimators: [joint_road]}", None),
        ("fog: {visibility_m: 80}\nestimators: ['onnx:networks/small.onnx']", None),
        ("fog: {visibility_m: 80}\ndrivers: {compliance: {rate: 60 %}, following: careful}", None),
        ("fog: {visibility: $v}\nvary: {v: [80 m], run: 9 seeds}\nverdict: {pass_rate: 80 %, confidence: 0.8}", None),
        ("fog: {visibility: $v}\nvary: [80 m]", "$.vary"),
        ("fog: {visibility: $v}\nvary: {v: [80 m]}\nverdict: {pas_rate: 80 %}", "$.verdict"),
        ("fog: {visibilty: 150 m}", "$.fog"),
        ("fog: {visibility: 150}", "$.fog.visibility"),
        ("fog: {visibility_m: 0.5}", "$.fog.visibility_m"),
        ("fog: {banks: [{start: 1 km, visibility: 50 m}]}", "$.fog.banks[0]"),
        ("fog: {visibility_m: 80}\nadvice: stopping_sigt_distance", "$.advice"),
        ("fog: {visibility_m: 80}\nsut: {advise: none}", "$.sut"),
    ]:
        found = places(scenarios, f"name: a\ntraffic: {{net: a, routes: [b]}}\n{written}")
        assert found == ([] if place is None else [place])


def test_a_scenario_of_ones_own_begins_as_the_one_it_is_begun_from(tmp_path):
    files = begin_scenario("mine", "motorway_fog_bank", tmp_path)
    mine, source = load_scenario(tmp_path / "mine"), load_scenario("motorway_fog_bank")
    assert mine.model_copy(update={"name": source.name, "directory": source.directory}) == source
    assert mine.name == "mine"
    assert "# the lead stops inside the bank" in files[0].read_text()
    assert {file.name for file in files} >= {"scenario.yaml", "motorway.net.xml", "fogsim.schema.json"}
    with pytest.raises(InputError, match="already exists"):
        begin_scenario("mine", "motorway_fog_bank", tmp_path)


def test_a_name_that_no_scenario_can_have_makes_nothing(tmp_path):
    for name in ["", "..", "a/b", "a b", "x" * 101]:
        with pytest.raises(InputError, match="a scenario's name has letters"):
            begin_scenario(name, "motorway_fog_bank", tmp_path)
        assert not list(tmp_path.iterdir())


def test_files_that_lie_elsewhere_are_named_by_their_place(tmp_path):
    begin_scenario("first", "motorway_fog_bank", tmp_path)
    here = tmp_path / "first" / "scenario.yaml"
    other = tmp_path / "other.yaml"
    other.write_text(
        here.read_text()
        .replace("motorway.net.xml", "first/motorway.net.xml")
        .replace("[motorway.rou.xml]", f"[{tmp_path}/first/motorway.rou.xml]")
        .replace("signs.add.xml", "first/signs.add.xml")
    )
    begin_scenario("second", str(other), tmp_path)
    second = load_scenario(tmp_path / "second")
    assert second.traffic.routes == (tmp_path / "first" / "motorway.rou.xml",)
    assert (tmp_path / "second" / "first" / "motorway.net.xml").is_file()


def test_files_of_methods_are_copied(tmp_path):
    (old := tmp_path / "old").mkdir()
    for name in ("mine.py", "pack/__init__.py", "pack/inner.py", "pack/helper.py", "other.py"):
        (old / name).parent.mkdir(exist_ok=True)
        (old / name).write_text("class Own: ...\n")
    (old / "mine.py").write_text("import sibling\nclass Own: ...\n")
    (old / "sibling.py").write_text("import cousin\n")
    (old / "cousin.py").touch()
    (old / "lamps.yaml").write_text("{low_beam: beam.csv}")
    (old / "beam.csv").write_text("0,0,1\n")
    (old / "weights.npz").touch()
    (old / "scenario.yaml").write_text(
        "name: old\nduration_s: 5\nroad: {template: motorway}\nactors: {ego: {position: 200 m, speed: 100 km/h}}\n"
        "fog: {visibility_m: 100}\nfusion: pack.inner:Own\n"
        "estimators:\n  - {method: mine:Own, parameters: {weights: weights.npz}}\n"
        "  - {method: night_road, parameters: {head_lamps: lamps.yaml}}\n"
        "lighting: low_beam\n"
    )
    begin_scenario("new", str(old), tmp_path)
    load_scenario(tmp_path / "new", may_import=import_nothing)
    found = {str(path.relative_to(tmp_path / "new")) for path in (tmp_path / "new").rglob("*") if path.is_file()}
    added = {"mine.py", "pack/__init__.py", "pack/inner.py", "pack/helper.py", "lamps.yaml"}
    added |= {"sibling.py", "cousin.py", "beam.csv", "weights.npz"}
    assert found == {"scenario.yaml", "fogsim.schema.json", *added}


@pytest.fixture
def old(tmp_path):
    """A scenario of a configuration, in a folder."""
    (folder := tmp_path / "old").mkdir()
    for file in GRID.glob("grid.*"):
        shutil.copy(file, folder)
    text = "name: old\nduration_s: 5\ntraffic: {config: grid.sumocfg, ego: veh5}\nfog: {visibility_m: 100}\n"
    (folder / "scenario.yaml").write_text(text)
    return folder


def test_files_of_a_configuration_are_copied_or_refused(tmp_path, old):
    begin_scenario("new", str(old), tmp_path)
    assert load_scenario(tmp_path / "new").traffic.config is not None
    moved = (old / "grid.sumocfg").read_text().replace("grid.net.xml", "../grid.net.xml")
    (old / "grid.sumocfg").write_text(moved)
    shutil.move(old / "grid.net.xml", tmp_path)
    with pytest.raises(InputError, match=r"'\.\./grid\.net\.xml' is no file in the scenario's folder"):
        begin_scenario("third", str(old), tmp_path)
    assert not (tmp_path / "third").exists()


def test_files_that_files_of_a_configuration_name_are_copied_or_refused(tmp_path, old):
    more = '<additional-files value="a.add.xml"/><gui-settings-file value="view.xml"/></input>'
    text = (old / "grid.sumocfg").read_text()
    (old / "grid.sumocfg").write_text(text.replace("</input>", more))
    (old / "view.xml").write_text("<viewsettings/>")
    (old / "more").mkdir()
    (old / "a.add.xml").write_text('<additional><include href="more/b.add.xml"/></additional>')
    (old / "more" / "b.add.xml").write_text(
        '<additional><variableSpeedSign id="v" lanes="A0B0_0" file="v.xml"/>'
        '<calibrator id="c" edge="A0B0" pos="0" file="c.xml"/></additional>'
    )
    (old / "more" / "v.xml").write_text('<vss><step time="0" speed="9"/></vss>')
    (old / "more" / "c.xml").write_text('<calibrator><flow begin="0" end="9" vehsPerHour="9"/></calibrator>')
    begin_scenario("new", str(old), tmp_path)
    for name in ("view.xml", "a.add.xml", "more/b.add.xml", "more/v.xml", "more/c.xml"):
        assert (tmp_path / "new" / name).read_text() == (old / name).read_text()
    (old / "more" / "v.xml").unlink()
    with pytest.raises(InputError, match=r"b\.add\.xml:1: there is no file 'v\.xml' in "):
        begin_scenario("third", str(old), tmp_path)


def test_a_scenario_of_openscenario_is_not_copied_as_yaml(tmp_path):
    file = ROOT / "tests" / "data" / "openscenario" / "slow_lead.xosc"
    with pytest.raises(InputError, match=r"expected a YAML scenario; begin one with the line scenario: FILE\.xosc"):
        begin_scenario("mine", str(file), tmp_path)
    shutil.copytree(file.parent, tmp_path / "on_top")
    (tmp_path / "on_top" / "scenario.yaml").write_text("scenario: slow_lead.xosc\nname: a\nfog: {visibility_m: 100}\n")
    with pytest.warns(LeftOutWarning):
        begin_scenario("mine", str(tmp_path / "on_top"), tmp_path)
    assert f'scenario: "{tmp_path}/on_top/slow_lead.xosc"' in (tmp_path / "mine" / "scenario.yaml").read_text()
