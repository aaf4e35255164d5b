"""Traffic alone in fog: everybody is read, advice goes by meters, and what needs an ego is refused."""

import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

import fogsim
from fogsim.errors import FogSimError, InputError
from fogsim.metrics import RunSummary, TrafficRunMetrics
from fogsim.scenario import Scenario, load_scenario
from fogsim.scenario.build import check_frames
from fogsim.scenario.loading import scenario_from_config
from fogsim.simulation.traffic_run import TrafficRun
from fogsim.study.execution import measure_run
from fogsim.study.plan import load_study, needs_camera
from fogsim.values import Ending, TrafficStep

ALONE = ("traffic.ego=none", "estimators=[]", "lighting=low_beam", "traffic.events=[]")
FAST = ("clocks.traffic_step_s=0.5", "clocks.camera_period_s=0.5", "duration_s=4")
EVEN = "fog={visibility_m: 60}"


def alone(*overrides: str) -> Scenario:
    return load_scenario("motorway_fog_bank", [*ALONE, *FAST, *overrides])


@pytest.fixture(scope="module")
def steps() -> list[TrafficStep]:
    scenario = alone(EVEN, "advice=netherlands_a16", "traffic.warm_up_s=15", "drivers.compliance.delay_s=0")
    return list(fogsim.run_traffic(scenario, 3))


def test_a_run_begins_after_its_warm_up_and_lasts_its_duration(steps: list[TrafficStep]) -> None:
    assert [step.time for step in steps] == pytest.approx(np.arange(0.0, 4.5, 0.5))
    assert steps[0].traffic.time == pytest.approx(15.0)
    assert [step.ending for step in steps] == [None] * 8 + [Ending.TIME]


def test_a_run_ends_when_its_condition_holds() -> None:
    run = list(fogsim.run_traffic(alone(EVEN, "end_when=time >= 1 s"), 3))
    assert [step.ending for step in run] == [None, None, Ending.END_CONDITION]


def test_everybody_hears_what_the_meters_let_the_adviser_say(steps: list[TrafficStep]) -> None:
    assert steps[0].truth.visibility == pytest.approx(60.0)
    assert math.isinf(steps[0].command.advice.speed)
    assert steps[1].command.advice.speed == pytest.approx(60 / 3.6)
    assert math.isinf(steps[1].command.advice_reach)
    first, last = steps[0].traffic, steps[-1].traffic
    # They are farther from one another than an ego would have read.
    assert np.ptp(first.position[:, 0]) > 300.0
    assert len(first.ids) > 10
    stayed = {v: s for v, s in zip(first.ids, first.speed, strict=True) if v in last.ids and s > 20.0}
    assert stayed
    assert all(last.speed[last.ids.index(v)] < s - 5.0 for v, s in stayed.items())


def summary_of(steps: Iterable[TrafficStep]) -> RunSummary:
    metrics = TrafficRunMetrics()
    for step in steps:
        metrics.update(step)
    return metrics.summary()


def test_metrics_are_those_of_everybody(steps: list[TrafficStep]) -> None:
    summary = summary_of(steps)
    assert summary.values.keys() == summary.meanings.keys()
    assert (summary.values["duration_s"], summary.values["steps"], summary.values["ending"]) == (4.0, 9, "time")
    count = sum(len(step.traffic.ids) for step in steps[1:])
    assert summary.values["traffic_vehicle_time_s"] == pytest.approx(0.5 * count)
    assert summary.values["traffic_fog_time_share"] == 1.0
    others = [key for key in summary.values if not key.startswith("traffic_")]
    assert others == ["ending", "duration_s", "steps"]


def empty_simulation(folder: Path) -> Path:
    net = load_scenario("motorway_fog_bank").directory / "motorway.net.xml"
    (folder / "none.rou.xml").write_text("<routes/>")
    (folder / "my.sumocfg").write_text(
        f'<configuration><net-file value="{net}"/><route-files value="none.rou.xml"/></configuration>'
    )
    return folder / "my.sumocfg"


def test_a_run_ends_when_nobody_is_left_and_may_be_empty(tmp_path: Path) -> None:
    found = measure_run(scenario_from_config(empty_simulation(tmp_path), "none", [EVEN]), 1)["metrics"]
    assert (found["ending"], found["steps"], found["traffic_vehicle_time_s"]) == ("nobody left", 1, 0.0)


def test_a_study_of_a_sumocfg_has_no_ego_unless_it_names_one(tmp_path: Path) -> None:
    empty_simulation(tmp_path)
    study = "sumocfg: my.sumocfg\nfactors:\n  p: {none: [advice=none], a16: [advice=netherlands_a16]}\n"
    (tmp_path / "mine.yaml").write_text(study + "settings: [fog.visibility_m=60]\n")
    runs = load_study(tmp_path / "mine.yaml").runs
    assert not any(run.scenario.traffic.has_ego or needs_camera(run.scenario) for run in runs)
    assert {run.scenario.advice.informed_by for run in runs} == {"truth"}


