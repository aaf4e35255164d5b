"""The plain values that a run is made of, without a scenario."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fogsim
from fogsim.errors import InputError
from fogsim.sensors import Gps
from fogsim.simulation import AdviceConfig, FogConfig, Periods, RunConfig, TrafficSetup, WorldConfig
from fogsim.simulation.recording import record_run
from fogsim.simulation.road_advice import RoadAdvice
from fogsim.traffic.setup import AfterCollision
from fogsim.values import FogField
from tests.data.early_motorway import EARLY

CONFIG = RunConfig(TrafficSetup(None), WorldConfig(FogConfig(FogField(0.03, (1000.0,) * 3))))


def test_a_scenario_and_the_values_that_it_becomes_are_the_same_run() -> None:
    scenario = fogsim.load_scenario(
        "motorway_fog_bank", [EARLY, "camera.width=64", "camera.height=48", "duration_s=0.3"]
    )
    config = scenario.run_config()
    assert config == scenario.run_config()
    assert config.run_config() is config
    last, same = ([*fogsim.run(one, seed=2)][-1] for one in (scenario, config))
    assert (last.observation.frame.image == same.observation.frame.image).all()
    assert last.belief.visibility == same.belief.visibility


def test_clocks_that_do_not_fit_are_refused() -> None:
    with pytest.raises(InputError, match=r"2 traffic steps of 0.1 s are not one camera period, 0.1 s"):
        replace(CONFIG, periods=Periods(traffic_steps=2))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: TrafficSetup("a.net.xml"), r"TrafficSetup: net must be a path or nothing, got 'a\.net\.xml'"),
        (lambda: TrafficSetup(None, routes=Path("a.rou.xml")), "routes must be a list, each a path"),
        (lambda: TrafficSetup(None, keep_lane="ego"), "keep_lane must be a list, each text, got 'ego'"),
        (lambda: TrafficSetup(None, after_collision="explode"), "after_collision must be one of stop, remove"),
        (lambda: TrafficSetup(None, reading_radius=-5.0), "reading_radius must be a number ≥ 1 m"),
        (lambda: Periods(decision_frames=0), "decision_frames must be a whole number ≥ 1"),
        (lambda: WorldConfig(FogField(0.03, (1000.0,) * 3)), "WorldConfig: fog must be a FogConfig"),
        (lambda: replace(CONFIG.world, illuminance=-1.0), "illuminance must be a number 0 … 200000 lx"),
        (lambda: replace(CONFIG, estimators=("negru2013",)), "estimators must be a list, each a MethodConfig"),
        (
            lambda: replace(CONFIG, estimators=2 * CONFIG.estimators),
            "estimators must differ, got joint_road, joint",
        ),
        (lambda: replace(CONFIG, camera=CONFIG.camera.camera), "camera must be a CameraConfig"),
        (
            lambda: replace(CONFIG, sensors=replace(CONFIG.sensors, gps=Gps(float("nan")))),
            r"RunConfig: sensors\.gps\.position_deviation must be a number, got nan",
        ),
    ],
)
def test_mistakes_in_its_parts_are_named(make: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()


def test_numpys_numbers_and_words_are_taken() -> None:
    setup: Any = TrafficSetup(None, step_length=np.float32(0.5), after_collision="remove")  # type: ignore[arg-type]
    assert (repr(setup.step_length), setup.after_collision) == ("0.5", AfterCollision.REMOVE)
    assert type(setup.after_collision) is AfterCollision


def test_advice_without_sections_is_refused() -> None:
    with pytest.raises(InputError, match="needs sections"):
        RoadAdvice(AdviceConfig())


def test_runs_of_values_are_recorded(tmp_path: Path) -> None:
    scenario = fogsim.load_scenario("motorway_fog_bank", [EARLY, "renderer=none", "estimators=[]", "duration_s=0.5"])
    run = record_run(scenario.run_config(), 1, tmp_path / "out", recorders=())
    assert run.summary.values["duration_s"] == pytest.approx(0.5)
    assert (tmp_path / "out" / "metrics.json").is_file()
