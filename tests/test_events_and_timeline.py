"""How `traffic.events` differs from a timeline that says the same, and where it does not."""

from pathlib import Path

import pytest

import fogsim
from fogsim.values import Step

ROAD = """
name: braking
duration: 4 s
clocks: {{traffic_step: 0.1 s, camera_period: 0.5 s, decision_period: 0.5 s}}
road: {{template: motorway, length: 2 km}}
actors:
  ego: {{position: 100 m, speed: 72 km/h, lane: right{ego}}}
  other: {{position: 300 m, speed: 72 km/h, lane: left}}
fog: {{visibility: 1000 m}}
renderer: none
sut: {{estimators: [], advice: none}}
{script}
"""


def steps(folder: Path, script: str, ego: str = "") -> list[Step]:
    path = folder / "braking.fog.yaml"
    path.write_text(ROAD.format(script=script, ego=ego), encoding="utf-8")
    return list(fogsim.run(fogsim.load_scenario(path)))


def speed(step: Step) -> float:
    """Speed of the other one [km/h]."""
    row = step.traffic.row("other")
    return 3.6 * float(step.traffic.speed[row])


def event(when: str, to: float, hold: float = 30.0) -> str:
    return f"{{kind: brake, vehicle: other, {when}, to_speed_kmh: {to}, deceleration_mps2: 4, hold_s: {hold}}}"


def entry(when: str, to: float, hold: float = 30.0) -> str:
    return f"{{when: {when}, do: {{other: {{brake: {{to_kmh: {to}, deceleration_mps2: 4, hold_s: {hold}}}}}}}}}"


def test_neither_begins_before_the_ego_is_there(tmp_path: Path) -> None:
    script = f"traffic: {{events: [{event('at_position_m: 50', 0.0, 60.0)}]}}"
    first, *_, last = steps(tmp_path, script, ", depart: 8 s")
    assert speed(first) == pytest.approx(72.0, abs=0.1)
    assert speed(last) < 30.0


def test_events_begin_between_camera_periods(tmp_path: Path) -> None:
    by_event = steps(tmp_path, f"traffic: {{events: [{event('at_time_s: 0.2', 30.0)}]}}")
    by_entry = steps(tmp_path, f"timeline: [{entry('time >= 0.2 s', 30.0)}]")
    assert speed(by_event[1]) < 71.0
    assert speed(by_entry[1]) == pytest.approx(72.0, abs=0.1)


def test_of_two_events_the_lowest_speed_counts_and_of_two_entries_the_later(tmp_path: Path) -> None:
    first, second = ("at_time_s: 0", 30.0), ("at_time_s: 1", 50.0)
    by_event = steps(tmp_path, f"traffic: {{events: [{event(*first)}, {event(*second)}]}}")
    by_entry = steps(tmp_path, f"timeline: [{entry('time >= 0 s', 30.0)}, {entry('time >= 1 s', 50.0)}]")
    assert speed(by_event[-1]) == pytest.approx(30.0, abs=0.5)
    assert speed(by_entry[-1]) == pytest.approx(50.0, abs=0.5)
