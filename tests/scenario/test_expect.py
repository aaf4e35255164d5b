"""The block ``expect`` of scenario files: what it becomes, and what is refused with file, line and key."""

from pathlib import Path

import pytest

from fogsim.conditions import Always, MetricCheck, Whenever
from fogsim.errors import InputError
from fogsim.scenario import Scenario, load_scenario, override, resolved
from fogsim.scenario.expect.schema import clauses_of

PLAIN = """\
name: expecting
duration: 60 s
road: {template: motorway, length: 2 km, lanes: 2, limit: 130 km/h}
actors:
  ego: {lane: right, speed: 90 km/h}
  slow: {type: truck, ahead_of: ego, gap: 400 m, speed: 80 km/h}
fog: {visibility: 150 m}
expect:
"""


def load(folder: Path, expect: str) -> Scenario:
    file = folder / "expecting.fog.yaml"
    file.write_text(f"{PLAIN}{expect}", encoding="utf-8")
    return load_scenario(file)


def test_what_a_test_engineer_writes(tmp_path: Path) -> None:
    scenario = load(
        tmp_path,
        """\
  advice_in_time: {whenever: fog.visibility_at_camera falls below 100 m, within: 2 s, require: advice <= 70 km/h,
                   at_least: 3 times}
  safe: {never: ego.collision, always: ego.ttc >= 1.5 s}
  near: {while: gap(ego, slow) < 50 m, always: {ego.speed: "< 90 km/h"}, for_at_least: 2 s}
  flows: {metric: minimum_gap_m >= 0.01 km}
""",
    )
    advice, never, always, near, metric = clauses_of(scenario.expect)
    assert isinstance(advice, Whenever)
    assert (advice.within, advice.at_least, advice.throughout) == (2.0, 3, False)
    assert str(advice.require) == "advice <= 70 km/h"
    assert {never.clause, always.clause} == {"never", "always"}
    assert isinstance(near, Always)
    assert (str(near.during), near.for_at_least) == ("gap(ego, slow) < 50 m", 2.0)
    assert metric == MetricCheck("flows", "minimum_gap_m", ">=", 10.0)


def test_an_expectation_may_have_the_name_of_a_key(tmp_path: Path) -> None:
    scenario = load(tmp_path, "  always: {never: ego.collision, while: time > 3 s, for_at_least: 2 s}\n")
    assert scenario.expect["always"].for_at_least_s == 2.0
    # Times may be words.
    words = load(tmp_path, "  a: {whenever: ego.collision, require: time > 3 s, at_least: once}\n")
    assert words.expect["a"].at_least == 1


def test_a_resolved_scenario_is_read_as_what_it_was(tmp_path: Path) -> None:
    scenario = load(tmp_path, "  safe: {never: ego.collision, while: time > 3 s}\n")
    written = resolved(scenario)["expect"]["safe"]
    assert (written["never"], written["while"]) == ("ego.collision", "time > 3 s")
    again = override(scenario, ["expect.safe.never=ego.speed < 3 km/h"])
    assert str(again.expect["safe"].never) == "ego.speed < 3 km/h"
    assert again.expect["safe"].during == scenario.expect["safe"].during


