import math
import re
import shutil
from pathlib import Path

import pytest

from fogsim.errors import InputError, UnknownNameError
from fogsim.scenario import attached_scenario, catalogue, load_scenario, override, resolved
from fogsim.scenario.document import apply_overrides, parse_override


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A copy of the motorway scenario that a test may spoil."""
    return Path(shutil.copytree(catalogue()["motorway_fog_bank"].parent, tmp_path / "mine"))


def spoil(folder: Path, old: str, new: str) -> Path:
    file = folder / "scenario.yaml"
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new, 1), encoding="utf-8")
    return file


def test_every_scenario_of_the_catalogue_loads() -> None:
    for name in catalogue():
        scenario = load_scenario(name)
        assert scenario.name == name
        assert scenario.description


def test_by_name_file_and_folder(folder: Path) -> None:
    by_file, by_folder = load_scenario(folder / "scenario.yaml"), load_scenario(folder)
    assert by_file == by_folder
    assert resolved(by_file) == resolved(load_scenario("motorway_fog_bank"))


def test_a_traffic_step_that_sumo_cannot_make_is_refused_with_the_nearest() -> None:
    for settings, nearest in [
        (["clocks.traffic_step_s=0.0125"], "0.01 or 0.02 s; got 0.0125"),
        ([f"clocks.traffic_step_s={1 / 30!r}"], "0.025 or 0.05 s; got 0.0333"),
        ([f"clocks.{key}_s=0.0125" for key in ("traffic_step", "camera_period")], "0.012 or 0.013 s; got 0.0125"),
    ]:
        told = rf"^--set {settings[0]}.*clocks\.traffic_step_s: SUMO counts time in whole milliseconds.*{nearest}"
        with pytest.raises(InputError, match=told):
            load_scenario("motorway_fog_bank", settings)
    for step in [0.001, 0.02, 0.1, 0.1 + 1e-12]:
        assert load_scenario("motorway_fog_bank", [f"clocks.traffic_step_s={step!r}"]).clocks.traffic_step_s == step


def test_a_simulation_that_runs_already_keeps_its_own_step() -> None:
    clocks = [f"clocks.{key}_s={1 / 15!r}" for key in ("traffic_step", "camera_period", "decision_period")]
    assert attached_scenario("ego", [*clocks, "fog.visibility_m=80"]).clocks.traffic_step_s == 1 / 15


def test_mistakes_are_told_with_key_value_and_what_is_allowed(folder: Path) -> None:
    whole = (folder / "scenario.yaml").read_text(encoding="utf-8")
    for old, new, message in [
        ("width: 640", "width: 0", r"camera\.width: input should be greater than or equal to 16; got 0"),
        ("duration_s: 200", "duration_s: yes", r"duration_s: input should be a valid number; got True"),
        ("duration_s: 200", "duration_s: '200'", r"duration_s: input should be a valid number; got '200'"),
        ("duration_s: 200", "duration_s: 1e308", r"duration_s: .*less than or equal to 1000000; got 1e\+308"),
        ("width: 640", "width: yes", r"camera\.width: input should be a valid integer; got True"),
        ("width: 640", "width: 640.0", r"camera\.width: input should be a valid integer; got 640\.0"),
        ("outside_visibility_m: 2000", "outside_visibility_m: 2e6", r"at most 1e\+06 m, or inf; got 2000000"),
        ("outside_visibility_m: 2000", "outside_visibility_m: 80m", r"got '80m'; write the number alone, in m"),
        ("duration_s: 200", "duration_s: 200\nstreet_lamps: 1", r"street_lamps: .*valid boolean; got 1"),
        ("ego: ego", "ego: ''", r"traffic\.ego: .* at least 1 character; got ''"),
        ("duration_s: 200", "duration_s: .nan", r"duration_s: .*got nan"),
        ("response: srgb", "response: log", r"camera\.response: .*'linear', 'gamma' or 'srgb'; got 'log'"),
        ("end_m: 2500", "end_m: 1000", r"fog\.banks\.0: start_m must be less than end_m, got 1300 and 1000"),
        ("edge_m: 300", "edge_m: 3000", r"fog\.banks\.0: edge_m must not be longer than the bank"),
        ("outside_visibility_m: 2000", "visibility_m: 2000", r"fog: give either visibility_m .* not both"),
        ("[joint_road,", "[joint_rode,", r"estimators\.0: unknown estimator 'joint_rode'; did you mean 'joint_road'\?"),
        ("fusion: field_filter", "fusion: kalman", r"fusion: unknown fusion 'kalman'; known: field_filter"),
        ("reaction_time: 2", "reaction: 2", r"\.yaml:\d+: advice\.parameters\.reaction: .* mean 'reaction_time'\?"),
        ("reaction_time: 2.0", "reaction_time: a", r"yaml:\d+: advice\.parameters\.reaction_time: .* 60 s, got 'a'"),
        ("camera_period_s: 0.1", "camera_period_s: 0.25", r"clocks: camera_period_s must be a .* multiple .*0\.25 s"),
        ("- kind: brake", "- vehicule: x", r"traffic\.events\.0\.kind: this key is missing"),
        ("deceleration_mps2: 6", "decelerate: 6", r"events\.0\.decelerate: unknown key; did you mean 'deceleration_"),
        ("      at_position_m: 1900\n", "", r"traffic\.events\.0: say when it begins: at_position_m, at_time_s or"),
        ("kind: brake", "kind: jump", r"traffic\.events\.0\.kind: unknown kind 'jump'; known: brake, break_down"),
        ("net: motorway.net.xml", "other: 3", r"traffic\.net: this key is missing"),
    ]:
        with pytest.raises(InputError, match=message):
            load_scenario(spoil(folder, old, new))
        (folder / "scenario.yaml").write_text(whole, encoding="utf-8")


def test_every_missing_file_is_told(folder: Path) -> None:
    spoil(folder, "net: motorway.net.xml", "net: motorvay.net.xml")
    with pytest.raises(InputError) as error:
        load_scenario(spoil(folder, "[signs.add.xml]", "[signs.ad.xml, signs.add.xml]"))
    net, signs = str(error.value).splitlines()
    assert re.search(r"scenario\.yaml:\d+: traffic\.net: there is no file 'motorvay\.net\.xml'", net)
    assert "did you mean 'motorway.net.xml'?" in net
    assert "traffic.additional.0: there is no file 'signs.ad.xml'" in signs


def test_unknown_scenarios() -> None:
    with pytest.raises(UnknownNameError, match="unknown scenario 'motorway_fog_bnk'; did you mean 'motorway_fog_bank'"):
        load_scenario("motorway_fog_bnk")
    for name in ("nowhere/scenario.yaml", "./rising_son"):
        with pytest.raises(InputError, match=f"{name}: there is no such scenario file"):
            load_scenario(name)


def test_homogeneous_fog_takes_the_place_of_banks() -> None:
    scenario = load_scenario("motorway_fog_bank", ["fog.visibility_m=80"])
    assert scenario.fog.visibility_m == 80.0
    assert scenario.fog.banks == ()
    back = override(scenario, ["fog.outside_visibility_m=inf"])
    assert back.fog.visibility_m is None
    assert back.fog.outside_visibility_m == math.inf
    for name in ("tunnel_exit_into_fog", "motorway_fog_bank"):
        for setting in ("fog.visibility_m=80", "fog.visibility=80 m"):
            assert load_scenario(name, [setting]).fog.visibility_m == 80.0


def test_overrides_reach_into_lists_and_make_missing_blocks() -> None:
    settings = ["fog.banks.0.visibility_m=40", "sensors.lead.reach_m=120", "camera.width=320"]
    scenario = load_scenario(
        "motorway_fog_bank", [*settings, "camera.focal_length_px=9", "camera.field_of_view_deg=20"]
    )
    assert scenario.camera.focal_length_px is None  # a field of view takes its place
    assert scenario.fog.banks[0].visibility_m == 40.0
    assert scenario.sensors.lead.reach_m == 120.0
    assert scenario.camera.width == 320


def test_overrides_that_are_none_and_those_that_change_a_copy() -> None:
    for text in ["fog.visibility_m", "=3", "fog..x=1", "a=[1"]:
        with pytest.raises(InputError, match="--set"):
            parse_override(text)
    data = {"name": "x", "list": [1, 2]}
    assert apply_overrides(data, ["list.1=7"]) == {"name": "x", "list": [1, 7]}
    assert data == {"name": "x", "list": [1, 2]}


def test_a_resolved_scenario_loads_again() -> None:
    scenario = load_scenario("motorway_fog_bank", ["fog.visibility_m=inf"])
    assert override(scenario, []) == scenario
    assert resolved(scenario)["fog"]["visibility_m"] == "inf"


def test_advised_stretches_that_do_not_fit() -> None:
    for settings, message in [
        (["drivers.advised_stretch.display=in_car"], "advised_stretch goes with advised: stretch, which is missing"),
        (["drivers.signs.spacing_m=200"], "signs goes with advised: signs, which is missing"),
        (["drivers.equipped_share=0.3"], "equipped_share goes with advised: equipped, which is missing"),
        (["drivers.harmonisation={}"], "harmonisation goes with advised: signs, equipped or law, which is missing"),
        (["drivers.advised=stretch", "drivers.advised_stretch={start_m: 9, end_m: 9}"], "start_m must be less than"),
        (["drivers.advised=stretch", "drivers.advised_stretch.display=sign"], "display: .*message_sign.*; got 'sign'"),
        (["drivers.advised=somebody"], "advised: .*'ego', 'all', 'stretch', 'signs', 'equipped' or 'law'"),
    ]:
        with pytest.raises(InputError, match=message):
            load_scenario("motorway_fog_bank", settings)


def test_drivers_that_there_are_not() -> None:
    for setting, message in [
        ("following={in_sight: 0.6, careful: 0.5}", "drivers.following: shares .* must together be 1, and are 1.1"),
        ("following={}", "must together be 1, and are 0"),
        ("following=nobody", "drivers.following: unknown following model 'nobody'; known: .*in_sight"),
        ("following={in_sight: 1.5, careful: -0.5}", "drivers.following.in_sight: .* less than or equal to 1; got 1.5"),
        ("speed_choice=slow", "drivers.speed_choice: unknown speed choice 'slow'; known: .*observed"),
        ("compliance.like=radio", "drivers.compliance: unknown compliance 'radio'; known: .*in_car"),
        ("compliance.trust=2", "drivers.compliance.trust: .* less than or equal to 1"),
    ]:
        with pytest.raises(InputError, match=message):
            load_scenario("motorway_fog_bank", [f"drivers.{setting}"])


def test_a_kind_of_driver_stands_for_all_and_a_kind_of_advice_for_keys_that_are_not_given() -> None:
    drivers = load_scenario("motorway_fog_bank", ["drivers.following=careful"]).drivers
    assert drivers.following == {"careful": 1.0}
    assert drivers.compliance.rate == drivers.compliance.strength == 1.0
    like = load_scenario("motorway_fog_bank", ["drivers.compliance={like: speed_limit_sign, strength: 0.3}"]).drivers
    assert (like.compliance.rate, like.compliance.strength, like.compliance.trust) == (1.0, 0.3, 1.0)


def test_who_sees_through_fog_drives_as_in_clear_air_unless_told_otherwise() -> None:
    def choice(*overrides: str) -> str:
        return load_scenario("motorway_fog_bank", overrides).drivers.speed_choice.method

    assert choice() == "observed"
    assert choice("drivers.see_through_fog=true") == "unaffected"
    assert choice("drivers.see_through_fog=true", "drivers.speed_choice=too_fast") == "too_fast"
