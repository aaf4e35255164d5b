"""The report of a study, from made-up runs: what it says, and that its figures and tables are whole."""

import csv
import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

from fogsim.scenario import load_scenario
from fogsim.study.comparison import compare_to_baseline, mean_interval
from fogsim.study.main_metrics import MAIN_METRICS, short_number, signed
from fogsim.study.plan import Study, StudyRun
from fogsim.study.profile_figures import collisions_figure, speed_figure
from fogsim.study.profiles import CLASSES, PooledProfiles, pool_profiles
from fogsim.study.report import differences_figure, trade_off_figure, write_report
from fogsim.study.report_words import events_of_both
from fogsim.study.table import rows_of_cells
from tests.recorders.test_report import Page

FACTORS = {"policy": ("none", "slow <1>"), "fog": ("thin", "thick")}
SEEDS = 8


def profiles(speed: float, exposed: float) -> dict[str, object]:
    """Of a run of 100 vehicle-seconds on 200 m of road, of which 150 m were driven on, with one collision."""
    return {
        "vehicle_time_s": 100.0,
        "time_to_collision": {
            "class_s": 0.25,
            "moving_s": [0.0] * 8 + [exposed] + [0.0] * (CLASSES - 9),
            "queue_s": [0.0] * CLASSES,
        },
        "road": {
            "place_m": [25.0, 75.0, 175.0],
            "ego_time_s": [2.0, 2.0, 2.0],
            "ego_way_m": [2 * speed] * 3,
            "ego_extinction_time_s_per_m": [0.02, 0.06, 0.12],
            "vehicle_time_s": [10.0, 20.0, 10.0],
            "vehicle_way_m": [10 * speed, 40 * speed, 10 * speed],
            "vehicle_extinction_time_s_per_m": [0.0] * 3,
        },
        "path": {"place_m": [0.0, 50.0, 100.0], "x_m": [0.0, 40.0, 80.0], "y_m": [0.0, 30.0, 60.0]},
        "collisions": {
            "time_s": [3.0, 4.0],
            "x_m": [40.0, None],
            "y_m": [30.0, None],
            "impact_speed_mps": [5.0, 1.0],
            "collider": ["a", "b"],
            "victim": ["c", "d"],
        },
        "collision_count": 2,
    }


@pytest.fixture(scope="module")
def study() -> Study:
    scenario = load_scenario("motorway_fog_bank", ["renderer=none", "estimators=[]"])
    cells = [{"policy": p, "fog": f} for p in FACTORS["policy"] for f in FACTORS["fog"]]
    runs = [StudyRun(0, cell, seed, scenario, "k") for cell in cells for seed in range(SEEDS)]
    settings = {"policy": {"none": (), "slow <1>": ("advice=<slow>",)}, "fog": {"thin": (), "thick": ()}}
    return Study("made & up", FACTORS, {"policy": "none"}, 0.95, tuple(runs), level_settings=settings)


def rows_of(study: Study) -> list[dict[str, str | float | int | None]]:
    """Runs in which the second policy is slower by 5 m/s and nothing else differs but by chance."""
    rng = np.random.default_rng(1)
    of_seed = rng.normal(30.0, 2.0, SEEDS)
    rows = []
    for number, run in enumerate(study.runs):
        slow = run.levels["policy"] != "none"
        metrics = {
            "collisions": int(rng.integers(0, 3)),
            "ego_collisions": 0,
            "traffic_mean_speed_mps": float(of_seed[run.seed] - 5.0 * slow + rng.normal(0, 0.2)),
            "traffic_overdriven_m_per_vehicle_km_in_fog": 900.0 - 90.0 * slow + float(rng.normal(0, 9.0)),
            "traffic_vehicle_distance_in_fog_m": 10_000.0 - 1200.0 * slow,
            "distance_m": 1000.0 + number,
        }
        about = {"seed": run.seed, "status": "complete", "message": None}
        rows.append({"run": number, **run.levels, **about, **metrics})
    return rows


