"""The block ``timeline``: what is written, and every mistake at its place."""

import contextlib
from pathlib import Path

import pytest

from fogsim.errors import InputError
from fogsim.scenario import load_scenario, resolved
from fogsim.scenario.loading import override
from fogsim.scenario.timeline import vehicles_of
from fogsim.scenario.written_form import as_written

BLIND = ("renderer=none", "estimators=[]", "traffic.events=[]", "fog={visibility_m: 100}")


def mistake(entry: str, *settings: str) -> str:
    with pytest.raises(InputError) as error:
        load_scenario("motorway_fog_bank", [*BLIND, *settings, f"timeline=[{entry}]"])
    return str(error.value)


def test_mistakes_are_told_with_their_key() -> None:
    arrive = "{{lead: {{arrive: {{vehicle: ego, distance_m: 9, its_distance_m: 9, {}}}}}}}"
    path = "{{lead: {{path: {{points: {}}}}}}}"
    for do, told in [
        ("{lead: {brake: {decelaration: 6 m/s²}}}", "do.lead.brake.decelaration: unknown key; did you mean 'dec"),
        ("{lead: {brakes: {}}}", "do.lead.brakes: unknown key; did you mean 'brake'"),
        ("{lead: {brake: {to: 80 m}}}", "do.lead.brake.to: "),
        ("{lead: {}}", "do.lead: no action given; allowed: speed, brake, follow"),
        ("{lead: {brake: {}, speed: {to: 3 m/s}}}", "do.lead: speed and brake cannot begin together"),
        ("{lead: {change_lane: {}}}", "do.lead.change_lane: say where: lanes"),
        ("{lead: {speed: {to_kmh: 3, over_s: 1, rate_mps2: 2}}}", "do.lead.speed: give over_s, rate_mps2, profile or"),
        ("{lead: {stop: {}}}", "do.lead.stop: say where: position_m or after_m"),
        ("{lead: {lamps: {stopp: off}}}", "do.lead.lamps.stopp: unknown key; did you mean 'stop'"),
        ("{lead: {follow: {headway: 1 s}}}", "do.lead.follow.vehicle: this key is missing"),
        ("{lead: {speed: {to_kmh: 3, like: ego}}}", "do.lead.speed: say which speed: to_kmh, like"),
        ("{lead: {speed: {over: 3 s}}}", "do.lead.speed: say which speed: to_kmh, like"),
        ("{lead: {speed: {to_kmh: 3, factor: 0.5}}}", "do.lead.speed: factor and plus_kmh go with like"),
        ("{lead: {speed: {profile: [[1, 30]], shape: sinusoidal}}}", "do.lead.speed: shape goes with to_kmh or like"),
        (arrive.format("factor: 1"), "do.lead.arrive: factor goes with to_kmh"),
        (arrive.format("to_kmh: 1, steady_m: 1, steady_s: 1"), "do.lead.arrive: give steady_m or steady_s, not both"),
        ("{lead: {speed: {profile: [[2, 30], [1, 40]]}}}", "do.lead.speed: profile: each time must be later"),
        ("{lead: {follow: {vehicle: ego}}}", "do.lead.follow: say how far behind: headway_s, gap_m or both"),
        (path.format("[[1, 2]]"), "do.lead.path: give a heading with each of points or with none"),
        (path.format("[[1, 2], [3, 4, 5]]"), "do.lead.path: give a heading with each of points or with none"),
        (path.format("[[1, 2], [3, 4]], at_s: [1]"), "do.lead.path: at_s has a time for each of points"),
        (path.format("[[1, 2], [3, 4]], at_s: [1, 1]"), "do.lead.path: at_s has a time for each of points"),
        ("{ego: {take_route: [bank]}}", "do.ego: take_route: positions count along the ego's route"),
        ("{lead: {leave: true, brake: {}}}", "do.lead: leave must be the only key"),
        ("{lead: {change_lane: {to: 1, to_lane_of: ego}}}", "do.lead.change_lane: say where: lanes"),
        ("{lead: {speed: {like: nobody}}}", "there is no vehicle 'nobody' in "),
        ("{lead: {change_lane: {to_lane_of: nobody}}}", "there is no vehicle 'nobody' in "),
        ("{fog: {over: 3 s}}", "do.fog: say how thick: visibility_m or density"),
        ("{signal.C: {state: purple}}", "do.signal.C.state"),
        ("{sensors.camera: {fault: blackoud}}", "do.sensors.camera"),
        ("{leed: {brake: {}}}", "do.leed: there is no vehicle 'leed' in "),
        ("{lead: {follow: {vehicle: nobody, headway: 1 s}}}", "there is no vehicle 'nobody' in "),
        ("{signal.C: {state: red}}", "do.signal.C: the net has no traffic lights 'C'; it has none"),
        ("{new: {depart: {like: leed, gap: 9 m}}}", "do.leed: there is no vehicle 'leed' in "),
        ("{new: {depart: {like: ego, gap: 9 m}, brake: {}}}", "do.new: depart must be the only key"),
        ("{}", "do: "),
    ]:
        text = mistake(f"{{when: time > 1 s, do: {do}}}")
        assert f"timeline.0.{told}" in text or (told in text and "timeline.0.do" in text)
        assert len(text.splitlines()) == 1


