"""Names that a file gives are visible, in one line and no markup, or refused with the name escaped."""

from pathlib import Path

import pytest

from fogsim.errors import InputError, is_name
from fogsim.scenario.loading import load_cases
from fogsim.study import load_study

SCENARIO = """\
name: {scenario}
duration: 2 s
clocks: {{camera_period: 0.5 s, decision_period: 1 s}}
road: {{template: rural, length: 1 km}}
actors:
  ego: {{position: 100 m, speed: 80 km/h}}
  {actor}: {{type: car, ahead_of: ego, gap: 300 m, stands: true}}
traffic: {{keep_lane: [{reference}]}}
fog: {{visibility: $fog}}
timeline:
  - {{name: {event}, when: time > 1 s, do: {{{subject}: {{hazard_lights: true}}}}}}
expect:
  {expectation}: {{never: ego.collision}}
vary:
  fog: [60 m, {value}]
"""

NAMES = {
    "scenario": "named",
    "actor": "parked",
    "reference": "parked",
    "event": "lit",
    "subject": "parked",
    "expectation": "safe",
    "value": "80 m",
}

STUDY = """\
scenario: motorway_fog_bank
factors:
  {factor}:
    {level}: [fog.outside_visibility_m=1000]
seeds: 1
"""

UNFIT = ['"a\\0b"', '"a\\nb"', '"a\\eb"', '"a\\u202eb"', "'  '", "' a'", "'a '", "a<b"]
"""Names as YAML: control characters, blanks alone and at the ends, and what begins a tag."""

VALUES = UNFIT[:4]
"""Values of ``vary`` may have blanks and ``<``: they are put in quotes or escaped where they are shown."""


def test_a_scenario_with_an_unfit_name_is_refused(tmp_path: Path) -> None:
    for place, name in [(at, name) for at in NAMES for name in (VALUES if at == "value" else UNFIT)]:
        file = tmp_path / "named.fog.yaml"
        file.write_text(SCENARIO.format(**{**NAMES, place: name}), encoding="utf-8")
        with pytest.raises(InputError) as error:
            load_cases(file)
        assert all(line.isprintable() for line in str(error.value).splitlines())
        assert str(error.value).startswith(f"{file}:")


def test_an_actor_has_a_name_that_sumo_takes(tmp_path: Path) -> None:
    for name in [" ", ";", "|", "&", ",", ">", "\\\\", '\\"', "'"]:
        file = tmp_path / "named.fog.yaml"
        named = {**NAMES, "actor": f'"a{name}b"', "reference": "ego", "subject": "ego"}
        file.write_text(SCENARIO.format(**named), "utf-8")
        with pytest.raises(InputError, match="a name in SUMO has no blank and none of") as error:
            load_cases(file)
        assert len(str(error.value).splitlines()) == 2  # the mistake, and its case


def test_a_study_with_an_unfit_name_is_refused(tmp_path: Path) -> None:
    for name in UNFIT:
        for place in ["factor", "level"]:
            file = tmp_path / "named.yaml"
            file.write_text(STUDY.format(**{"factor": "fog", "level": "far", place: name}), encoding="utf-8")
            with pytest.raises(InputError) as error:
                load_study(file)
            (line,) = str(error.value).splitlines()
            assert line.isprintable()
            assert line.startswith(f"{file}:")


def test_letters_of_all_languages_and_blanks_inside_are_names(tmp_path: Path) -> None:
    file = tmp_path / "named.fog.yaml"
    for name in ["Müller", "車両", "a_1.b#2:c", "é"]:
        named = {**NAMES, "actor": name, "reference": name, "subject": name}
        file.write_text(SCENARIO.format(**named), encoding="utf-8")
        load_cases(file)
    assert is_name("the parked car")
