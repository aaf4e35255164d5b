import shutil
from pathlib import Path

import pytest

from fogsim.errors import InputError
from fogsim.scenario import catalogue, load_scenario, override, scenario_from_config

GRID = Path(__file__).resolve().parents[1] / "data" / "grid" / "grid.sumocfg"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A copy of the motorway scenario that a test may spoil."""
    return Path(shutil.copytree(catalogue()["motorway_fog_bank"].parent, tmp_path / "mine"))


def spoil(file: Path, old: str, new: str) -> None:
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new, 1), encoding="utf-8")


def mistakes(name: Path | str, *settings: str) -> list[str]:
    with pytest.raises(InputError) as error:
        load_scenario(name, settings)
    return str(error.value).splitlines()


def test_unknown_vehicles_are_told_at_once_with_line_and_the_nearest(folder: Path) -> None:
    file = folder / "scenario.yaml"
    spoil(file, "  ego: ego", "  ego: egoo")
    spoil(file, "keep_lane: [ego, lead]", "keep_lane: [ego, leed]")
    spoil(file, "vehicle: lead", "vehicle: laed")
    lines = file.read_text(encoding="utf-8").splitlines()
    told = mistakes(file)
    for line, (key, text, wrong, near) in zip(
        told,
        [
            ("ego", "  ego: egoo", "egoo", "ego"),
            ("keep_lane.1", "  keep_lane: [ego, leed]", "leed", "lead"),
            ("events.0.vehicle", "      vehicle: laed", "laed", "lead"),
        ],
        strict=True,
    ):
        assert line.startswith(
            f"{file}:{1 + lines.index(text)}: traffic.{key}: there is no vehicle {wrong!r} in signs.add.xml, "
            f"motorway.rou.xml; did you mean {near!r}? Known: {near}, "
        )


def test_vehicles_of_flows_can_be_named() -> None:
    scenario = load_scenario("motorway_fog_bank", ["traffic.events.0.vehicle=east.40"])
    assert scenario.traffic.events[0].vehicle == "east.40"


def test_a_long_list_of_names_is_cut_short() -> None:
    with pytest.raises(InputError, match=r"no vehicle '18' in grid\.trips\.xml; did you mean 'veh18'\?") as error:
        scenario_from_config(GRID, "18", ["fog.visibility_m=120"])
    assert str(error.value).endswith(", … (100 in all)")


def test_who_has_other_clients_may_name_anybody() -> None:
    settings = ["traffic.ego=theirs", "fog.banks.0={start_m: 9000, end_m: 9900, visibility_m: 60}"]
    scenario = load_scenario("motorway_fog_bank", settings, others_add_vehicles=True)
    assert override(scenario, ["duration_s=3"], others_add_vehicles=True).traffic.ego == "theirs"
    with pytest.raises(InputError, match="no vehicle 'theirs'"):
        override(scenario, ["duration_s=3"])
    scenario = scenario_from_config(GRID, "theirs", ["fog.visibility_m=120"], others_add_vehicles=True)
    assert scenario.traffic.ego == "theirs"


def test_a_bank_beside_the_route_is_told_with_the_routes_length() -> None:
    # The route is 5501 m long, and a bank's soft edge reaches out by half of its length.
    near = "fog.banks.0={start_m: 5550, end_m: 6500, visibility_m: 60}"
    far = "fog.banks.0={start_m: 5650, end_m: 6500, visibility_m: 60}"
    assert load_scenario("motorway_fog_bank", [near]).fog.banks[0].start_m == 5550
    assert mistakes("motorway_fog_bank", far) == [
        f"--set {far}: fog.banks.0.start_m: the bank lies beyond the ego's route, which is 5501 m long; got 5650"
    ]
    early = "fog.banks.0={start_m: -900, end_m: -200, visibility_m: 60}"
    assert mistakes("motorway_fog_bank", early) == [
        f"--set {early}: fog.banks.0.end_m: the bank lies before the ego's route, from 0 m on; got -200"
    ]
    drifting = load_scenario("motorway_fog_bank", [far, "fog.wind={speed_kmh: 20, from_deg: 70}"])
    assert drifting.fog.banks[0].start_m == 5650


def test_an_edge_that_the_net_does_not_have_is_told(folder: Path) -> None:
    spoil(folder / "motorway.rou.xml", 'edges="approach bank exit"', 'edges="approach bnk exit"')
    (told, *_) = mistakes(folder)
    assert "traffic.ego: the vehicle 'ego' of motorway.rou.xml drives on edge 'bnk', which the net does not" in told
    assert "did you mean 'bank'?" in told


def test_a_lane_that_the_edge_does_not_have_is_told(folder: Path) -> None:
    spoil(folder / "motorway.rou.xml", 'depart="180" departLane="1"', 'depart="180" departLane="3"')
    (told,) = mistakes(folder)
    assert told.endswith("departs on lane 3 of edge 'approach', which has lanes 0 to 2")


def test_a_change_over_more_lanes_than_there_are_is_told() -> None:
    def change(lanes: int, vehicle: str = "lead") -> str:
        return f"traffic.events.0={{kind: change_lane, vehicle: {vehicle}, at_time_s: 3, lanes: {lanes}}}"

    assert load_scenario("motorway_fog_bank", [change(-2)])
    for vehicle in ("lead", "east.7"):
        (told,) = mistakes("motorway_fog_bank", change(-3, vehicle))
        assert "traffic.events.0.lanes: the widest road on the way of" in told
        assert told.endswith("has lanes 0 to 2; got -3")


def test_an_advised_stretch_lies_on_the_egos_route() -> None:
    stretch = "drivers.advised_stretch={start_m: 5600}"
    with pytest.raises(
        InputError, match=r"advised_stretch\.start_m: the stretch begins beyond .* 5501 m long; got 5600"
    ):
        load_scenario("motorway_fog_bank", ["drivers.advised=stretch", stretch])


def test_a_person_is_no_ego(tmp_path: Path) -> None:
    rows = '<person id="ego" depart="0"><walk from="A0B0" to="B0C0"/></person>'
    shutil.copy(GRID.with_name("grid.net.xml"), tmp_path)
    config = tmp_path / "foot.sumocfg"
    files = '<net-file value="grid.net.xml"/><route-files value="a.rou.xml"/>'
    config.write_text(f"<configuration>{files}</configuration>", encoding="utf-8")
    (tmp_path / "a.rou.xml").write_text(f"<routes>{rows}</routes>", encoding="utf-8")
    with pytest.raises(InputError, match=r"traffic\.ego: 'ego' is a person, and only a vehicle can be named here$"):
        scenario_from_config(config, "ego", ["fog.visibility_m=120"])
    # A vehicle may have the id of a person.
    trip = '<trip id="ego" depart="1" from="A0B0" to="B0C0"/>'
    (tmp_path / "a.rou.xml").write_text(f"<routes>{rows}{trip}</routes>", encoding="utf-8")
    assert scenario_from_config(config, "ego", ["fog.visibility_m=120"]).traffic.ego == "ego"
    config.write_text('<configuration><net-file value="grid.net.xml"/></configuration>', encoding="utf-8")
    with pytest.raises(InputError, match=r"there is no vehicle 'ego': no route file is named$"):
        scenario_from_config(config, "ego", ["fog.visibility_m=120"])


def test_a_folder_is_no_configuration_but_may_have_some() -> None:
    with pytest.raises(InputError, match=r"grid is a folder; .*; in it: grid\.sumocfg$"):
        scenario_from_config(GRID.parent, "ego", ["fog.visibility_m=120"])
