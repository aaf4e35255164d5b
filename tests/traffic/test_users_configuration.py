"""What a user's own SUMO configuration says: who could be the ego, when it ends, what SUMO warns of; odd networks."""

import contextlib
from pathlib import Path

import pytest

import fogsim
from fogsim.errors import InputError, SimulationError
from fogsim.scenario import Scenario, override, scenario_from_config
from fogsim.simulation.traffic_run import run_traffic
from fogsim.traffic.road.network import read_net
from fogsim.traffic.sumo.libsumo_link import load_libsumo
from fogsim.values import Ending
from tests.traffic import common
from tests.traffic.common import configured

DATA = common.DATA / "off_lanes"
BLIND = ("renderer=none", "estimators=[]", "fog.visibility_m=5000")
CAR = '<vType id="car" vClass="passenger" sigma="0" speedDev="0"/>'


def configuration(folder: Path, vehicles: str, *, net: str = "a.net.xml", options: str = "") -> Path:
    additional = DATA / "park.add.xml" if net == "a.net.xml" else ""
    return configured(folder, DATA / net, f"<routes>{CAR}{vehicles}</routes>", options, additional=additional)


def vehicle(name: str, depart: float, edges: str, kind: str = "car", inner: str = "") -> str:
    return f'<vehicle id="{name}" type="{kind}" depart="{depart}"><route edges="{edges}"/>{inner}</vehicle>'


def loaded(config: Path, ego: str = "ego", *settings: str) -> Scenario:
    return scenario_from_config(config, ego, [*BLIND, *settings], others_add_vehicles=True)


WAY = "we1 we2"
UNSORTED = vehicle("other", 20.0, "we1 we2") + vehicle("ego", 1.0, "we1 we2")


def test_sumos_warning_that_explains_the_missing_ego_is_told(tmp_path: Path) -> None:
    told = r"those that did: other; SUMO warned: Route file should be sorted by departure time, ignoring 'ego'!$"
    with pytest.raises(SimulationError, match=told):
        next(fogsim.run(loaded(configuration(tmp_path, UNSORTED)), sumo_outputs=tmp_path / "outputs"))
    assert not (tmp_path / "outputs").exists()


def test_warnings_of_others_are_told_if_there_is_none_of_the_ego(tmp_path: Path) -> None:
    rows = [vehicle("first", 20.0, "we1 we2"), *(vehicle(f"late{number}", 1.0, "we1 we2") for number in range(5))]
    config = configuration(tmp_path, "".join(rows))
    with pytest.raises(SimulationError, match=r"SUMO warned: .*'late0'! .*'late1'! .*'late2'! and 2 more$"):
        next(fogsim.run(loaded(config, "nobody")))


def test_vehicles_that_sumo_leaves_out_are_reported(tmp_path: Path) -> None:
    config = configuration(tmp_path, vehicle("ego", 2.0, "we1 we2") + vehicle("early", 1.0, "we1 we2"))
    with pytest.warns(UserWarning, match=r"^SUMO warned: .* ignoring 'early'!$"):
        list(fogsim.run(loaded(config, "ego", "duration_s=1")))


def test_a_mistake_that_sumo_finds_on_the_way_is_told_as_it_is(tmp_path: Path) -> None:
    config = configuration(tmp_path, vehicle("ego", 0.0, "we1 we2") + vehicle("lost", 1.0, "we2 we1"))
    with pytest.raises(
        SimulationError, match=r"xml:\d+: SUMO cannot go on: Vehicle 'lost' has no valid route\..*'we1'\.?$"
    ):
        list(fogsim.run(loaded(config)))


def test_an_error_that_sumo_does_not_print_is_told_before_its_warnings(tmp_path: Path) -> None:
    options = '<threads value="2"/><summary-output value="none/sum.xml"/>'
    config = configuration(tmp_path, vehicle("ego", 0.0, "we1 we2"), options=options)
    with pytest.raises(
        SimulationError, match=r"cannot load the scenario: Could not build output .* Warning: .*threads"
    ):
        next(fogsim.run(loaded(config), sumo_outputs=tmp_path / "outputs"))


def test_a_log_of_the_users_own_is_kept(tmp_path: Path) -> None:
    config = configuration(tmp_path, UNSORTED, options='<report><error-log value="mine.log"/></report>')
    with pytest.raises(SimulationError) as error:
        next(fogsim.run(loaded(config), sumo_outputs=tmp_path / "outputs"))
    assert "SUMO warned" not in str(error.value)
    assert [path.name for path in (tmp_path / "outputs").iterdir()] == ["mine.log"]
    assert "ignoring 'ego'" in (tmp_path / "outputs" / "mine.log").read_text(encoding="utf-8")


def test_a_run_ends_when_the_configuration_does(tmp_path: Path) -> None:
    steps = list(fogsim.run(loaded(DATA / "two.sumocfg")))
    assert steps[-1].ending is Ending.TIME
    assert steps[-1].traffic.time == pytest.approx(12.0)
    shorter = list(fogsim.run(loaded(DATA / "two.sumocfg", "ego", "duration_s=5")))
    assert shorter[-1].time == pytest.approx(5.0)
    alone = list(run_traffic(loaded(DATA / "two.sumocfg", "none")))
    assert alone[-1].ending is Ending.TIME
    assert alone[-1].traffic.time == pytest.approx(12.0)
    config = configuration(tmp_path, vehicle("ego", 30.0, "we1 we2"), options='<time><end value="12"/></time>')
    with pytest.raises(SimulationError, match=r"'ego' did not appear within 12 s .*the simulation's end is 12\)"):
        next(fogsim.run(loaded(config)))