def test_banks_lie_along_named_edges_and_the_thickest_meter_counts() -> None:
    bank = "fog={outside_visibility_m: 2000, banks: [{start_m: 300, end_m: 900, edge_m: 100, visibility_m: 50}]}"
    with TrafficRun(alone(bank, 'traffic.along=["approach","bank"]', "traffic.warm_up_s=5")) as traffic:
        step, limit = traffic.start(1)
    assert step.truth.visibility == pytest.approx(50.0, rel=0.01)
    assert step.truth.vehicle_extinctions is not None
    assert 30.0 < limit < 60.0


def test_signs_along_named_edges_go_each_by_its_own_meter() -> None:
    bank = "fog={outside_visibility_m: 2000, banks: [{start_m: 300, end_m: 1600, edge_m: 100, visibility_m: 50}]}"
    signs = ("drivers.advised=signs", "advice=netherlands_a16", 'traffic.along=["approach","bank"]', "duration_s=1")
    last = list(fogsim.run_traffic(alone(bank, *signs, "traffic.warm_up_s=5"), 1))[-1]
    told = {advice.stretch.start: advice for advice in last.command.stretches}
    assert sorted(told) == [500.0, 1000.0, 1500.0]
    assert told[500.0].speed == pytest.approx(60 / 3.6)
    assert told[500.0].stretch.edges == ("approach", "bank")
    assert math.isinf(last.command.advice.speed)


def test_what_needs_an_ego_is_refused_in_one_line() -> None:
    for overrides, said in [
        (("estimators=[negru2013]",), r"estimators: reading frames needs an ego, and traffic.ego is none"),
        (("sensors.faults=[{fault: dropout}]",), r"sensors\.faults: a fault of a sensor needs an ego"),
        (("sensors.reports.roadside={camera: {}}",), r"roadside\.camera: drawing images needs an ego"),
        (("renderer=cpu",), r"renderer: drawing frames needs an ego"),
        (("advice.informed_by=belief",), r"advice.informed_by: belief needs an ego"),
        (("lighting=fog_lamp_rules",), r"lighting: choosing lamps needs an ego"),
        (("drivers.advised=ego",), r"drivers.advised: ego needs an ego"),
        (("drivers.advised=stretch",), r"drivers.advised: stretch counts along the ego's route.*traffic.along"),
        (("drivers.advised=signs",), r"drivers.advised: signs counts along the ego's route.*traffic.along"),
        (("fog={outside_visibility_m: 2000, banks: [{}]}",), r"fog.banks: this counts along.*traffic.along"),
        (("fog.top_m=20",), r"fog.top_m: this counts along"),
        (("fog.scale_height_m=20",), r"fog.scale_height_m: this counts along"),
        (("fog.changes=[{at_s: 0, top_m: 9}]",), r"fog.changes.0.top_m: this counts along"),
        (
            ("traffic.events=[{kind: lamps_fail, vehicle: lead, at_gap_to_ego_m: 5}]",),
            r"traffic.events.0.at_gap_to_ego_m: a gap to the ego needs an ego",
        ),
        (("traffic.along=[bnk]",), r"traffic.along.0: the net has no edge 'bnk'; did you mean 'bank'"),
        (('traffic.along=["bank","approach"]',), r"along.1: the net has no lane that leads from edge 'bank'"),
        (
            ("traffic.ego=ego", "traffic.warm_up_s=5", "estimators=[negru2013]"),
            r"traffic: warm_up_s: goes with ego: none, and the ego is 'ego'",
        ),
    ]:
        with pytest.raises(InputError, match=said) as refused:
            alone(EVEN, *overrides)
        assert "\n" not in str(refused.value)


def test_frames_need_an_ego() -> None:
    with pytest.raises(InputError, match=r"a dataset needs an ego vehicle, and traffic\.ego is none"):
        check_frames(alone(EVEN), "a dataset")


def test_runs_with_and_without_an_ego_name_one_another() -> None:
    with pytest.raises(FogSimError, match=r"the closed loop needs an ego vehicle.*fogsim\.run_traffic"):
        next(fogsim.run(alone(EVEN)))
    with pytest.raises(FogSimError, match=r"traffic\.ego is 'ego'; write none, or call fogsim\.run"):
        next(fogsim.run_traffic(load_scenario("motorway_fog_bank")))


