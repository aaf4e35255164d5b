"""Study files: their grid, and what is refused with file, line and key."""

import shutil
from pathlib import Path
from unittest.mock import MagicMock

import pytest

from fogsim.dataset.write import input_digests
from fogsim.errors import InputError, UnknownNameError
from fogsim.metrics import RunMetrics, TrafficRunMetrics
from fogsim.scenario import loading, scenario_from_config
from fogsim.scenario.document import read_scenario_document
from fogsim.scenario.loading import catalogue
from fogsim.scenario.variation import grid_mistake
from fogsim.study import load_study
from fogsim.study.plan import equal_cells, file_digests, shipped_studies, study_file
from fogsim.study.table import FIXED_COLUMNS, check_factors, column_mistake

STUDY = """
scenario: motorway_fog_bank
settings: [duration_s=2]
factors:
  policy:
    none: [advice=none]
    ssd: [advice=stopping_sight_distance]
  visibility:
    v60: [fog.visibility_m=60]
    v100: [fog.visibility_m=100]
seeds: 3
"""


def written(folder: Path, text: str = STUDY) -> Path:
    path = folder / "mine.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_the_grid_has_every_cell_with_the_same_seeds(tmp_path: Path) -> None:
    study = load_study(written(tmp_path))
    assert study.factors == {"policy": ("none", "ssd"), "visibility": ("v60", "v100")}
    assert study.baseline == {"policy": "none"}
    assert [run.number for run in study.runs] == list(range(12))
    cells = [tuple(run.levels.values()) for run in study.runs]
    assert cells == [(p, v) for p in ("none", "ssd") for v in ("v60", "v100") for _ in range(3)]
    assert [run.seed for run in study.runs] == [0, 1, 2] * 4
    assert len({run.key for run in study.runs}) == 12
    assert study.runs[3].scenario.fog.visibility_m == 100.0
    assert study.runs[0].scenario.duration_s == 2.0


def test_keys_follow_what_is_run_and_nothing_else(tmp_path: Path) -> None:
    study = load_study(written(tmp_path))
    other = load_study(written(tmp_path, STUDY.replace("ssd:", "sight:").replace("seeds: 3", "seeds: [2, 1, 0]")))
    assert {run.key for run in study.runs} == {run.key for run in other.runs}
    longer = load_study(written(tmp_path, STUDY.replace("duration_s=2", "duration_s=3")))
    assert not {run.key for run in study.runs} & {run.key for run in longer.runs}


def test_a_scenario_beside_the_study_is_found(tmp_path: Path) -> None:
    config = tmp_path / "no.sumocfg"
    with pytest.raises(InputError, match=r"mine\.yaml: policy=none: .*no\.sumocfg"):
        load_study(written(tmp_path, f"sumocfg: {config.name}\nego: e\nfactors: {{policy: {{none: [advice=none]}}}}"))


def test_mistakes_are_named_with_their_place(tmp_path: Path) -> None:
    for change, said in [
        (("factors:", "factor:"), r"mine\.yaml:4: factor: .*did you mean 'factors'"),
        (("advice=none", "advice=non"), r"policy=none, visibility=v60: .*unknown adviser 'non'; did you mean 'none'"),
        (("seeds: 3", "seeds: 0"), r"seeds"),
        (("seeds: 3", "seeds: [1, 1]"), r"seeds: a seed is given twice"),
        (("seeds: 3", "seeds: []"), r"seeds"),
        (("seeds: 3", "seeds: 1000000000"), r"seeds: input should be less than or equal to 100000.*; got 1000000000"),
        (("seeds: 3", "baseline: {police: none}"), r"baseline\.police: unknown factor; did you mean 'policy'"),
        (("seeds: 3", "baseline: {policy: non}"), r"baseline\.policy: unknown level 'non'; did you mean 'none'"),
        (("seeds: 3", "metrics: [colisions]"), r"metrics: unknown metric 'colisions'; did you mean 'collisions'"),
        (("seeds: 3", "metrics: [collisions, collisions]"), r"metrics: a metric is named twice"),
        (("seeds: 3", "wanted_interval: 0"), r"wanted_interval"),
        (("  visibility:", "  seed:"), r"factors\.seed: the table has a column of that name"),
        (("scenario: motorway_fog_bank", "scenario: motorway"), r"unknown scenario 'motorway'"),
        (("scenario: motorway_fog_bank", "ego: x"), r"give either scenario, or sumocfg"),
        (("scenario: motorway_fog_bank", "sumocfg: a.sumocfg"), r"there is no file .a.sumocfg"),
        (("scenario: motorway_fog_bank", "scenario: motorway_fog_bank\nego: x"), r"ego: goes with sumocfg"),
        (("fog.visibility_m=60", "fog.visibility_m=sixty"), r"visibility=v60: .*fog\.visibility_m"),
    ]:
        with pytest.raises(InputError, match=said):
            load_study(written(tmp_path, STUDY.replace(*change, 1)))