TYPES = '<vType id="bike" vClass="bicycle"/><vType id="train" vClass="rail"/>'
PARKS = '<stop parkingArea="pa" duration="1000"/>'


def test_any_ego_is_the_first_vehicle_that_drives_far_or_the_one_with_the_longest_way(tmp_path: Path) -> None:
    cyclist, parks = vehicle("cyclist", 0.0, "we1 we2", "bike"), vehicle("parks", 5.0, "we1 we2", inner=PARKS)
    short, far, later = (vehicle(*one) for one in (("short", 10.0, "ew1"), ("far", 15.0, WAY), ("later", 20.0, WAY)))
    for vehicles, ego, *settings in [
        (TYPES + cyclist + parks + short + far + later, "far"),
        (TYPES + cyclist + parks + short + far + later, "far", "duration_s=2"),  # `any` is not missed in the files
        (parks + short, "short"),
        (parks, "parks"),
        (vehicle("far", 0.0, WAY) + vehicle("any", 0.5, "ew1"), "any"),  # one that is called so is meant
    ]:
        with pytest.warns(UserWarning, match="ego: any: the ego is"):
            step = next(fogsim.run(override(loaded(configuration(tmp_path, vehicles), "any"), settings)))
        assert step.traffic.ids[step.ego] == ego


def test_where_nobody_suits_any_ego_is_refused(tmp_path: Path) -> None:
    config = configuration(tmp_path, TYPES + vehicle("cyclist", 0.0, "we1", "bike"))
    with pytest.raises(SimulationError, match="ego: any: no car, van, truck or bus drives on a lane until"):
        next(fogsim.run(loaded(config, "any")))


def test_an_ego_of_an_outer_simulation_must_be_named() -> None:
    with contextlib.closing(load_libsumo()) as library:
        library.start(["sumo", "-c", str(DATA / "two.sumocfg"), "--no-step-log"])
        with pytest.raises(InputError, match="ego: any: FogSim can choose only in its own simulation; name a vehicle"):
            fogsim.attach(library, ego="any", visibility=120.0)


def test_a_lane_of_no_length_before_a_light_is_read_and_driven_on(tmp_path: Path) -> None:
    assert read_net(DATA / "stub_edge.net.xml").signal_heads == ()
    config = configuration(tmp_path, vehicle("ego", 0.0, "in stub out"), net="stub_edge.net.xml")
    drawn = ("renderer=cpu", "estimators=[lead_contrast]", "camera.width=64", "camera.height=48")
    steps = list(fogsim.run(loaded(config, "ego", *drawn)))
    assert steps[-1].ending is Ending.ARRIVED
    assert steps[-1].traffic.position[0, 0] > 130.0


def test_what_sumo_cannot_load_is_named_with_file_and_line(tmp_path: Path) -> None:
    additional = tmp_path / "a.add.xml"
    for mistake, option, place, cause in (
        ('<poly id="x" shape="a,b 3,4"/>', "", "a.add.xml:2", "Attribute 'shape' in definition of poly 'x'"),
        ('<flow id="f" begin="0" number="5" route="no"/>', "", "a.add.xml:2", "The route 'no' for flow 'f'"),
        (
            '<vType accel="2" id="x"/><vType id="y"\n accel="2 m"/>',
            "",
            "a.add.xml:2",
            "Invalid Car-Following",
        ),
        ('<vType id="x" minGap="0"/>\n<vType id="y" minGap="-1"/>', "", "a.add.xml:3", "minGap must be equal or"),
        ('<vType id="x" sigma="1"/>\n<vType id="y" sigma="2"/>', "", "a.add.xml:3", "Invalid .* between \\[0-1\\]"),
        ("", '<foo value="3"/>', "mine.sumocfg:1", "No option with the name 'foo' exists"),
    ):
        additional.write_text(f"<additional>\n{mistake}\n</additional>", encoding="utf-8")
        rows = f"<routes>{CAR}{vehicle('ego', 0.0, WAY)}</routes>"
        config = configured(tmp_path, DATA / "a.net.xml", rows, option, additional=additional)
        with pytest.raises(SimulationError, match=rf"^{tmp_path}/{place}: SUMO cannot load the scenario: {cause}"):
            next(fogsim.run(loaded(config)))


def test_an_error_that_sumo_passes_over_is_a_warning(tmp_path: Path) -> None:
    rows = f'<routes>{CAR}\n<vType id="x" vClass="lorry"/>{vehicle("ego", 0.0, WAY)}</routes>'
    scenario = loaded(configured(tmp_path, DATA / "a.net.xml", rows))
    with pytest.warns(
        UserWarning, match=r"\.xml:2: SUMO goes on after an error: The vehicle class 'lorry' for vType 'x'"
    ):
        next(fogsim.run(scenario))


def test_a_missing_file_that_ends_sumo_is_refused_before(tmp_path: Path) -> None:
    sign = '<additional>\n<variableSpeedSign id="v" lanes="we1_0" file="v.xml"/></additional>'
    (tmp_path / "a.add.xml").write_text(sign, encoding="utf-8")
    options = f'<additional-files value="{tmp_path}/a.add.xml"/>'
    with pytest.raises(InputError, match=r"a\.add\.xml:2: there is no file 'v\.xml' in "):
        loaded(configuration(tmp_path, vehicle("ego", 0.0, WAY), options=options))
