"""Running tests: what counts of earlier calls, and when one ends."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from made_up_cases import BROKEN, MadeUpEngine, complete, made_up_test

from fogsim.errors import InputError
from fogsim.testing import last_failed, only_cases, run_tests


def test_all_cases_are_run_and_judged(tmp_path: Path) -> None:
    told = {"a0": complete("passed"), "a1": complete("failed"), "b0": complete("passed"), "c0": BROKEN}
    tests = [made_up_test(keys, tmp_path / f"{keys[0]}.fog.yaml") for keys in (["a0", "a1"], ["b0"], ["c0"])]
    seen: list[tuple[int, int]] = []
    outcomes = run_tests(tests, tmp_path / "out", MadeUpEngine(told), watch=lambda *both: seen.append(both))
    assert [one.is_passed for one in outcomes] == [False, True, False]
    assert outcomes[2].broken[0].message == BROKEN["message"]
    assert seen == [(0, 0), (1, 0), (2, 1), (3, 1), (4, 2)]
    assert last_failed(tmp_path / "out") == {tmp_path / "a0.fog.yaml": ["run=1"], tmp_path / "c0.fog.yaml": [""]}
    again = only_cases(tests, last_failed(tmp_path / "out"))
    assert [run.key for test in again for run in test.runs] == ["a1", "c0"]


def test_what_was_not_run_again_stays_noted(tmp_path: Path) -> None:
    tests = [made_up_test(keys, tmp_path / f"{keys[0]}.fog.yaml") for keys in (["a0", "a1", "a2"], ["b0"])]
    for test in tests:
        test.path.touch()
    run_tests(tests, tmp_path / "out", MadeUpEngine(dict.fromkeys(("a0", "a1", "a2", "b0"), complete("failed"))))
    mended = {"a1": complete("passed"), "a2": complete("failed")}
    only = replace(tests[0], runs=tests[0].runs[1:])
    run_tests([only], tmp_path / "out", MadeUpEngine(mended))
    assert last_failed(tmp_path / "out") == {tests[0].path: ["run=0", "run=2"], tests[1].path: [""]}


def test_expectations_that_are_not_asked_for_do_not_count(tmp_path: Path) -> None:
    test = made_up_test(["a"])
    (outcome,) = run_tests([test], tmp_path, MadeUpEngine({"a": complete("passed", "passed", "failed")}))
    assert [one.name for one in outcome.judgements] == ["e0", "e1"]
    assert outcome.is_passed


def test_what_was_done_counts_when_resumed_and_only_then(tmp_path: Path) -> None:
    test = made_up_test(["a", "b", "c"])
    told = {key: complete("passed") for key in "abc"}
    with pytest.raises(KeyboardInterrupt):
        run_tests([test], tmp_path, MadeUpEngine(told, stop_after=2))
    resumed = MadeUpEngine(told)
    (outcome,) = run_tests([test], tmp_path, resumed, resume=True)
    assert (resumed.ran, len(outcome.results)) == (["c"], 3)
    anew = MadeUpEngine(told)
    run_tests([test], tmp_path, anew)
    assert anew.ran == ["a", "b", "c"]


def test_results_of_other_versions_do_not_count(tmp_path: Path) -> None:
    test, told = made_up_test(["a"]), {"a": complete("passed")}
    run_tests([test], tmp_path, MadeUpEngine(told))
    session = json.loads((tmp_path / "session.json").read_text())
    session["versions"]["fogsim"] = "0.0.1"
    (tmp_path / "session.json").write_text(json.dumps(session))
    resumed = MadeUpEngine(told)
    run_tests([test], tmp_path, resumed, resume=True)
    assert resumed.ran == ["a"]


def test_the_first_failure_ends_it_if_asked(tmp_path: Path) -> None:
    engine = MadeUpEngine({"a": complete("passed"), "b": complete("failed"), "c": complete("passed")})
    (outcome,) = run_tests([made_up_test(["a", "b", "c"])], tmp_path, engine, first_failure_ends=True)
    assert engine.ran == ["a", "b"]
    assert len(outcome.results) == 2
    assert not outcome.is_passed


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "letter.txt").write_text("dear")
    with pytest.raises(InputError, match="holds something else than tests"):
        run_tests([made_up_test(["a"])], tmp_path, MadeUpEngine({}))
    with pytest.raises(InputError, match="is not a folder"):
        run_tests([made_up_test(["a"])], tmp_path / "letter.txt", MadeUpEngine({}))