def test_a_level_that_is_a_number_can_be_the_baseline(tmp_path: Path) -> None:
    for level in ("off", "1e3", "060", "60"):  # what YAML reads as a number or a boolean where it is no key
        text = STUDY.replace("v60:", f"{level}:", 1).replace("seeds: 3", f"baseline: {{visibility: {level}}}")
        assert load_study(written(tmp_path, text)).baseline == {"visibility": level}
    with pytest.raises(InputError, match=r"baseline\.visibility: unknown level '60\.0'; did you mean '60'"):
        load_study(written(tmp_path, text.replace("visibility: 60}", "visibility: 60.0}")))


def test_a_factor_is_not_named_like_a_column_of_the_table(tmp_path: Path) -> None:
    for name in [
        *sorted(FIXED_COLUMNS),
        "ending",
        "duration_s",
        "mean_speed_mps",
        "traffic_delay_share",
        "belief_median_error_percent",
        "estimators.joint_road.valid_share",
        "estimators.mine.anything",
    ]:
        with pytest.raises(InputError, match=rf"mine\.yaml:8: factors\.{name}: .*; choose another$"):
            load_study(written(tmp_path, STUDY.replace("visibility:\n", f"{name}:\n", 1)))


def test_every_metric_of_a_run_is_a_name_that_no_factor_has() -> None:
    for summary in (RunMetrics().summary(), TrafficRunMetrics().summary()):
        assert all(column_mistake(name) for name in summary.flat())


def test_a_metric_of_a_users_own_does_not_take_the_column_of_a_factor() -> None:
    levels = {"policy": "none"}
    check_factors([{"run": 0, "policy": "none", "mine": 3.0}], [levels])
    with pytest.raises(InputError, match=r"factors\.policy: run 0 has a metric of that name"):
        check_factors([{"run": 0, "policy": 3.0}], [levels])


def test_a_grid_is_counted_before_it_is_built(tmp_path: Path) -> None:
    levels = ", ".join(f"l{n}: []" for n in range(10))
    factors = "\n".join(f"  f{n}: {{{levels}}}" for n in range(9))
    told = "10 f0 × 10 f1 × 10 f2 × 10 f3 × 10 f4 × … are 10,000,000,000 runs; at most 100,000 are allowed"
    with pytest.raises(InputError, match=told):
        load_study(written(tmp_path, f"scenario: motorway_fog_bank\nfactors:\n{factors}\nseeds: 10\n"))


def test_a_grid_has_a_limit() -> None:
    for number in [10**5, 10**5 + 1, 10**40]:
        mistake = grid_mistake({"fog": number, "policy": 1})
        assert (mistake is None) == (number == 10**5)
        assert mistake is None or "100,000 are allowed" in mistake


def test_cells_are_counted_while_they_are_checked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    reading = MagicMock(wraps=read_scenario_document)
    monkeypatch.setattr(loading, "read_scenario_document", reading)
    seen: list[tuple[int, int]] = []
    load_study(written(tmp_path), watch=lambda done, total: seen.append((done, total)))
    assert seen == [(1, 4), (2, 4), (3, 4), (4, 4)]
    reading.assert_called_once()


def test_an_empty_study_says_what_is_missing(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"mine\.yaml: .*mapping"):
        load_study(written(tmp_path, ""))
    with pytest.raises(InputError, match="factors"):
        load_study(written(tmp_path, "scenario: motorway_fog_bank"))
    with pytest.raises(InputError, match="factors"):
        load_study(written(tmp_path, "scenario: motorway_fog_bank\nfactors: {}"))


def test_a_file_that_the_configuration_names_is_missed_before_anything_is_run(tmp_path: Path) -> None:
    net = catalogue()["motorway_fog_bank"].parent / "motorway.net.xml"
    (tmp_path / "a.sumocfg").write_text(
        f'<configuration><net-file value="{net}"/><additional-files value="loops.add.xml"/></configuration>',
        encoding="utf-8",
    )
    text = STUDY.replace("scenario: motorway_fog_bank", "sumocfg: a.sumocfg").replace(
        "[advice=stopping_sight_distance]", "[]"
    )
    with pytest.raises(
        InputError, match=r"a\.sumocfg: traffic\.config: .*loops\.add\.xml: cannot be read: No such file"
    ):
        load_study(written(tmp_path, text))


