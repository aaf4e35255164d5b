import pytest

import fogsim
from fogsim.errors import InputError
from fogsim.scenario import attached_scenario, override, resolved
from fogsim.scenario.build import traffic_setup
from fogsim.traffic.sumo.libsumo_link import load_libsumo
from fogsim.traffic.sumo.options import OWN_OPTIONS, command_line, known_options, option_mistakes

ROAD = fogsim.load_scenario("motorway_fog_bank")


def with_options(*settings: str) -> fogsim.Scenario:
    return override(ROAD, [f"traffic.sumo_options{setting}" for setting in settings])


def test_what_sumo_knows_is_asked_of_it() -> None:
    known = known_options()
    assert len(known) > 300
    assert known["summary"].name == "summary-output"
    assert known["step-method.ballistic"].kind == "BOOL"
    # A version may have fewer; those that this one has bear their first names.
    assert {known[name].name for name in OWN_OPTIONS if name in known} == {n for n in OWN_OPTIONS if n in known}
    assert not load_libsumo().isLoaded()


def test_what_sumo_would_not_take_is_told_by_its_key() -> None:
    for name, value, told in [
        ("device.ssm.probabilty", 1, "no such option; did you mean 'device.ssm.probability'"),
        ("seed", 1, "fogsim run --seed"),
        ("n", "a.net.xml", r"traffic\.net"),
        ("step-length", 0.5, r"clocks\.traffic_step_s"),
        ("remote-port", 8813, "inside FogSim"),
        ("end", 100, "duration_s"),
        ("output-prefix", "a/b", "no folder"),
        ("save-config", "a.xml", "outside the run's folder"),
        ("pedestrian.jupedsim.wkt", "a.txt", "outside the run's folder"),
        ("fcd-output", "10.0.0.1:80", "not to a network address"),
        ("xml-validation", "always", "fetch schemas"),
        ("step-method.ballistic", 1, "must be true or false, got 1"),
        ("device.ssm.probability", "often", "must be a number, got 'often'"),
        ("device.ssm.probability", True, "must be a number, got True"),
        ("precision", 2.5, "must be a whole number"),
        ("summary-output", True, "must be text, got True"),
    ]:
        with pytest.raises(InputError, match=rf"traffic\.sumo_options\.{name}: .*{told}"):
            with_options(f"={{{name}: {str(value).lower() if isinstance(value, bool) else value}}}")


def test_where_sumo_cannot_be_asked_it_refuses_by_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fogsim.traffic.sumo.options.known_options", dict)
    scenario = with_options("={no-such-option: 1}")
    with pytest.raises(fogsim.SimulationError, match="No option with the name 'no-such-option' exists"):
        next(fogsim.run(override(scenario, ["renderer=none", "estimators=[]"])))
    for option, message in [
        ("seed: 1", "fogsim run --seed"),
        ("X: always", "schemas"),
        ("C: a.xml", "outside the run"),
    ]:
        with pytest.raises(InputError, match=message):
            with_options(f"={{{option}}}")


def test_options_are_written_flat_or_as_set_makes_them_and_take_the_place_of_usual_ones() -> None:
    scenario = with_options(".step-method.ballistic=true", "={time-to-teleport: 120}", ".device.ssm.range=80.5")
    assert resolved(scenario)["traffic"]["sumo_options"] == {"time-to-teleport": 120, "device.ssm.range": 80.5}
    arguments = command_line(traffic_setup(scenario), 1)
    assert arguments[arguments.index("--time-to-teleport") + 1] == "120"
    assert arguments.count("--time-to-teleport") == 1
    assert arguments[arguments.index("--device.ssm.range") + 1] == "80.5"
    assert "--step-method.ballistic" not in arguments


def test_options_that_fit_have_no_mistakes_and_files_of_the_scenarios_folder_are_found_but_outputs_stay_bare() -> None:
    fitting = {"tripinfo-output": "a.xml", "scale": 2, "time-to-teleport": "60", "precision": 6, "threads": 1}
    assert option_mistakes(fitting) == {}
    scenario = with_options("={weight-files: motorway.rou.xml, tripinfo-output: trips.xml}")
    options = dict(traffic_setup(scenario).sumo_options)
    assert options == {"weight-files": str(ROAD.directory / "motorway.rou.xml"), "tripinfo-output": "trips.xml"}


def test_a_simulation_that_runs_already_takes_no_options() -> None:
    with pytest.raises(InputError, match=r"traffic\.sumo_options\.scale: the simulation runs already"):
        attached_scenario("ego", ["fog.visibility_m=100", "traffic.sumo_options.scale=2"])
