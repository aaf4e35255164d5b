"""The methods section of a study, and the numbers of events behind its rates."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from fogsim.cli.app import app
from fogsim.scenario import load_scenario
from fogsim.scenario.wording.sentences import SENTENCES, empty_start, non_default_settings
from fogsim.study import load_study
from fogsim.study.comparison import compare_to_baseline
from fogsim.study.plan import Study
from fogsim.study.report import study_methods
from fogsim.study.report_words import event_count, scarce_events

ALONE = """
scenario: motorway_fog_bank
settings:
  [traffic.ego=none, 'estimators=[]', lighting=low_beam, 'traffic.events=[]', duration_s=20,
   'traffic.along=["approach","bank","exit"]', drivers.compliance.rate=0.6]
factors:
  policy:
    none: [advice=none]
    a16: [advice=netherlands_a16, drivers.advised=signs]
seeds: 2
"""


@pytest.fixture
def study(tmp_path: Path) -> Study:
    path = tmp_path / "mine.yaml"
    path.write_text(ALONE, encoding="utf-8")
    return load_study(path)


def test_a_stranger_finds_the_methods_in_the_text(study: Study) -> None:
    text = study_methods(study).markdown("Methods")
    for needed in (
        *("(policy: none, a16)", "2 seeds (0 to 1), 4 runs", "baseline is policy none"),
        *("at most 20 s", "warm-up of 0 s", "motorway.net.xml", "5.5 km, lanes 3, limit 110 to 130 km/h"),
        *("Flows: 2", "together 2880 vehicles/h", "car 68 %", "60 m from 1300 to 2500 m (edges of 300 m)"),
        *("policy none: No speed is advised.", "netherlands_a16 (Hogema & van der Horst 1997)", "every 500 m"),
        *("Speed choice: observed (White & Jeffery 1980", "in_sight 50 %", "rate 0.6", "Efron 1987", "SUMO (libsumo)"),
        *("| drivers.compliance.rate | 0.6 | 1 |", "| policy | a16 | advice=netherlands_a16, drivers.advised=signs |"),
    ):
        assert needed in text, needed


def test_settings_that_differ_from_the_defaults_are_found_at_any_depth() -> None:
    usual = non_default_settings(load_scenario("motorway_fog_bank"))
    changed = ["drivers.reaction_time_s=2", "fog.wind={speed_kmh: 20, from_deg: 315}", "advice=netherlands_a16"]
    found = non_default_settings(load_scenario("motorway_fog_bank", changed))
    new = {key: one[:2] for key, one in found.items() if usual.get(key) != one}
    assert new == {
        "drivers.reaction_time_s": ("2", "1"),
        "fog.wind.speed_kmh": ("20", ""),
        "fog.wind.from_deg": ("315", ""),
        "advice": ("netherlands_a16", "stopping_sight_distance"),
    }


def test_an_empty_start_is_warned_of_only_where_it_is_one(study: Study) -> None:
    assert "warm-up is 0 s" in empty_start(study.runs[0].scenario)
    assert empty_start(load_scenario("motorway_fog_bank")) == ""


def rows_of(study: Study, conflicts: tuple[float, ...]) -> list[dict[str, str | float | int | None]]:
    return [
        {
            "run": run.number,
            **run.levels,
            "seed": run.seed,
            "status": "complete",
            "traffic_conflicts_per_vehicle_km": rate,
            "traffic_vehicle_distance_m": 4000.0,
            "collisions": 0,
        }
        for run, rate in zip(study.runs, conflicts, strict=True)
    ]


def test_events_are_a_rate_times_its_denominator(study: Study) -> None:
    rows = rows_of(study, (0.5, 0.25, 0.0, 1.0))
    assert event_count("traffic_conflicts_per_vehicle_km", rows) == 7
    assert event_count("collisions", rows) == 0
    assert event_count("traffic_vehicle_distance_m", rows) is None


def test_events_that_are_too_few_to_differ_are_reported_with_their_number(study: Study) -> None:
    metrics = ["collisions", "traffic_conflicts_per_vehicle_km"]
    rare, common = rows_of(study, (0.5, 0.25, 0.0, 0.5)), rows_of(study, (0.5, 0.25, 0.0, 1.0))
    none, few = scarce_events(study, rare, compare_to_baseline(study, rare, metrics))
    assert "no such event in any of its 4 runs (16 vehicle-km): Collisions of all" in none
    # 2^(1 − 6) is the largest power of two below 0.05.
    assert "Fewer than the 6 events" in few
    assert "(at most 5)" in few
    assert len(scarce_events(study, common, compare_to_baseline(study, common, metrics))) == 1


def test_check_builds_the_fog_along_the_road(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    photons = "fog={visibility_m: 60, airlight: photons, top_m: -1}"
    path.write_text(ALONE.replace("none: [advice=none]", f"none: [advice=none, '{photons}']"), encoding="utf-8")
    outcome = CliRunner().invoke(app, ["study", str(path), "--check"])
    assert "policy=none: fog.airlight: photons is known for eyes within the layer" in str(outcome.exception)


@pytest.mark.parametrize("name", ["patchy_fog", "city_fog", "highway_99_corridor", "rural_night_oncoming"])
def test_shipped_scenarios_can_be_put_in_words(name: str) -> None:
    said = {heading: words(load_scenario(name)) for heading, words in SENTENCES.items()}
    assert all(text.endswith(".") and "None" not in text for text in said.values())


def test_the_mix_of_a_template_s_demand_and_clear_air_outside_banks_are_in_the_text(tmp_path: Path) -> None:
    text = """
name: lorries
road: {template: motorway}
demand: {same_way: 600 veh/h, mix: {truck: 60 %}}
fog: {outside_visibility: inf, banks: [{start: 300 m, end: 600 m, visibility: 50 m}]}
"""
    (tmp_path / "scenario.yaml").write_text(text, encoding="utf-8")
    scenario = load_scenario(tmp_path)
    assert SENTENCES["Demand"](scenario).startswith("Vehicles per hour: same way 600 (truck 60 %, car 40 %).")
    fog = SENTENCES["Fog"](scenario)
    assert fog.startswith("Clear air outside banks, and 50 m from 300 to 600 m (edges of 100 m), up to 250 m above the")