@pytest.fixture(scope="module")
def folder(study: Study, tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("report")
    written(study, rows_of(study), made)
    return made


def written(study: Study, rows: list[dict[str, str | float | int | None]], folder: Path) -> str:
    found = [(run.levels, run.seed, profiles(30.0 - 5.0 * (run.levels["policy"] != "none"), 2.0)) for run in study.runs]
    write_report(study, rows, pool_profiles(found), folder)
    return (folder / "report.html").read_text(encoding="utf-8")


def table(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_the_report_says_what_is_shown_and_no_more(study: Study, folder: Path) -> None:
    page = (folder / "report.html").read_text(encoding="utf-8")
    parsed = Page(page)
    assert all(one.startswith(("data:image/svg+xml;base64,", "figures/")) for one in parsed.images + parsed.links)
    summary = page[page.index("<h2>Summary") : page.index("<h2>Main metrics")]
    assert "policy (2) × fog (2) × seed (8) = 32 runs, all complete" in summary
    assert "slow &lt;1&gt;" in summary
    better = r"Overdriven \[m/veh·km in fog\]: better with slow &lt;1&gt; \(−(8|9)\d(\.\d+)?\)"
    assert len(re.findall(better, summary)) == 2
    # Speed is neither better nor worse by itself, and collisions differ by chance alone.
    assert len(re.findall(r"Mean speed of all \[km/h\]: lower with slow &lt;1&gt; \(−1[78][.\d]*\)", summary)) == 2
    assert summary.count("No difference could be shown in: Collisions of all vehicles.") == 2
    assert "4 of 6 comparisons that vary" in summary
    moved = "Vehicle-km in fog: 8.8 veh·km with slow &lt;1&gt; · thin, 10 veh·km under the baseline (−12 %)."
    assert moved in page
    assert "No camera is simulated, since nothing in the run depends on it." in page
    assert "advice=&lt;slow&gt;" in page
    assert "fogsim study study.yaml --out" in page
    comparison = table(folder / "comparison.csv")
    by_metric = {row["metric"]: row for row in comparison if row["fog"] == "thin"}
    assert set(by_metric) == {
        *(name for name in MAIN_METRICS if name in rows_of(study)[0]),
        "distance_m",
        "traffic_vehicle_distance_in_fog_m",
    }
    assert by_metric["ego_collisions"]["remark"] == "does not vary"
    assert float(by_metric["traffic_mean_speed_mps"]["p_value_adjusted"]) <= 0.05
    assert by_metric["distance_m"]["p_value_adjusted"] == ""
    assert "seeds_for_10_percent" in comparison[0]


def test_figures_are_there_as_svg_and_csv(study: Study, folder: Path) -> None:
    names = {path.stem for path in (folder / "figures").iterdir()}
    assert names == {
        *(
            "trade_off_collisions",
            "trade_off_traffic_overdriven_m_per_vehicle_km_in_fog",
            "ttc_survival",
            "speed_over_road",
        ),
        *("collisions_map", "collisions", "traffic_mean_speed_mps", "traffic_overdriven_m_per_vehicle_km_in_fog"),
    }
    survival = {
        (row["policy"], float(row["time_to_collision_s"])): float(row["share_above"])
        for row in table(folder / "figures" / "ttc_survival.csv")
    }
    assert survival["none", 2.0] == 1.0
    assert survival["none", 2.25] == pytest.approx(0.98)
    speeds = [row for row in table(folder / "figures" / "speed_over_road.csv") if row["fog"] == "thin"]
    assert [float(row["mean_speed_mps"]) for row in speeds] == pytest.approx([30, 60, 30, 25, 50, 25])
    hits = table(folder / "figures" / "collisions_map.csv")
    assert len(hits) == 2 * len(study.runs)
    assert (hits[0]["x_m"], hits[1]["x_m"]) == ("40.0", "")
    for path in (folder / "figures").glob("*.svg"):
        assert path.read_text(encoding="utf-8").rstrip().endswith("</svg>")
    metrics = "traffic_mean_speed_mps", "collisions"
    again = trade_off_figure(study, rows_of(study), *metrics)
    assert (folder / "figures" / f"{again.name}.svg").read_text(encoding="utf-8") == again.svg


def test_chosen_metrics_and_failed_runs(study: Study, tmp_path: Path) -> None:
    chosen = dataclasses.replace(
        study, metrics=("distance_m", "max_drac_mps2"), wanted_interval=0.025, confidence=0.999
    )
    rows = rows_of(study)
    rows[3] = {**{k: rows[3][k] for k in ("run", "policy", "fog", "seed")}, "status": "failed", "message": "a < b"}
    (tmp_path / "figures").mkdir()
    for name in ("collisions.svg", "collisions.csv", "mine.svg"):
        (tmp_path / "figures" / name).touch()
    page = written(chosen, rows, tmp_path)
    # Figures of the metrics before are gone.
    left = {path.name for path in (tmp_path / "figures").glob("*.svg")}
    assert "mine.svg" in left
    assert "collisions.svg" not in left
    assert "PARTIAL: 1 of 32 runs missing or failed" in page
    assert "a &lt; b" in page
    assert "<td>max_drac_mps2</td><td>no run has a value</td>" in page
    comparison = table(tmp_path / "comparison.csv")
    assert {row["metric"] for row in comparison} == {"distance_m"}
    assert "seeds_for_2.5_percent" in comparison[0]
    assert "seeds for ± 2.5%" in page
    assert "99.9% interval" in page
    assert "100% interval" not in page


def test_events_are_of_the_compared_seeds(study: Study) -> None:
    """Without the baseline's fourth run, the fourth run of the other policy is compared to nothing."""
    rows = [{"run": 0, **run.levels, "seed": run.seed, "collisions": 2} for run in study.runs]
    (one, _) = compare_to_baseline(study, [*rows[:3], *rows[4:]], ["collisions"])
    cells = rows_of_cells(study.factors, [*rows[:3], *rows[4:]])
    assert (one.pairs, events_of_both(study, cells, one)) == (7, (14, 14))


def test_figures_name_all_levels_of_the_baseline(study: Study) -> None:
    both = dataclasses.replace(study, baseline={"policy": "none", "fog": "thin"})
    figure = differences_figure(both, "collisions", compare_to_baseline(both, rows_of(study), ["collisions"]))
    assert "difference to none · thin of runs" in figure.caption
    assert "difference to none · thin<" in figure.svg or "difference to none · thin -->" in figure.svg


def test_an_end_of_an_interval_that_is_the_mean_but_for_a_rounding_is_drawn(study: Study) -> None:
    values = 0.01779087, 17.31807262
    assert mean_interval(np.array(values), 0.5)[1] < np.mean(values)
    rows = [{**run.levels, "seed": run.seed, "mean_speed_mps": values[run.seed % 2]} for run in study.runs]
    rows = [{**row, "collisions": row["mean_speed_mps"]} for row in rows if row["seed"] < 2]
    trade_off_figure(dataclasses.replace(study, confidence=0.5), rows, "mean_speed_mps", "collisions")


def test_a_rare_event_that_one_policy_causes_is_found(study: Study, tmp_path: Path) -> None:
    """Collisions in six of 15 runs of one policy of four: the others are nine tenths of all values, and 0."""
    factors = {"policy": ("none", "a", "b", "c"), "fog": ("thin",)}
    runs = [
        dataclasses.replace(study.runs[0], levels={"policy": policy, "fog": "thin"}, seed=seed)
        for policy in factors["policy"]
        for seed in range(15)
    ]
    levels = {name: dict.fromkeys(of_factor, ()) for name, of_factor in factors.items()}
    rare = dataclasses.replace(study, factors=factors, runs=tuple(runs), level_settings=levels)
    rows = [
        {"run": i, **run.levels, "seed": run.seed, "status": "complete", "message": None}
        | {"collisions": int(run.levels["policy"] == "c" and run.seed < 6)}
        for i, run in enumerate(runs)
    ]
    write_report(rare, rows, {}, tmp_path)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "Collisions of all vehicles [1/run]: worse with c (+0.4); no difference could be shown for a, b." in page
    assert "saturated" not in page
    assert (tmp_path / "figures" / "collisions.svg").exists()


def test_of_pairs_without_a_value_no_difference_is_claimed(study: Study, tmp_path: Path) -> None:
    rows = [
        {**row, "minimum_time_to_collision_s": None if row["policy"] != "none" and row["seed"] == 0 else 2.0 - slow}
        for row in rows_of(study)
        for slow in [0.1 * (row["policy"] != "none") + 0.01 * int(str(row["seed"]))]
    ]
    write_report(study, rows, {}, tmp_path)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    finding = "no difference could be shown for slow &lt;1&gt; (1 of 8 pairs lack a value)."
    assert page.count(finding) == 2
    found = [row for row in table(tmp_path / "comparison.csv") if row["metric"] == "minimum_time_to_collision_s"]
    assert {(row["p_value"], row["low"], row["remark"]) for row in found} == {("", "", "1 of 8 pairs lack a value")}
    assert not list((tmp_path / "figures").glob("*minimum_time_to_collision_s*"))


def test_without_any_finished_run_there_is_a_report_too(study: Study, tmp_path: Path) -> None:
    rows = [
        {"run": i, **run.levels, "seed": run.seed, "status": "missing", "message": None}
        for i, run in enumerate(study.runs)
    ]
    write_report(study, rows, {}, tmp_path)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "runs, 0 complete" in page
    assert "PARTIAL: 32 of 32 runs" in page
    assert list((tmp_path / "figures").iterdir()) == []


def test_without_an_ego_there_is_no_road_to_draw(study: Study) -> None:
    alone = profiles(20.0, 2.0)
    alone |= {"road": {name: [] for name in alone["road"]}, "path": {name: [] for name in alone["path"]}}
    cells = pool_profiles((run.levels, run.seed, alone) for run in study.runs)
    assert speed_figure(study, cells) is None
    collisions = collisions_figure(study, cells)
    assert len(collisions.rows) == 2 * len(study.runs)
    assert collisions_figure(study, {}) is None


def test_profiles_of_runs_add_up() -> None:
    pooled = PooledProfiles()
    pooled.add(0, profiles(20.0, 2.0))
    pooled.add(1, profiles(40.0, 4.0))
    assert pooled.survival()[-1] == pytest.approx(1 - 6 / 200)
    assert pooled.speeds()[:, 1] == pytest.approx([30, 60, 30])
    assert pooled.speeds(ego_only=True)[:, 1] == pytest.approx([30, 30, 30])
    assert pooled.extinctions()[:, 1] == pytest.approx([0.01, 0.03, 0.06])
    assert [hit.seed for hit in pooled.collisions] == [0, 0, 1, 1]
    assert np.isnan(PooledProfiles().survival()).all()
    assert PooledProfiles().speeds().shape == (0, 3)


def test_differences_are_signed_and_short() -> None:
    for value, said in [(-0.0123456, "−0.012"), (99.9, "+100"), (1234.5, "+1234"), (-2e-7, "−2e−07"), (0.0, "+0")]:
        assert signed(value, 2) == said
    for value, said in [(-52.84, "−52.8"), (999.7, "1000"), (12345.6, "12346"), (0.02, "0.02")]:
        assert short_number(value) == said