def demand(folder: Path, vehicles: str) -> Path:
    """A SUMO configuration with these vehicles on the motorway."""
    config = empty_simulation(folder)
    route = '<route id="r" edges="approach bank"/>'
    (folder / "none.rou.xml").write_text(f"<routes>{route}{vehicles}</routes>")
    return config


def test_a_cohort_is_due_in_its_time_and_the_run_ends_when_it_has_left(tmp_path: Path) -> None:
    """Three are due at 2 s on one lane, where two wait; the first is there from the beginning, the last comes late."""
    due = (("first", 0.0), ("a", 2.0), ("b", 2.0), ("c", 2.0), ("late", 9.0))
    config = demand(
        tmp_path, "".join(f'<vehicle id="{v}" route="r" depart="{t}" departLane="0" departSpeed="20"/>' for v, t in due)
    )
    keys = ("clocks.traffic_step_s=0.5", "clocks.camera_period_s=0.5", "traffic.warm_up_s=1", "traffic.cohort_s=4")
    steps = list(fogsim.run_traffic(scenario_from_config(config, "none", [EVEN, *keys, "duration_s=400"]), 1))
    cohorts = [step.cohort for step in steps]
    assert cohorts[-1].vehicles == {"a", "b", "c"}
    assert max(cohort.waiting for cohort in cohorts if cohort is not None) == 2
    assert (steps[-1].ending, cohorts[-1].unfinished, "late" in steps[-1].traffic.ids) == (Ending.COHORT_LEFT, 0, True)
    values = summary_of(steps).values
    assert (values["traffic_cohort_vehicles"], values["traffic_cohort_unfinished"]) == (3, 0)
    arrival = {v: max(step.time for step in steps if v in step.traffic.ids) for v in "abc"}
    # They are due 1 s after the warm-up.
    expected = sum(time - 1.0 for time in arrival.values()) / 3
    assert values["traffic_travel_time_s_per_cohort_vehicle"] == pytest.approx(expected)


def test_vehicles_of_a_cohort_that_a_collision_removes_are_unfinished(tmp_path: Path) -> None:
    """The second does not see the first, which stands, and both are removed."""
    config = demand(
        tmp_path,
        '<vehicle id="a" route="r" depart="2"><stop lane="approach_0" endPos="60" duration="200"/></vehicle>'
        '<vehicle id="b" route="r" depart="14" departLane="0" departSpeed="max"/>',
    )
    keys = ("clocks.traffic_step_s=0.5", "clocks.camera_period_s=0.5", "traffic.cohort_s=20", "duration_s=60")
    blind = ("fog.visibility_m=10", "drivers.speed_choice=unaffected", "advice=none", "traffic.keep_lane=[b]")
    removed = "traffic.after_collision=remove"
    found = measure_run(scenario_from_config(config, "none", [*keys, *blind, removed]), 1)["metrics"]
    assert (found["traffic_collisions"], found["traffic_cohort_unfinished"]) == (1, 2)


def test_a_run_is_judged_by_the_same_standard_under_every_advice(tmp_path: Path) -> None:
    config = demand(tmp_path, '<vehicle id="a" route="r" depart="0"/>')
    advice = "advice={method: stopping_sight_distance, parameters: {reaction_time: 1.5, deceleration: 4.5}}"
    scenario = scenario_from_config(config, "none", ["fog.visibility_m=50", "duration_s=3", advice])
    key = "traffic_sight_margin_by_distance_m"
    assert measure_run(scenario, 1)["metrics"][key] == summary_of(fogsim.run_traffic(scenario, 1)).flat()[key]


def test_vehicles_of_a_cohort_that_have_not_left_in_time_are_unfinished(tmp_path: Path) -> None:
    config = demand(tmp_path, '<flow id="f" route="r" begin="0" end="100" period="2" departSpeed="20"/>')
    keys = ("clocks.traffic_step_s=0.5", "clocks.camera_period_s=0.5", "traffic.cohort_s=6", "duration_s=8")
    found = measure_run(scenario_from_config(config, "none", [EVEN, *keys]), 1)["metrics"]
    assert (found["ending"], found["traffic_cohort_vehicles"], found["traffic_cohort_unfinished"]) == ("time", 3, 3)


@pytest.mark.parametrize(("written", "differ"), [("", True), (", seed: 4", False)])
def test_patches_are_drawn_for_each_seed_unless_theirs_is_written(written: str, differ: bool) -> None:
    with TrafficRun(alone(f"fog={{visibility_m: 60, patches: {{correlation_length_m: 50{written}}}}}")) as run:
        fogs = [run.start(seed)[0].truth.fog for seed in (1, 2, 1)]
    assert fogs[0] == fogs[2]
    assert (fogs[0] != fogs[1]) is differ
