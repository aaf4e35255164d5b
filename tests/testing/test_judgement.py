"""Whether all cases of a file together pass."""

from pathlib import Path

import pytest
from scipy.stats import binomtest

from fogsim.conditions import Finding, FindingVerdict
from fogsim.scenario.variation import NONE_FAILS, Verdict
from fogsim.study.plan import StudyRun
from fogsim.testing.collection import FogTest
from fogsim.testing.judgement import Judgement, Outcome, judge, rate_bounds
from fogsim.testing.results import CaseResult


def test_bounds_are_clopper_and_pearsons() -> None:
    for passed, tried in [(0, 5), (3, 5), (58, 60), (60, 60)]:
        # The two-sided interval of twice the rest has the one-sided bounds as its ends.
        interval = binomtest(passed, tried).proportion_ci(0.8, method="exact")
        assert rate_bounds(passed, tried, 0.9) == pytest.approx((interval.low, interval.high))
    wanted = Verdict(pass_rate=0.95, confidence=0.9)
    assert wanted.least_cases == 45
    assert rate_bounds(45, 45, 0.9)[0] >= 0.95 > rate_bounds(44, 44, 0.9)[0]


def judged(verdicts: str, wanted: Verdict = NONE_FAILS) -> Judgement:
    kinds = {"p": FindingVerdict.PASSED, "f": FindingVerdict.FAILED, "i": FindingVerdict.INCONCLUSIVE}
    results = []
    for number, one in enumerate(verdicts):
        run = StudyRun(number, {"run": str(number)}, number, None, str(number))  # type: ignore[arg-type]  # unused
        finding = Finding("safe", "never", kinds[one], "no collision", "", None, None, "")
        results.append(CaseResult(run, None, (finding,)))
    test = FogTest(Path("a"), "a", {"safe": "a:1"}, tuple(one.run for one in results), wanted)
    (judgement,) = judge(test, results)
    return judgement


def test_without_a_rate_none_may_fail_and_half_must_show_something() -> None:
    for verdicts, outcome in [
        ("p", Outcome.PASSED),
        ("f", Outcome.FAILED),
        ("i", Outcome.INCONCLUSIVE),
        ("ppp", Outcome.PASSED),
        ("ppf", Outcome.FAILED),
        ("ppi", Outcome.PASSED),
        ("pii", Outcome.INCONCLUSIVE),
        ("fii", Outcome.FAILED),
        ("iii", Outcome.INCONCLUSIVE),
    ]:
        assert judged(verdicts).outcome is outcome
    # In floating point 0.55 × 100 is more than 55.
    assert judged("p" * 55 + "i" * 45, Verdict(conclusive=0.55)).outcome is Outcome.PASSED


def test_a_single_case_left_by_failed_runs_has_its_reason() -> None:
    run = StudyRun(0, {"run": "0"}, 0, None, "0")  # type: ignore[arg-type]  # unused
    finding = Finding("safe", "never", FindingVerdict.PASSED, "no collision", "", None, None, "")
    test = FogTest(Path("a"), "a", {"safe": "a:1"}, (run,) * 2, Verdict(pass_rate=0.5))
    (judgement,) = judge(test, [CaseResult(run, None, (finding,))])
    assert judgement.outcome is Outcome.INCONCLUSIVE
    assert judgement.why.startswith("1 of 1 cases passed: a rate of 10.0")


def test_a_rate_is_shown_or_refuted_or_neither() -> None:
    wanted = Verdict(pass_rate=0.9, confidence=0.9)
    assert judged("p" * 22, wanted).outcome is Outcome.PASSED
    assert judged("p" * 39 + "f" * 1, wanted).outcome is Outcome.PASSED
    assert judged("p" * 21 + "f", wanted).outcome is Outcome.INCONCLUSIVE
    assert judged("p" * 12 + "f" * 8, wanted).outcome is Outcome.FAILED
    assert "12 of 20 cases passed: a rate of 43.3 … 75.1 %" in judged("p" * 12 + "f" * 8, wanted).why


def test_what_is_told_is_of_the_first_case_that_failed() -> None:
    assert judged("ppff").run.number == 2
    assert judged("pii").run.number == 1
    assert judged("ppp").run.number == 0
