"""Expectations and triggers that decide nothing are refused when the file is read, with file, line, key and reason."""

from pathlib import Path

import pytest

from fogsim.errors import InputError
from fogsim.scenario import load_scenario, override
from fogsim.scenario.document import Document
from fogsim.scenario.timeline import pointless_triggers

PLAIN = """\
name: pointless
duration: 2 s
clocks: {camera_period: 0.5 s, decision_period: 1 s}
road: {template: rural, length: 1 km, lanes: 1, oncoming_lanes: 1}
actors:
  ego: {position: 100 m, speed: 80 km/h}
  parked: {type: car, ahead_of: ego, gap: 300 m, stands: true}
fog: {visibility: 60 m}
"""

NEVER_TRUE = [
    ("time > 3 s", "time > 3 s is never true: time is at least 0 s and at most 2 s"),
    ("time rises above 2 s", "time rises above 2 s is never true"),
    ("ego.collision for 5 s", "ego.collision for 5 s is never true: time is at least 0 s and at most 2 s"),
    ("ego.collision for 1e300 s", "ego.collision for 1e300 s is never true"),
    ("ego.collision for -1 s", "the time after 'for' must be longer than 0 s and finite"),
    ("ego.collision for 0 s", "the time after 'for' must be longer than 0 s and finite"),
    ("ego.collision for inf s", "the time after 'for' must be longer than 0 s and finite"),
    ("ego.speed < 0 km/h", "ego.speed < 0 km/h is never true: ego.speed is at least 0 km/h and at most 500 km/h"),
    ("fog.visibility_at_camera < 0 m", "fog.visibility_at_camera is at least 0 m"),
    ("belief.error < -1 %", "belief.error is at least 0 %"),
    ("ego.lane == 1000000000", "ego.lane == 1000000000 is never true: ego.lane is at least 0"),
    ("ego.lane rises above 4", "ego.lane rises above 4 is never true"),
    ("ego.position > 3 km", "ego.position > 3 km is never true: ego.position is at least -50 m and at most"),
    ("ego.speed > ego.speed", "ego.speed > ego.speed compares ego.speed with itself"),
    ("ego.speed falls below ego.speed", "ego.speed falls below ego.speed compares ego.speed with itself"),
    ("gap(ego, ego) < 5 m", "gap(ego, ego) names the same vehicle twice"),
    ("distance(parked, parked) > 1 m", "distance(parked, parked) names the same vehicle twice"),
    ('headway(ego, ego, "0 m") < 2 s', "names the same vehicle twice"),
    ("1 m > 2 m", "expected a signal such as ego.speed"),
]
"""A condition that is never true, or is none, and why."""


def refused(tmp_path: Path, written: str, *settings: str) -> str:
    """The one line with which a file is refused."""
    file = tmp_path / "pointless.fog.yaml"
    file.unlink(missing_ok=True)  # as in tests/scenario/test_fuzz.py
    file.write_text(f"{PLAIN}{written}\n", encoding="utf-8")
    with pytest.raises(InputError) as error:
        load_scenario(file, settings)
    (line,) = str(error.value).splitlines()
    assert line.startswith(f"{file}:9: ")
    return line


def test_an_expectation_that_decides_nothing(tmp_path: Path) -> None:
    for condition, why in NEVER_TRUE:
        for clause in ["never: '{}'", "eventually: '{}'", "always: 'not ({})'", "never: 'ego.collision or ({})'"]:
            line = refused(tmp_path, f"expect: {{safe: {{{clause.format(condition)}}}}}")
            assert f"expect.safe.{clause.partition(':')[0]}: " in line
            assert why in line


def test_a_condition_that_never_applies(tmp_path: Path) -> None:
    always = "ego.speed > 3 km/h"
    others = {"while": f"always: {always}", "whenever": f"require: {always}", "require": "whenever: ego.collision"}
    for condition, why in NEVER_TRUE[:4]:
        for key, other in others.items():
            line = refused(tmp_path, f"expect: {{safe: {{{key}: '{condition}', {other}}}}}")
            assert f"expect.safe.{key}: " in line
            assert why in line