def test_what_is_refused(tmp_path: Path) -> None:
    for expect, told in [
        ("a: {never: ego.colision}", "expect.a.never: 'ego.colision': unknown signal 'ego.colision'; did you mean"),
        ("a: {always: ego.speed >= 0}", "expect.a.always: this cannot fail: ego.speed >= 0 is always true"),
        ("a: {always: ego.speed < 0}", "expect.a.always: this cannot pass"),
        ("a: {eventually: ego.speed >= 0}", "expect.a.eventually: this cannot fail"),
        ("a: {whenever: ego.collision, require: ego.speed >= 0}", "expect.a.require: this cannot fail"),
        ("a: {always: time > 3 s, while: ego.speed < 0}", "expect.a.while: this would test nothing"),
        ("a: {whenever: ego.speed < 0, require: ego.collision}", "expect.a.whenever: this would test nothing"),
        ("a: {whenever: ego.collision}", "expect.a.whenever: needs require"),
        ("a: {throughout: false}", "expect.a: expects nothing"),
        ("a: {never: ego.collision, at_least: 3 times}", "expect.a.at_least: goes with whenever, which is missing"),
        ("a: {never: ego.collision, within: 3 s}", "expect.a.within_s: goes with whenever or eventually or happened"),
        ("a: {whenever: ego.collision, require: time > 3 s, throughout: true}", "expect.a.throughout: needs within"),
        ("a: {never: ego.collision, whil: time > 3 s}", "expect.a.whil: unknown key; did you mean 'while'?"),
        ("a: {never: slow.speed > 3 kg}", "the unit 'kg' does not fit"),
        ("a: {never: gap(ego, slwo) < 3 m}", "there is no vehicle 'slwo' in"),
        ("a: {never: signal(C).state == red}", "the net has no traffic lights 'C'; it has none"),
        ("a: {never: estimate(negru2013).valid}", "unknown estimator 'negru2013'; known: joint_road, lead_contrast"),
        ("a: {never: fog.bank(0)}", "there is no fog.banks.0; the fog has no banks"),
        ("a: {happened: timeline.0}", "unknown event 'timeline.0'"),
        ("a: {never: happened(cut_in)}", "unknown event 'cut_in'"),
        ("a: {metric: minimum_gab_m < 3}", "unknown metric 'minimum_gab_m'; did you mean 'minimum_gap_m'?"),
        ("a: {metric: minimum_gap_m}", "expect.a.metric: expected a key of metrics.json"),
        ("a: {metric: minimum_gap_m < 3 kg}", "the unit 'kg' does not fit"),
        ("a: {metric: ending != colision}", "unknown value 'colision' of ending; did you mean 'collision'?"),
        ("a: {metric: minimum_gap_m < few}", "expected a number after <, got 'few'"),
        ("a: 3", "expect.a: "),
    ]:
        with pytest.raises(InputError) as error:
            load(tmp_path, f"  {expect}\n")
        (line,) = str(error.value).splitlines()
        assert told in line
        assert line.startswith(f"{tmp_path / 'expecting.fog.yaml'}:9: expect.a")


def test_without_frames_and_ego_less_can_be_told(tmp_path: Path) -> None:
    scenario = load(tmp_path, "  a: {never: ego.collision}\n")
    with pytest.raises(InputError, match=r"belief\.error needs frames"):
        override(scenario, ["renderer=none", "estimators=[]", "expect.a.never=belief.error > 20 %"])


def test_metrics_of_own_methods(tmp_path: Path) -> None:
    own = 'class Own:\n    method = "own:Own"\n    def __init__(self, camera): ...\n    def reset(self): ...\n'
    (tmp_path / "own.py").write_text(f"{own}    def update(self, observation): ...\n", encoding="utf-8")
    settings = ["estimators=['own:Own']", "expect.a.metric=estimators.own:Own.valid_share >= 0.5"]
    scenario = override(load(tmp_path, "  a: {never: ego.collision}\n"), settings)
    assert [clause.expected for clause in clauses_of(scenario.expect)][-1] == "estimators.own:Own.valid_share >= 0.5"


def test_metrics_in_their_units(tmp_path: Path) -> None:
    for written, value in [
        ("traffic_delay_share <= 5 %", 0.05),
        ("minimum_gap_m <= inf", float("inf")),
        ("mean_speed_mps > 72 km/h", 20.0),
        ("belief_median_error_percent < 20 %", 20.0),
        ("belief_median_error_percent < 20", 20.0),
        ("estimators.joint_road.valid_share >= 0.5", 0.5),
        ("ending == arrived", "arrived"),
    ]:
        (check,) = clauses_of(load(tmp_path, f"  a: {{metric: {written}}}\n").expect)
        assert isinstance(check, MetricCheck)
        assert check.value == (pytest.approx(value) if isinstance(value, float) else value)
