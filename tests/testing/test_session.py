"""Running tests: what counts of earlier calls, and when one ends."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from made_up_cases import BROKEN, MadeUpEngine, complete, made_up_test

from fogsim.core.files.writer_lock import WriterLock
from fogsim.errors import InputError
from fogsim.scenario.variation import Verdict
from fogsim.testing import last_failed, only_cases, run_tests
from fogsim.testing.session import begin_session


def test_all_cases_are_run_and_judged(tmp_path: Path) -> None:
    planned = {"a0": complete("passed"), "a1": complete("failed"), "b0": complete("passed"), "c0": BROKEN}
    tests = [made_up_test(keys, tmp_path / f"{keys[0]}.fog.yaml") for keys in (["a0", "a1"], ["b0"], ["c0"])]
    seen: list[tuple[int, int]] = []
    outcomes = run_tests(tests, tmp_path / "out", MadeUpEngine(planned), watch=lambda *both: seen.append(both))
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
    planned = {key: complete("passed") for key in "abc"}
    with pytest.raises(KeyboardInterrupt):
        run_tests([test], tmp_path, MadeUpEngine(planned, stop_after=2))
    resumed = MadeUpEngine(planned)
    (outcome,) = run_tests([test], tmp_path, resumed, resume=True)
    assert (resumed.ran, len(outcome.results)) == (["c"], 3)
    again = MadeUpEngine(planned)
    run_tests([test], tmp_path, again)
    assert again.ran == ["a", "b", "c"]


def test_results_of_other_versions_do_not_count(tmp_path: Path) -> None:
    test, planned = made_up_test(["a"]), {"a": complete("passed")}
    run_tests([test], tmp_path, MadeUpEngine(planned))
    for distribution, ran in (("platform", []), ("numpy", []), ("fogsim", ["a"])):
        set_version(tmp_path, distribution)
        resumed = MadeUpEngine(planned)
        run_tests([test], tmp_path, resumed, resume=True)
        assert resumed.ran == ran, distribution


def set_version(out: Path, distribution: str) -> None:
    """As if another version had written a directory's results."""
    session = json.loads((out / "session.json").read_text())
    session["versions"][distribution] = "0.0.1"
    (out / "session.json").write_text(json.dumps(session))


def test_a_directory_that_is_being_written_keeps_its_results(tmp_path: Path) -> None:
    test, planned = made_up_test(["a"]), {"a": complete("passed")}
    run_tests([test], tmp_path, MadeUpEngine(planned))
    with WriterLock(tmp_path), pytest.raises(InputError, match="is writing there"):
        run_tests([test], tmp_path, MadeUpEngine(planned))
    assert (tmp_path / "results" / "a.json").exists()


def test_a_result_that_cannot_be_read_is_an_error(tmp_path: Path) -> None:
    planned = {"a": {**complete("failed"), "metrics": {"mine": True}}, "b": complete("passed")}
    (outcome,) = run_tests([made_up_test(["a", "b"])], tmp_path, MadeUpEngine(planned))
    assert [one.message for one in outcome.broken] == ["its result cannot be read"]
    assert not outcome.is_passed


def test_a_failed_run_is_repeated_when_resumed(tmp_path: Path) -> None:
    test = made_up_test(["a", "b"])
    run_tests([test], tmp_path, MadeUpEngine({"a": BROKEN, "b": complete("failed")}))
    resumed = MadeUpEngine({"a": complete("passed")})
    (outcome,) = run_tests([test], tmp_path, resumed, resume=True)
    assert (resumed.ran, outcome.broken) == (["a"], [])


def test_earlier_results_that_cannot_be_removed_never_count(tmp_path: Path) -> None:
    (tmp_path / "scratch").mkdir()
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "session.json").write_text("{}")
    # rmtree removes no link.
    (tmp_path / "out" / "results").symlink_to(tmp_path / "scratch")
    with (
        pytest.raises(InputError, match="results: results of an earlier call"),
        begin_session(tmp_path / "out", resume=False),
    ):
        pass


def test_results_of_a_campaign_are_kept(tmp_path: Path) -> None:
    """Tests, another FogSim and a damaged description are refused; another platform is not."""

    def begun(**how: Any) -> list[str]:
        with begin_session(tmp_path, **how) as folder:
            (folder / "a.json").touch()
            return [file.name for file in folder.iterdir()]

    begun(resume=True, kind="campaign")
    with pytest.raises(InputError, match="holds results of fogsim campaign; choose another directory"):
        begun(resume=False)
    set_version(tmp_path, "platform")
    assert begun(resume=True, kind="campaign") == ["a.json"]
    set_version(tmp_path, "fogsim")
    with pytest.raises(InputError, match=r"holds a campaign of fogsim 0\.0\.1 \(now "):
        begun(resume=True, kind="campaign")
    (tmp_path / "session.json").write_text("{")
    with pytest.raises(InputError, match=r"session\.json: not the description of tests or a campaign"):
        begun(resume=True, kind="campaign")
    assert (tmp_path / "results" / "a.json").exists()


def test_the_first_failure_ends_it_if_asked(tmp_path: Path) -> None:
    """Also where the cases that were run would show the required rate."""
    engine = MadeUpEngine({"a": complete("passed"), "b": complete("failed"), "c": complete("passed")})
    test = made_up_test(["a", "b", "c"], verdict=Verdict(pass_rate=0.01))
    (outcome,) = run_tests([test], tmp_path, engine, first_failure_ends=True)
    assert engine.ran == ["a", "b"]
    assert len(outcome.results) == 2
    assert not outcome.is_passed


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "letter.txt").write_text("dear")
    with pytest.raises(InputError, match="holds something else than tests"):
        run_tests([made_up_test(["a"])], tmp_path, MadeUpEngine({}))
    with pytest.raises(InputError, match="is not a folder"):
        run_tests([made_up_test(["a"])], tmp_path / "letter.txt", MadeUpEngine({}))