def test_a_trigger_that_can_never_come(tmp_path: Path) -> None:
    for condition, why in NEVER_TRUE:
        for place in ["timeline: [{{when: '{}', do: {{ego: {{brake: {{}}}}}}}}]", "end_when: '{}'"]:
            line = refused(tmp_path, place.format(condition))
            assert ("timeline.0.when: " if place.startswith("timeline") else "end_when: ") in line
            assert why in line


def test_times_bounds_and_names_that_decide_nothing(tmp_path: Path) -> None:
    for expectation, why in [
        ("{eventually: time > 1.5 s, within: 1 s}", "this cannot pass: time > 1.5 s is never true"),
        ("{eventually: ego.collision, within: 3 s}", "this cannot be decided: the run lasts 2 s; got 3 s"),
        ("{never: ego.collision, for_at_least: 3 s}", "this cannot be decided: the run lasts 2 s; got 3 s"),
        (
            "{whenever: time > 1 s, require: ego.collision, within: 1.5 s}",
            "at least 0 s and at most 0.5 s (within 1.5 s",
        ),
        ("{always: time <= 2 s}", "this cannot fail: time <= 2 s is always true"),
        ("{always: ego.speed >= 0 or ego.collision}", "this cannot fail"),
        ("{metric: traffic_fog_time_share <= 150 %}", "this cannot fail: traffic_fog_time_share is at least 0 %"),
        ("{metric: traffic_fog_time_share > 100 %}", "this cannot pass"),
        ("{metric: traffic_fog_time_share < -0.1}", "this cannot pass"),
        ("{never: ego.leader == parkd}", "there is no vehicle 'parkd' in"),
    ]:
        assert why in refused(tmp_path, f"expect: {{safe: {expectation}}}")


def test_the_ego_has_two_names(tmp_path: Path) -> None:
    line = refused(tmp_path, "expect: {safe: {never: 'gap(ego, parked) < 3 m'}}", "traffic.ego=parked")
    assert "gap(ego, parked) names the same vehicle twice" in line


def test_what_can_come_is_read(tmp_path: Path) -> None:
    for written in [
        "expect: {safe: {never: ego.collision, always: ego.position < 1 km}}",
        "expect: {safe: {eventually: time >= 2 s, within: 2 s}}",
        "expect: {safe: {never: ego.collision for 2 s}}",
        "expect: {safe: {never: ego.lane == 1, always: ego.lane == right}}",
        "expect: {safe: {always: ego.leader == parked or ego.leader == none}}",
        "expect: {safe: {metric: traffic_fog_time_share < 100 %}}",
        "expect: {safe: {metric: traffic_delay_share < 150 %}}",
        "timeline: [{when: time >= 0 s, do: {ego: {brake: {}}}}]",
    ]:
        file = tmp_path / "fine.fog.yaml"
        file.write_text(f"{PLAIN}{written}\n".replace("lanes: 1, on", "lanes: 2, on"), encoding="utf-8")
        load_scenario(file)


def test_triggers_may_be_late_where_a_run_is_shortened_or_imported(tmp_path: Path) -> None:
    file = tmp_path / "late.fog.yaml"
    late = f"{PLAIN}timeline: [{{when: time > 1 s, do: {{ego: {{brake: {{}}}}}}}}]\n"
    file.write_text(late, encoding="utf-8")
    scenario = load_scenario(file, ["duration=0.5 s"])
    assert override(scenario, ["description=late"]).timeline
    limits = {"time": (0.0, 0.5)}
    imported = Document(file, {}, {("timeline", 0, "when"): "story.xosc:12"})
    assert not list(pointless_triggers(imported, scenario, limits))
    written = Document(file, {}, {("timeline", 0, "when"): f"{file}:9"})
    assert list(pointless_triggers(written, scenario, limits))
