"""The plain values that a run is made of, without a scenario."""

from dataclasses import replace
from pathlib import Path

import pytest

import fogsim
from fogsim.errors import InputError
from fogsim.simulation import AdviceConfig, FogConfig, Periods, RunConfig, TrafficSetup, WorldConfig
from fogsim.simulation.recording import record_run
from fogsim.simulation.road_advice import RoadAdvice
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


def test_advice_without_sections_is_refused() -> None:
    with pytest.raises(InputError, match="needs sections"):
        RoadAdvice(AdviceConfig())


def test_runs_of_values_are_recorded(tmp_path: Path) -> None:
    scenario = fogsim.load_scenario("motorway_fog_bank", [EARLY, "renderer=none", "estimators=[]", "duration_s=0.5"])
    run = record_run(scenario.run_config(), 1, tmp_path / "out", recorders=())
    assert run.summary.values["duration_s"] == pytest.approx(0.5)
    assert (tmp_path / "out" / "metrics.json").is_file()
