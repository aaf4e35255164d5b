"""A person whom a vehicle strikes, from SUMO to metrics."""

from pathlib import Path

from fogsim.metrics import RunMetrics
from fogsim.scenario import load_scenario
from fogsim.simulation.loop import run
from fogsim.values import Ending

CHILD = """
name: struck
road: {template: straight, length: 600 m, lanes: 1, limit: 50 km/h, footways: true, zebra_crossings: [200 m]}
fog: {visibility: 15 m}
duration: 20 s
renderer: none
estimators: []
actors:
  ego: {position: 60 m, speed: 50 km/h}
  child: {type: person, position: 198 m, waits: true, crosses_at: 200 m}
timeline:
  - {when: "time > 0.5 s", do: {ego: {speed: {to: 50 km/h, over: 1 s, for: 60 s}}}}
  - {when: "gap(ego, child) < 46 m", do: {child: {walk: {speed: 6 km/h}}}}
"""
"""A driver who sees 15 m and drives 50 km/h, and a child that does not look."""


def test_it_is_a_collision_of_the_ego_that_ends_the_run(tmp_path: Path) -> None:
    file = tmp_path / "scenario.yaml"
    file.write_text(CHILD, encoding="utf-8")
    steps = list(run(load_scenario(file), seed=1))
    assert steps[-1].ending is Ending.COLLISION
    assert [(one.collider, one.victim) for step in steps for one in step.collisions] == [("ego", "child")]
    metrics = RunMetrics(names=["collisions"])
    for step in steps:
        metrics.update(step)
    assert metrics.summary().values["ego_collisions"] == 1