@pytest.mark.parametrize(
    ("shows", "mistake"),
    [
        ("phase: 99", "phase: their program has phases 0 to "),
        ("state: rG", "state: they have "),
        ("state: red", ""),
        ("state: r", ""),
        ("phase: 0", ""),
    ],
)
def test_traffic_lights_show_what_their_program_can(tmp_path: Path, shows: str, mistake: str) -> None:
    file = tmp_path / "lights.fog.yaml"
    file.write_text(
        "name: lights\ndescription: x\nroad: {template: crossing, lights: true}\nactors: {ego: {speed: 30 km/h}}\n"
        f"fog: {{visibility: 100 m}}\ntimeline: [{{when: time > 1 s, do: {{signal.middle: {{{shows}}}}}}}]\n",
        encoding="utf-8",
    )
    with (
        pytest.raises(InputError, match=f"timeline.0.do.signal.middle.{mistake}")
        if mistake
        else contextlib.nullcontext()
    ):
        load_scenario(file)


def test_mistakes_of_conditions_and_names() -> None:
    brake = "do: {lead: {brake: {}}}"
    assert "timeline.0.when: " in mistake(f"{{when: lead.sped > 3 m/s, {brake}}}")
    assert "timeline.0.when: there is no vehicle 'leed' in " in mistake(f"{{when: leed.speed > 3 m/s, {brake}}}")
    unknown = mistake(f"{{when: happened(timeline.7), {brake}}}")
    assert "timeline.0.when: happened(timeline.7): unknown event 'timeline.7'" in unknown
    assert "timeline.0.when: this key is missing" in mistake(f"{{{brake}}}")
    two = f"{{name: a, when: time > 1 s, {brake}}}, {{name: a, when: time > 1 s, {brake}}}"
    assert "timeline.1.name: names of entries must differ, but 'a' occurs twice" in mistake(two)


def test_what_does_not_fit_the_scenario_is_told() -> None:
    banks = "fog={outside_visibility_m: inf, banks: [{start_m: 100, end_m: 900, visibility_m: 40}]}"
    for do, setting, told in [
        ("fog: {density: 2}", "fog={visibility_m: inf}", "this multiplies the scenario's fog"),
        ("fog: {visibility: 30 m}", banks, "outside the banks the air is clear; write density"),
        ("light: {illuminance: 20 lx, course: factors}", "light.illuminance_lx=0", "goes on from the light that"),
    ]:
        text = mistake(f"{{when: time > 1 s, do: {{{do}}}}}", setting)
        assert told in text
        assert "timeline.0.do." in text


def test_a_line_of_a_file_is_named(tmp_path: Path) -> None:
    base = Path(load_scenario("motorway_fog_bank").directory).resolve()
    file = tmp_path / "scenario.yaml"
    file.write_text(
        "name: mine\nrenderer: none\nestimators: []\nfog: {visibility: 100 m}\n"
        f"traffic: {{net: {base}/motorway.net.xml, routes: [{base}/motorway.rou.xml]}}\n"
        "timeline:\n  - when: time > 1 s\n    do:\n      lead:\n        brake:\n          to: 3 s\n",
        encoding="utf-8",
    )
    with pytest.raises(InputError, match=r"scenario\.yaml:11: timeline\.0\.do\.lead\.brake\.to: "):
        load_scenario(file)


def test_what_is_written_comes_back_as_plain_data_that_loads_again() -> None:
    written = (
        "{name: one, when: {gap(ego, lead): '< 80 m'}, delay: 0.5 s, repeat: each, do: {lead: [{lamps: {stop: off}}, "
        "{lamps: {all: failed}}], sensors.camera: {fault: latency, delay: 0.4 s}, "
        "light: {illuminance: 5000 lx}, ego: {follow: {vehicle: lead, headway: 1 s}}}}"
    )
    scenario = load_scenario("motorway_fog_bank", [*BLIND, f"timeline=[{written}]"])
    assert vehicles_of(scenario.timeline[0]) == ("lead", "ego")
    plain = resolved(scenario)["timeline"]
    assert plain[0]["when"] == "gap(ego, lead) < 80 m"
    assert plain[0]["do"]["lead"] == [{"lamps": {"stop": "off"}}, {"lamps": {"all": "failed"}}]
    again = load_scenario("motorway_fog_bank", [*BLIND, f"timeline={plain!r}".replace("None", "null")])
    assert again.timeline == scenario.timeline


def test_an_end_is_a_condition_that_the_run_can_tell() -> None:
    scenario = load_scenario("motorway_fog_bank", [*BLIND, "end_when=ego.speed < 10 km/h"])
    assert str(scenario.end_when) == "ego.speed < 10 km/h"
    for written, told in (
        ("ego.sped < 3 m/s", "unknown signal"),
        ("happened(cut_in)", "end_when: happened(cut_in): unknown event 'cut_in'"),
    ):
        with pytest.raises(InputError, match="end_when: ") as error:
            load_scenario("motorway_fog_bank", [*BLIND, f"end_when={written}"])
        assert told in str(error.value)


def test_a_resolved_timeline_loads_again() -> None:
    begins = "{when: time > 1 s, do: {lead: {brake: {hold_s: null}}, new: {depart: {like: lead, gap_m: 50}}}}"
    scenario = load_scenario("motorway_fog_bank", [*BLIND, f"timeline=[{begins}]"])
    assert override(scenario, []) == scenario
    assert as_written(scenario)["timeline"][0]["do"]["lead"] == [{"brake": {"hold_s": None}}]
