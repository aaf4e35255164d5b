"""Which files are tests, and which of their cases and expectations are asked for."""

from collections.abc import Callable
from pathlib import Path

import pytest
from early_motorway import ROUTES

from fogsim.errors import InputError
from fogsim.scenario import catalogue
from fogsim.testing import collect, find_files, parse_keywords

Write = Callable[..., Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    net = ROUTES.parents[2] / "scenarios" / "motorway_fog_bank" / "motorway.net.xml"

    def write_file(name: str, rest: str = "expect: {safe: {never: ego.collision}}\nfog: {visibility: 80 m}\n") -> Path:
        file = tmp_path / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(f"name: made_up\ntraffic: {{net: {net}, routes: [{ROUTES}], ego: ego}}\n{rest}")
        return file

    return write_file


def test_folders_have_files_by_their_names_and_scenarios_that_expect_something(write: Write, tmp_path: Path) -> None:
    for name in ("b.fog.yaml", "deep/er/a.fog.yaml", "c/scenario.yaml", "other.yaml", ".hidden/d.fog.yaml"):
        write(name)
    write("e/scenario.yaml", "fog: {visibility: 80 m}\n")
    found = find_files([tmp_path, tmp_path / "b.fog.yaml", tmp_path / "other.yaml"])
    names = [str(file.relative_to(tmp_path)) for file in found]
    assert names == ["b.fog.yaml", "c/scenario.yaml", "deep/er/a.fog.yaml", "other.yaml"]
    with pytest.raises(InputError, match="there is no such scenario file"):
        find_files([tmp_path / "none.fog.yaml"])


SWEPT = """
fog: {visibility: $visibility}
expect:
  safe: {never: ego.collision}
  slow: {eventually: ego.speed < 60 km/h}
vary: {visibility: [60 m, 200 m], run: 30 seeds}
verdict: {pass_rate: 95 %, confidence: 90 %}
"""


def test_both_endings_of_yaml_are_found(tmp_path: Path) -> None:
    files = [tmp_path / "a.fog.yaml", tmp_path / "b.fog.yml"]
    for file in files:
        file.touch()
    assert find_files([tmp_path]) == files


def test_tests_in_linked_folders_are_found_once(tmp_path: Path) -> None:
    for folder in ("suite", "elsewhere/deep"):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "a.fog.yaml").touch()
    (tmp_path / "suite" / "linked").symlink_to(tmp_path / "elsewhere")
    (tmp_path / "suite" / "again").symlink_to(tmp_path / "elsewhere" / "deep")
    (tmp_path / "elsewhere" / "deep" / "back").symlink_to(tmp_path)
    suite = tmp_path / "suite"
    assert find_files([suite]) == [suite / "a.fog.yaml", suite / "again" / "a.fog.yaml"]
    (suite / "gone.fog.yaml").symlink_to("nowhere.fog.yaml")
    assert suite / "gone.fog.yaml" in find_files([suite])


def test_cases_and_expectations_are_those_that_are_asked_for(write: Write) -> None:
    file = write("a.fog.yaml", SWEPT)
    (whole,) = collect([file])
    assert (len(whole.runs), whole.verdict.pass_rate) == (60, 0.95)
    assert whole.lines == {"safe": f"{file}:6", "slow": f"{file}:7"}
    assert len({run.key for run in whole.runs}) == 60
    assert len({id(run.scenario) for run in whole.runs}) == 2
    (part,) = collect([file], case="visibility=200 m", keywords=parse_keywords("made_up and not safe"))
    assert [run.seed for run in part.runs] == list(range(30))
    assert list(part.lines) == ["slow"]
    # A rate that was wanted of all cases says nothing of some.
    assert part.verdict.pass_rate == 1.0
    assert collect([file], keywords=parse_keywords("night")) == []


def test_files_without_the_case_are_left_out_unless_none_has_it(write: Write) -> None:
    files = [write("a.fog.yaml", SWEPT), write("b.fog.yaml")]
    assert [test.path for test in collect(files, case="visibility=60 m")] == files[:1]
    with pytest.raises(InputError, match=r"varies no visibilty.*\n.*varies no visibilty"):
        collect(files, case="visibilty=60 m")


def test_a_run_has_another_key_when_anything_changes(write: Write) -> None:
    def keys(text: str) -> set[str]:
        return {run.key for test in collect([write("a.fog.yaml", text)]) for run in test.runs}

    before = keys(SWEPT)
    assert keys(SWEPT) == before
    assert not keys(SWEPT.replace("60 km/h", "61 km/h")) & before
    assert len(keys(SWEPT.replace("200 m", "201 m")) & before) == 30


def test_mistakes_of_all_files_are_told_together(write: Write) -> None:
    files = [
        write("a.fog.yaml", SWEPT.replace("200 m]", "200 km/h]")),
        write("b.fog.yaml", SWEPT.replace("never", "nevr")),
        write("c.fog.yaml", SWEPT),
    ]
    with pytest.raises(InputError) as error:
        collect(files)
    told = str(error.value)
    assert f"{files[0]}:4: fog.visibility: the unit 'km/h' does not fit" in told
    assert "in the case visibility=200 km/h,run=0" in told
    assert f"{files[1]}:6: expect.safe.nevr: unknown key; did you mean 'never'?" in told
    assert "c.fog.yaml" not in told


def test_of_the_shipped_scenarios_those_that_expect_something_are_tests() -> None:
    folder = Path(__file__).parents[2] / "scenarios"
    expecting = {name for name, file in catalogue().items() if "\nexpect:" in file.read_text(encoding="utf-8")}
    assert {file.parent.name for file in find_files([folder])} == expecting
    assert "rising_sun" in expecting
    assert "graded_motorway" not in expecting


def test_words_with_and_or_not() -> None:
    for written, fits in [
        ("fog", True),
        ("night", False),
        ("FOG and not night", True),
        ("night or (fog and safe)", True),
        ("not (night or safe)", False),
        ("not night and not truck", True),
        ("a.fog.yaml", True),
    ]:
        assert parse_keywords(written).match("tests/a.fog.yaml motorway safe") is fits


def test_what_is_no_condition_is_refused() -> None:
    for written in ["", "and", "fog or", "(fog", "fog)", "fog night", "not"]:
        with pytest.raises(InputError, match="expected"):
            parse_keywords(written)
