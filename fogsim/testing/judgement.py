"""Whether all cases of a file together pass, for each clause of each expectation."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum

from scipy.special import betaincinv

from fogsim.conditions import Finding, FindingVerdict
from fogsim.scenario.variation import Verdict
from fogsim.study.plan import StudyRun
from fogsim.testing.collection import FogTest
from fogsim.testing.results import CaseResult


class Outcome(StrEnum):
    """Wording of an outcome in the report."""

    PASSED = "passed"
    FAILED = "failed"
    INCONCLUSIVE = "inconclusive"
    ERROR = "error"


def rate_bounds(passed: int, tried: int, confidence: float) -> tuple[float, float]:
    """Lower and upper bound of a pass rate, each one-sided: Clopper & Pearson (1934), Biometrika 26, 404."""
    failed = tried - passed
    low = 0.0 if passed == 0 else float(betaincinv(passed, failed + 1, 1.0 - confidence))
    high = 1.0 if failed == 0 else float(betaincinv(passed + 1, failed, confidence))
    return low, high


@dataclass(frozen=True, slots=True)
class Judgement:
    """Result of a clause over all cases.

    Attributes
    ----------
    name, clause : str
        The expectation and its clause.
    outcome : Outcome
        The clause's outcome.
    numbers : (int, int, int)
        Cases that passed, failed, and were inconclusive.
    telling : Finding
        A finding that shows why: the first that failed, otherwise the first with the outcome.
    run : StudyRun
        Its case.
    why : str
        Reason for the outcome, if there are several cases.
    """

    name: str
    clause: str
    outcome: Outcome
    numbers: tuple[int, int, int]
    telling: Finding
    run: StudyRun
    why: str = ""

    @property
    def title(self) -> str:
        """Name of the expectation and its clause."""
        return f"{self.name}.{self.clause}" if self.clause else self.name


def judge(test: FogTest, results: Sequence[CaseResult]) -> Iterator[Judgement]:
    """Judge each clause of a test, by the cases whose runs did not fail."""
    clauses: dict[tuple[str, str], list[tuple[StudyRun, Finding]]] = {}
    for result in results:
        for finding in result.findings:
            clauses.setdefault((finding.name, finding.clause), []).append((result.run, finding))
    for (name, clause), findings in clauses.items():
        numbers = _counted(findings)
        outcome, why = _outcome(numbers, test.verdict)
        shown = FindingVerdict.FAILED if numbers[1] else FindingVerdict(str(outcome))
        of_it = (one for one in findings if one[1].verdict is shown)
        run, telling = next(of_it, findings[0])
        yield Judgement(name, clause, outcome, numbers, telling, run, why if len(test.runs) > 1 else "")


def _counted(findings: Sequence[tuple[StudyRun, Finding]]) -> tuple[int, int, int]:
    verdicts = [finding.verdict for _, finding in findings]
    passed, failed = verdicts.count(FindingVerdict.PASSED), verdicts.count(FindingVerdict.FAILED)
    return passed, failed, len(verdicts) - passed - failed


def _outcome(numbers: tuple[int, int, int], verdict: Verdict) -> tuple[Outcome, str]:
    passed, failed, inconclusive = numbers
    tried, of_all = passed + failed, sum(numbers)
    if tried == 0:
        return Outcome.INCONCLUSIVE, f"{inconclusive} of {of_all} cases inconclusive"
    text = f"{passed} of {tried} cases passed" + (f", {inconclusive} inconclusive" if inconclusive else "")
    low, high = float(not failed), float(not failed)
    if verdict.pass_rate < 1.0:
        low, high = rate_bounds(passed, tried, verdict.confidence)
        text += (
            f": a rate of {100 * low:.1f} … {100 * high:.1f} % with {100 * verdict.confidence:.4g} % confidence each; "
            f"wanted {100 * verdict.pass_rate:.4g} %"
        )
    if high < verdict.pass_rate:
        return Outcome.FAILED, text
    # Not multiplied: 0.55 * 100 is more than 55.
    if tried / of_all < verdict.conclusive:
        return Outcome.INCONCLUSIVE, f"{text}; {100 * verdict.conclusive:.4g} % of them must show something"
    return (Outcome.PASSED if low >= verdict.pass_rate else Outcome.INCONCLUSIVE), text
