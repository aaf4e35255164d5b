"""The only module that imports openodd-py: what FogSim uses of it, with plain values on this side."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fogsim.errors import InputError, MissingDependencyError
from fogsim.testing.odd.odd_file import OddFile

Measured = float | bool | str | None
"""Measured value; None if it is missing."""

Document = dict[str, Any]
"""Coverage of one run, in openodd-py's format of coverage files."""

_WORDS = {
    "click_hint": "",
    "flaky_cells": "Cells with both outcomes",
    "state_flaky": "Both outcomes",
}
"""The matrix's words: cases differ in what was drawn, so that both outcomes in a cell are no flakiness."""


@dataclass(frozen=True, slots=True)
class Sample:
    """Measured values of a step, and where the ego is: x, y, z [m] and latitude, longitude [°]; None without one."""

    values: Mapping[str, Measured]
    position: tuple[float, float, float] | None
    geolocation: tuple[float, float] | None


@dataclass(frozen=True, slots=True)
class CoveredItem:
    """A concept or situation after a campaign: its unit, its buckets with what was measured, and those not covered."""

    name: str
    unit: str
    measure: str
    target: float
    amounts: Mapping[str, float]
    outside: tuple[str, ...]
    holes: tuple[str, ...]
    samples: int


def _library() -> Any:
    try:
        import openodd  # noqa: PLC0415 - an extra
    except ImportError as error:
        raise MissingDependencyError(
            f"coverage of an ODD needs openodd-py ({error}): pip install 'fogsim[odd]'"
        ) from error
    return openodd


class Coverage:
    """Collects the coverage of one run; a new one for each run."""

    def __init__(self, odd: OddFile) -> None:
        openodd = _library()
        # A name reads a measured value and nothing else; the library would import what it does not know.
        readers = {"signal": lambda name: ((lambda sample: sample.values[name]), odd.probes[name].unit)}
        backend = openodd.Backend("fogsim", readers=readers, allow_imports=False)
        backend.position = lambda sample: sample.position
        backend.geolocation = lambda sample: sample.geolocation
        bindings = {
            name: {**odd.criteria[name], "signal": name, "unit": probe.unit} for name, probe in odd.probes.items()
        }
        try:
            definition = openodd.load_openodd(
                *odd.documents,
                bindings=bindings,
                name=odd.name,
                text=odd.text,
                situations=dict(odd.situations) or None,
                backend=backend,
            )
        except ValueError as error:
            raise InputError(f"{odd.path}: {error}") from error
        self._has_begun = False
        self._collector = openodd.CoverageCollector([], odd=definition, backend=backend)

    def add(self, sample: Sample, time: float) -> None:
        """Count the step that ends at a time [s]; the first one only begins."""
        (self._collector.tick if self._has_begun else self._collector.start)(sample, time)
        self._has_begun = True

    def document(self, scenario: str, passed: bool | None, failed_at: float | None) -> Document:
        """The run's coverage, with its outcome (None for neither) and when it failed [s]."""
        if passed is not None:
            self._collector.record_outcome(passed, failed_at=failed_at)
        document: Document = self._collector.to_dict(scenario)
        # The time of the day would make every file another one.
        document["odd"]["started_at"] = None
        return document


def merged(documents: Sequence[Document]) -> Any:
    """Coverage of several runs together, as openodd-py reports it."""
    return _library().merge_coverage(documents)


def covered_items(report: Any) -> Iterator[CoveredItem]:
    """Concepts and situations of a merged report."""
    for one in report.entries:
        name = one.name.removeprefix("odd.")
        amounts = {bucket: one.amount(bucket) for bucket in one.buckets}
        yield CoveredItem(
            name, one.unit, one.cover_by, one.target, amounts, tuple(one.outside), tuple(one.holes), one.samples
        )


def matrix_page(documents: Sequence[Document], odd: OddFile) -> str:
    """A page with the matrix of any two concepts; it opens with the first two of the binding."""
    openodd = _library()
    view = openodd.CoverageView(documents)
    columns, rows = [*(name for name in odd.probes if name in view.attributes), None, None][:2]
    title = f"ODD {odd.name}: failed of all cases that measured both"
    matrix = view.explorer_html(depth=0, x=columns, y=rows, labels={"title": title, **_WORDS})
    page: str = openodd.view.page(title, matrix)
    return page


def write_cod(document: Document, folder: Path, stem: str) -> None:
    """Write the run's measured values as an OpenODD current operational domain: a table, manifest and taxonomy."""
    _library().export_cod(document, folder, stem)