def test_every_file_that_a_run_depends_on_is_part_of_its_identity(tmp_path: Path) -> None:
    grid = Path(__file__).resolve().parents[1] / "data" / "grid"
    for file in grid.glob("grid.*"):
        shutil.copy(file, tmp_path)
    config = tmp_path / "grid.sumocfg"
    more = '<additional-files value="a.add.xml"/></input>'
    config.write_text(config.read_text(encoding="utf-8").replace("</input>", more), encoding="utf-8")
    vss = '<variableSpeedSign id="v" lanes="A0B0_0" file="v.xml"/>'
    for name, content in (
        ("a.add.xml", '<additional><include href="b.add.xml"/></additional>'),
        ("b.add.xml", f"<additional>{vss}</additional>"),
        ("v.xml", '<vss><step time="0" speed="9"/></vss>'),
        ("lamps.yaml", "{low_beam: beam.csv}"),
        ("beam.csv", "0,0,1"),
    ):
        (tmp_path / name).write_text(content, encoding="utf-8")
    method = "estimators=[{method: night_road, parameters: {head_lamps: lamps.yaml}}]"
    scenario = scenario_from_config(config, "veh18", ["fog.visibility_m=120", method])
    for digests in (file_digests, input_digests):
        before = digests(scenario)
        for name in before:
            content = (tmp_path / name).read_text(encoding="utf-8")
            (tmp_path / name).write_text(content + "\n", encoding="utf-8")
            assert {key for key, value in digests(scenario).items() if value != before[key]} == {name}
            (tmp_path / name).write_text(content, encoding="utf-8")
        wanted = {"grid.sumocfg", "grid.net.xml", "grid.trips.xml", "a.add.xml", "b.add.xml", "v.xml"}
        assert before.keys() == {*wanted, "lamps.yaml", "beam.csv"}


def test_runs_that_nothing_sees_draw_no_frames(tmp_path: Path) -> None:
    text = STUDY.replace("duration_s=2]", "lighting=low_beam]").replace(
        "  visibility:", "    meter: ['advice={method: netherlands_a16, informed_by: truth}']\n  visibility:"
    )
    drawn = {run.levels["policy"]: run.scenario.renderer for run in load_study(written(tmp_path, text)).runs}
    assert drawn == {"none": "none", "ssd": "auto", "meter": "none"}
    always = load_study(written(tmp_path, text + "frames: always\n"))
    assert {run.scenario.renderer for run in always.runs} == {"auto"}
    # Lamps that go by the camera's fog need it, too; those that are always the same do not.
    for same in ("always_low", "always_high"):
        runs = load_study(written(tmp_path, text.replace("low_beam", same))).runs
        assert {run.levels["policy"]: run.scenario.renderer for run in runs} == drawn
    lamps = load_study(written(tmp_path, text.replace("low_beam", "fog_lamp_rules")))
    assert {run.scenario.renderer for run in lamps.runs} == {"auto"}


@pytest.mark.parametrize(
    ("place", "needs_frames"),
    [
        ("[advice=none]", "[advice=none, controller=sight_limiter]"),
        ("[advice=none]", "[advice=none, 'sensors.faults=[{sensor: camera, fault: dirty_lens}]']"),
        ("[advice=none]", "[advice=none, 'timeline=[{when: belief.visibility < 9 m, do: {fog: {visibility_m: 50}}}]']"),
        ("seeds: 3", "metrics: [belief_coverage_share]"),
        ("seeds: 3", "metrics: [estimators.joint_road.coverage_share]"),
        ("seeds: 3", "metrics: [equipped_belief_coverage_share]"),
    ],
)
def test_what_goes_by_the_camera_has_its_frames(tmp_path: Path, place: str, needs_frames: str) -> None:
    text = STUDY.replace("duration_s=2]", "lighting=low_beam]").replace(place, needs_frames)
    assert {run.scenario.renderer for run in load_study(written(tmp_path, text)).runs} == {"auto"}


def test_a_scenario_of_several_cases_is_refused_unless_one_is_chosen(tmp_path: Path) -> None:
    varied = STUDY.replace("motorway_fog_bank", "patchy_fog").replace(
        "fog.visibility_m", "fog.patches.correlation_length_m"
    )
    with pytest.raises(InputError, match=r"mine\.yaml:2: scenario: .*a single case, and strength, run make 4; write"):
        load_study(written(tmp_path, varied))
    assert load_study(written(tmp_path, STUDY.replace("motorway_fog_bank", "clear_day"))).runs  # where seeds alone vary
    chosen = varied.replace("duration_s=2]", "duration_s=2, 'vary={strength: [0.4], run: 1 seed}']")
    assert {run.scenario.fog.patches.strength for run in load_study(written(tmp_path, chosen)).runs} == {0.4}


def test_cells_that_nothing_distinguishes_are_named(tmp_path: Path) -> None:
    assert not equal_cells(load_study(written(tmp_path)))
    text = STUDY.replace("  visibility:", "  unused: {low: [], high: []}\n  visibility:")
    (said,) = equal_cells(load_study(written(tmp_path, text)))
    assert said.startswith("The same scenario, so that no run can differ: none · low · ")


def test_a_study_that_comes_with_fogsim_is_known_by_its_name(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    known = shipped_studies()
    assert {"motorway_policies", "which_sensor"} <= set(known)
    assert study_file("which_sensor") == known["which_sensor"]
    # A file of one's own comes first, as with scenarios.
    Path("which_sensor").write_text(STUDY, encoding="utf-8")
    assert study_file("which_sensor") == Path("which_sensor")
    with pytest.raises(UnknownNameError, match="did you mean 'which_sensor'"):
        study_file("which_sensors")
    with pytest.raises(InputError, match=r"nothing\.yaml: cannot be read"):
        load_study("nothing.yaml")
