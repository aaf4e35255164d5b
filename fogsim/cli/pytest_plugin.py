"""Plugin for pytest: ``*.fog.yaml`` files are tests, one item per expectation; ``fogsim_run`` runs one case.

FogSim is imported only for such a file or a test that requests the fixture.
"""

from __future__ import annotations

import argparse
import functools
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from fogsim.testing import CaseResult, FileOutcome, FogTest

_SUFFIXES = (".fog.yaml", ".fog.yml")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options."""
    group = parser.getgroup("fogsim")
    group.addoption(
        "--fogsim-processes",
        type=_number_of_processes,
        default=None,
        metavar="N",
        help="Concurrent runs of *.fog.yaml [one per core].",
    )


def _number_of_processes(text: str) -> int:
    if not text.isdecimal() or not 1 <= int(text) <= 1024:
        raise argparse.ArgumentTypeError(f"expected 1 … 1024, got {text!r}")
    return int(text)


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> FogFile | None:
    """Collect test files."""
    return FogFile.from_parent(parent, path=file_path) if file_path.name.endswith(_SUFFIXES) else None


class FogFile(pytest.File):
    """A scenario file with expectations; its cases are run once, for the first of its items."""

    _tests: list[FogTest]

    def collect(self) -> Iterator[FogItem]:
        """Yield an item for each expectation; CollectError if the file has mistakes."""
        from fogsim.errors import FogSimError
        from fogsim.testing import collect

        try:
            self._tests = collect([self.path])
        except FogSimError as error:
            raise self.CollectError(str(error)) from error
        for test in self._tests:
            for name in test.lines:
                yield FogItem.from_parent(self, name=name, test=test)

    @functools.cached_property
    def outcome(self) -> FileOutcome:
        """Results of all cases."""
        from fogsim.testing import check_test

        (test,) = self._tests
        with tempfile.TemporaryDirectory() as folder:
            return check_test(test, Path(folder), self.config.getoption("--fogsim-processes"))


class FogItem(pytest.Item):
    """An expectation, over all cases of its file."""

    def __init__(self, *, test: FogTest, **about: Any) -> None:
        super().__init__(**about)
        self._test = test

    def runtest(self) -> None:
        """Raise NotPassedError unless all its clauses passed."""
        from fogsim.errors import FogSimError
        from fogsim.testing.page import expectation_lines

        assert isinstance(self.parent, FogFile)  # noqa: S101 - nothing else makes items
        try:
            lines = expectation_lines(self.parent.outcome, self.name)
        except FogSimError as error:
            lines = [str(error)]
        if lines:
            raise NotPassedError("\n".join(lines))

    def repr_failure(
        self,
        excinfo: pytest.ExceptionInfo[BaseException],
        style: Any = None,
    ) -> Any:
        """The result, in place of a traceback."""
        return str(excinfo.value) if isinstance(excinfo.value, NotPassedError) else super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int, str]:
        """File and line of the expectation."""
        line = self._test.lines[self.name].rpartition(":")[2]
        return self.path, int(line) - 1 if line.isdecimal() else 0, f"{self.path.name}::{self.name}"


class NotPassedError(Exception):
    """An expectation failed or was inconclusive, or its run failed."""


@pytest.fixture
def fogsim_run(request: pytest.FixtureRequest) -> Callable[..., CaseResult]:
    """`CaseResult` of a case run here: ``fogsim_run("a.fog.yaml", case="run=3")``, relative to the test's file."""
    from fogsim.testing import check_one_case

    def run(scenario: str | Path, *settings: str, case: str = "", seed: int | None = None) -> CaseResult:
        beside = request.path.parent / scenario
        return check_one_case(beside if beside.exists() else scenario, settings, case, seed)

    return run
