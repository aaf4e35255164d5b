"""Tests of driving in fog: scenario files with expectations, run case by case and judged."""

from fogsim.testing.collection import FogTest, collect, find_files, only_cases, parse_keywords
from fogsim.testing.execution import check_one_case, check_test
from fogsim.testing.judgement import Judgement, Outcome
from fogsim.testing.results import CaseResult
from fogsim.testing.session import FileOutcome, last_failed, run_tests

__all__ = [
    "CaseResult",
    "FileOutcome",
    "FogTest",
    "Judgement",
    "Outcome",
    "check_one_case",
    "check_test",
    "collect",
    "find_files",
    "last_failed",
    "only_cases",
    "parse_keywords",
    "run_tests",
]
