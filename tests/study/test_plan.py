from pathlib import Path

import pytest

from fogsim.errors import InputError, UnknownNameError
from fogsim.scenario.loading import catalogue
from fogsim.study import load_study
from fogsim.study.shipped import shipped_studies, study_file

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


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("factors:", "factor:"), r"mine\.yaml:4: factor: .*did you mean 'factors'"),
        (("advice=none", "advice=non"), r"policy=none, visibility=v60: .*unknown adviser 'non'; did you mean 'none'"),
        (("seeds: 3", "seeds: 0"), r"seeds"),
        (("seeds: 3", "seeds: [1, 1]"), r"a seed stands twice"),
        (("seeds: 3", "seeds: []"), r"seeds"),
        (("seeds: 3", "baseline: {police: none}"), r"baseline\.police: unknown factor; did you mean 'policy'"),
        (("seeds: 3", "baseline: {policy: non}"), r"baseline\.policy: unknown level 'non'; did you mean 'none'"),
        (("seeds: 3", "metrics: [colisions]"), r"metrics: unknown metric 'colisions'; did you mean 'collisions'"),
        (("seeds: 3", "metrics: [collisions, collisions]"), r"metrics: a metric stands twice"),
        (("seeds: 3", "wanted_interval: 0"), r"wanted_interval"),
        (("  visibility:", "  seed:"), r"factors\.seed: the table has a column of that name"),
        (("scenario: motorway_fog_bank", "scenario: motorway"), r"unknown scenario 'motorway'"),
        (("scenario: motorway_fog_bank", "ego: x"), r"give either scenario, or sumocfg"),
        (("scenario: motorway_fog_bank", "sumocfg: a.sumocfg"), r"there is no file .a.sumocfg"),
        (("scenario: motorway_fog_bank", "scenario: motorway_fog_bank\nego: x"), r"ego: goes with sumocfg"),
        (("fog.visibility_m=60", "fog.visibility_m=sixty"), r"visibility=v60: .*fog\.visibility_m"),
    ],
)
def test_mistakes_are_named_with_their_place(tmp_path: Path, change: tuple[str, str], said: str) -> None:
    with pytest.raises(InputError, match=said):
        load_study(written(tmp_path, STUDY.replace(*change, 1)))


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


def test_runs_that_nothing_sees_draw_no_frames(tmp_path: Path) -> None:
    text = STUDY.replace("duration_s=2]", "lighting=low_beam]").replace(
        "  visibility:", "    meter: ['advice={method: netherlands_a16, informed_by: truth}']\n  visibility:"
    )
    drawn = {run.levels["policy"]: run.scenario.renderer for run in load_study(written(tmp_path, text)).runs}
    assert drawn == {"none": "none", "ssd": "auto", "meter": "none"}
    always = load_study(written(tmp_path, text + "frames: always\n"))
    assert {run.scenario.renderer for run in always.runs} == {"auto"}
    # Lamps that go by the camera's fog need it, too.
    lamps = load_study(written(tmp_path, text.replace("low_beam", "fog_lamp_rules")))
    assert {run.scenario.renderer for run in lamps.runs} == {"auto"}


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
