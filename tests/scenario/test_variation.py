"""What a file varies, and what its cases are."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.scenario.document import Document, read_document
from fogsim.scenario.loading import load_cases
from fogsim.scenario.variation import Variation, chosen_cases, read_variation, with_case


def document(data: dict[str, Any]) -> Document:
    return Document(Path("file"), data, {})


def varied(vary: dict[str, Any], **rest: Any) -> Variation:
    return read_variation(document({"uses": [f"${name}" for name in vary], "vary": vary, **rest}))


def labels(vary: dict[str, Any], **rest: Any) -> list[str]:
    return [case.label for case in varied(vary, **rest).cases]


def test_cases_are_the_grid_the_last_name_fastest() -> None:
    assert labels({"strength": [0.4, 1.0], "run": "2 seeds"}) == [
        "strength=0.4,run=0",
        "strength=0.4,run=1",
        "strength=1,run=0",
        "strength=1,run=1",
    ]
    assert [case.seed for case in varied({"run": {"seeds": [3, 5]}}).cases] == [3, 5]


def test_a_file_that_varies_nothing_has_one_case() -> None:
    (case,) = read_variation(document({"a": "$5"})).cases
    assert (case.label, case.seed) == ("", 0)
    assert with_case(document({"a": "$5"}), case).data == {"a": "$5"}


def test_ranges_and_lists() -> None:
    for written, values in [
        ({"from": "10 m", "to": "30 m", "step": "10 m"}, ["10 m", "20 m", "30 m"]),
        ({"from": 0.1, "to": 0.5, "step": 0.1}, [0.1, 0.2, 0.3, 0.4, 0.5]),
        ({"from": 3, "to": 0, "step": -2}, [3, 1]),
        ([True, "no fog"], [True, "no fog"]),
    ]:
        assert [case.values["x"] for case in varied({"x": written}).cases] == values


def test_draws_are_of_their_distribution_and_the_same_across_the_grid() -> None:
    cases = varied(
        {"gap": {"normal": ["20 m", "5 m"], "at_least": "0 m"}, "kind": ["a", "b"], "run": "300 seeds"}
    ).cases
    drawn = np.array([float(str(case.values["gap"]).removesuffix(" m")) for case in cases])
    assert np.array_equal(drawn[:300], drawn[300:])
    assert np.mean(drawn[:300]) == pytest.approx(20.0, abs=4 * 5 / 300**0.5)
    assert np.std(drawn[:300]) == pytest.approx(5.0, rel=4 / 600**0.5)
    flat = varied({"x": {"uniform": [2, 3]}, "run": "300 seeds"}).cases
    numbers = [float(case.values["x"]) for case in flat]
    assert 2.0 <= min(numbers) < 2.05
    assert 2.95 < max(numbers) <= 3.0
    skewed = varied({"x": {"lognormal": [100, 0.5], "at_most": 200}, "run": "300 seeds"}).cases
    assert np.median([float(case.values["x"]) for case in skewed]) == pytest.approx(92.0, rel=0.12)
    assert max(float(case.values["x"]) for case in skewed) <= 200
    # What no number holds is drawn again.
    for case in varied({"x": {"lognormal": ["300 m", 1000]}, "run": "50 seeds"}).cases:
        assert "inf" not in str(case)


def test_names_give_way_to_values() -> None:
    data = {
        "a": "$x",
        "b": ["${x} m of $y", {"c": "$$x"}],
        "vary": {"x": [0.5], "y": ["fog"]},
        "verdict": {"conclusive": 1.0},
    }
    (case,) = read_variation(document(data)).cases
    assert with_case(document(data), case).data == {"a": 0.5, "b": ["0.5 m of fog", {"c": "$x"}]}


def test_cases_are_chosen_by_their_values() -> None:
    variation = varied({"strength": [0.4, 1.0], "kind": ["a", "b"], "run": "2 seeds"})

    def chosen(wanted: str) -> list[str]:
        return [case.label for case in chosen_cases(variation, wanted, "FILE")]

    assert len(chosen("")) == 8
    assert chosen("strength=1,kind=b") == ["strength=1,kind=b,run=0", "strength=1,kind=b,run=1"]
    assert chosen("run=7, strength=0.7,kind=a") == ["strength=0.7,kind=a,run=7"]
    assert chosen_cases(variation, "run=7", "FILE")[0].seed == 7
    for wanted, told in {
        "strenth=1": "FILE varies no strenth; did you mean 'strength'",
        "kind=c": "FILE has no kind=c; known: a, b",
        "run=x": "FILE has no run=x; known: 0, 1",
        "strength=much": "no strength=much",
        "strength=1e999": "no strength=1e999",
        "strength": "expected name=value",
    }.items():
        with pytest.raises(InputError, match=told):
            chosen(wanted)
    # A seed that is not in the file has draws of its own.
    drawing = {"gap": {"uniform": [0, 1]}}
    few, many = varied({**drawing, "run": "2 seeds"}), varied({**drawing, "run": "9 seeds"})
    (case,) = chosen_cases(few, "run=7", "FILE")
    assert case == many.cases[7]


def test_numbers_that_differ_have_cases_of_their_own() -> None:
    cases = varied({"x": [0.1234567, 0.1234568]}).cases
    assert [case.label for case in cases] == ["x=0.1234567", "x=0.1234568"]


def test_mistakes_are_told() -> None:
    for vary, told in [
        ({"x": []}, "vary.x: needs at least one value"),
        ({"x": [1, 1]}, r"vary.x.1: 1 stands twice"),
        ({"x": [1, 1.0]}, r"vary.x.1: 1.0 stands twice"),
        ({"x": [None]}, "vary.x.0: a value is a number, text, true or false; got None"),
        ({"x": 3}, "vary.x: expected a list"),
        ({"x": {"form": 1}}, "vary.x.form: unknown key; did you mean 'from'"),
        ({"x": {"from": 1, "to": 2}}, "vary.x: step is missing"),
        ({"x": {"from": 1, "to": 2, "step": 0}}, "vary.x.step: a step of 0 does not lead there"),
        ({"x": {"from": "1 m", "to": "2 s", "step": "1 m"}}, "same unit, got m and s"),
        ({"x": {"from": "near", "to": 2, "step": 1}}, "vary.x.from: expected a number"),
        ({"x": {"from": 0, "to": 1, "step": 1e-9}}, "vary.x.step: 1000000000 values are more than 100000"),
        ({"x": {"from": 1e5, "to": 100_001, "step": 0.1}}, "vary.x.step: its values are the same to six digits"),
        ({"x": {"from": -1e308, "to": 1e308, "step": 1}}, "vary.x.step: more than 100000 values"),
        ({"x": {"uniform": [2, 1]}, "run": "2 seeds"}, "vary.x.uniform: expected its lower and upper end"),
        ({"x": {"uniform": [1]}, "run": "2 seeds"}, "vary.x.uniform: expected two values"),
        ({"x": {"normal": [0, 1], "at_least": 50}, "run": "2 seeds"}, "none of 10000 draws of x lies between its lim"),
        ({"x": {"uniform": [1, 2]}}, "vary.x: a value is drawn for each seed, and there are none"),
        ({"x": {"uniform": [1, 2], "step": 1}}, "vary.x.step: does not go with uniform"),
        ({"x": "0 seeds"}, "expected 1 … 100000 seeds, got 0"),
        ({"x": {"seeds": [1.5]}}, "vary.x.seeds: expected how many"),
        ({"x": "2 seeds", "y": "3 seeds"}, "vary.y: x has the seeds already"),
        ({"x y": [1]}, "letters, digits"),
        ({"x": "400 seeds", "y": {"from": 1, "to": 400, "step": 1}}, "160,000 runs; at most 100,000"),
    ]:
        with pytest.raises(InputError, match=told):
            varied(vary)


def test_mistakes_have_file_and_line(tmp_path: Path) -> None:
    file = tmp_path / "a.yaml"
    file.write_text("fog: {visibility: $strenght}\nvary:\n  strength: [1, 2]\n")
    with pytest.raises(InputError) as error:
        read_variation(read_document(file))
    assert str(error.value).splitlines() == [
        f"{file}:1: fog.visibility: unknown name $strenght; did you mean 'strength'? Known: strength",
        f"{file}:3: vary.strength: $strength stands nowhere in the file, so that its cases would not differ",
    ]


def test_a_verdict_must_be_within_reach() -> None:
    wanted = {"pass_rate": "95 %", "confidence": 0.9}
    with pytest.raises(InputError, match=r"20 cases that all pass do not show .* 0.95 .* 0.9; at least 45 would"):
        varied({"run": "20 seeds"}, verdict=wanted)
    assert varied({"run": "45 seeds"}, verdict=wanted).verdict.pass_rate == 0.95
    with pytest.raises(InputError, match="verdict: goes with vary"):
        read_variation(document({"verdict": wanted}))
    with pytest.raises(InputError, match=r"verdict.pass_rte: unknown key; did you mean 'pass_rate'"):
        varied({"run": "45 seeds"}, verdict={"pass_rte": 1})


def test_a_misspelt_block_is_told_with_the_nearest(tmp_path: Path) -> None:
    file = tmp_path / "a.yaml"
    file.write_text("name: a\ntraffic: {net: a, routes: [b]}\nfog: {visibility: 80 m}\nvari: {run: 2 seeds}\n")
    with pytest.raises(InputError, match=r"a.yaml:4: vari: unknown key; did you mean 'vary'\?"):
        load_cases(file)
