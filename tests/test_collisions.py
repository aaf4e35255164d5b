"""Collisions of an ego, whatever becomes of it, and when they are."""

from dataclasses import replace
from pathlib import Path

import pytest

import fogsim
from fogsim.recorders.report_figures import Curves
from fogsim.testing import check_one_case
from fogsim.values import Collision, Ending
from tests.recorders.synthetic import make_step

CRASH = """
name: crash
duration: 20 s
road: {template: motorway, length: 3 km, lanes: 1, limit: 130 km/h}
actors: {ego: {position: 100 m, speed: 120 km/h}, slow: {type: truck, ahead_of: ego, gap: 60 m, speed: 0 km/h}}
timeline: [{when: time >= 0 s, do: {slow: {stop: {after: 0 m}}}}]
fog: {visibility: 20 m}
renderer: none
estimators: []
advice: none
lighting: low_beam
expect: {safe: {never: ego.collision}}
"""


@pytest.fixture
def crash(tmp_path: Path) -> Path:
    (tmp_path / "crash.fog.yaml").write_text(CRASH, encoding="utf-8")
    return tmp_path / "crash.fog.yaml"


def test_a_collision_that_removes_the_ego_ends_the_run_and_fails_the_test(crash: Path) -> None:
    result = check_one_case(crash, ["traffic.after_collision=remove"])
    assert result.has_failed
    assert (result.metrics["ending"], result.metrics["ego_collisions"]) == (Ending.COLLISION.value, 1)


def test_an_ego_that_has_left_collides_no_second_time(crash: Path) -> None:
    scenario = fogsim.load_scenario(crash, ["traffic.after_collision=remove", "end_on_collision=false"])
    *before, hit, last = fogsim.run(scenario, seed=1)
    assert (last.ending, last.collisions) == (Ending.LEFT_NETWORK, ())
    assert [len(step.collisions) for step in before] == [0] * len(before)
    (collision,) = hit.collisions
    assert hit.time_of(collision) == hit.time == pytest.approx(before[-1].time + 0.1)


def test_reports_show_collisions_when_they_are_in_the_run() -> None:
    """A simulation of one's own may begin at any time of the day."""
    curves, step = Curves(), make_step(3, time=5.0, collisions=(Collision(25_204.9, "ego", "slow", 3.0),))
    curves.add(replace(step, traffic=replace(step.traffic, time=25_205.0)), dict.fromkeys(DERIVED))
    assert curves.collisions == [4.9]


DERIVED = "time_to_collision_s", "visibility_margin_m"
