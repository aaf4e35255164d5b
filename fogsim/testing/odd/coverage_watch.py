"""Measures the concepts of an ODD at each step of a run."""

import math
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fogsim.conditions import SIGNALS, Finding, FindingVerdict, History, Moment
from fogsim.core.files.atomic import write_json, write_text
from fogsim.errors import FogSimError
from fogsim.study.plan import StudyRun
from fogsim.testing.odd.odd_file import OddFile
from fogsim.testing.odd.openodd_library import (
    Coverage,
    CoveredItem,
    Document,
    Measured,
    Sample,
    covered_items,
    matrix_page,
    merged,
    write_cod,
)
from fogsim.testing.results import read_coverage
from fogsim.testing.session import results_folder
from fogsim.values import Step, TrafficStep

_CASES, _WHOLE = "coverage", ("coverage.json", "coverage.html")


def remove_coverage(out: Path) -> None:
    """Remove from a directory the coverage that an earlier campaign wrote there."""
    shutil.rmtree(out / _CASES, ignore_errors=True)
    for name in _WHOLE:
        (out / name).unlink(missing_ok=True)


def write_coverage(out: Path, odd: OddFile, runs: Sequence[StudyRun]) -> tuple[list[str], list[Path]]:
    """Write the coverage of cases with results in a directory into it; return its summary and the files.

    ``coverage.json`` merges all cases, ``coverage.html`` draws the matrix, and ``coverage`` has for each case a
    coverage file of openodd-py and its measured values as an OpenODD current operational domain.
    """
    folder, merging = out / _CASES, list[Document]()
    remove_coverage(out)
    folder.mkdir()
    for run in runs:
        document = read_coverage(results_folder(out), run)
        if document is None:
            continue
        stem = f"case_{run.number:05d}"
        write_cod(document, folder, stem)
        # The table has the samples.
        slim = {**document, "odd": {key: value for key, value in document["odd"].items() if key != "samples"}}
        write_json(folder / f"{stem}_coverage.json", slim)
        merging.append(slim)
    if not merging:
        return [f"ODD {odd.name}: no coverage, all runs ended with errors"], []
    report = merged(merging)
    write_json(out / "coverage.json", report.to_dict())
    write_text(out / "coverage.html", matrix_page(merging, odd))
    seconds = report.odds[odd.name].seconds
    files = [out / "coverage.json", out / "coverage.html", folder]
    return _summary(odd, list(covered_items(report)), seconds["inside"] + seconds["assumed"], seconds["outside"]), files


def _summary(odd: OddFile, items: Sequence[CoveredItem], inside: float, outside: float) -> list[str]:
    wanted = sum(len(one.amounts) - len(one.outside) for one in items)
    covered = wanted - sum(len(one.holes) for one in items)
    lines = [f"ODD {odd.name}: {covered} of {wanted} buckets covered, {inside:.0f} s inside, {outside:.0f} s outside"]
    for one in items:
        if one.holes:
            holes = " ".join(", ".join(one.holes).split())
            never = "never measured: " if not one.samples else ""
            lines.append(f"  hole: {one.name}: {never}{holes} {one.unit}".rstrip())
    return lines


_METRES_PER_DEGREE = math.pi / 180.0 * 6_378_137.0
"""At the equator."""

_DIGITS = 6
"""Decimals of measured numbers, as the library writes them: 33.33 m/s is then not a neighbour of 120 km/h."""

_AT_ONCE = 256
"""Steps that are counted together, which takes a fifth less time than one by one."""


class CoverageWatch:
    """Collects the coverage of one run; invalid estimates are missing, and a signal that raises ends the run."""

    def __init__(self, odd: OddFile) -> None:
        self._odd, self._coverage, self._history = odd, Coverage(odd), History()
        self._probes = [
            (name, SIGNALS[probe.signal.signal], probe.signal.arguments, probe.divisor)
            for name, probe in odd.probes.items()
        ]
        self._waiting: list[tuple[Sample, float]] = []

    def update(self, step: TrafficStep) -> None:
        """Measure the next step."""
        moment, position = self._history.moment(step), None
        if isinstance(step, Step):
            x, y, z = step.traffic.position[step.ego].tolist()
            position = (x, y, z)
        # Roads have no geographic reference: positions count from 0° N, 0° E.
        geolocation = None if position is None else (position[1] / _METRES_PER_DEGREE, position[0] / _METRES_PER_DEGREE)
        self._waiting.append((Sample(self._measured(moment), position, geolocation), step.time))
        if len(self._waiting) == _AT_ONCE:
            self._count()

    def _count(self) -> None:
        for sample, time in self._waiting:
            self._coverage.add(sample, time)
        self._waiting.clear()

    def _measured(self, moment: Moment) -> dict[str, Measured]:
        values: dict[str, Measured] = {}
        for name, signal, arguments, divisor in self._probes:
            try:
                value = signal.read(moment, arguments)
            except Exception as error:
                what = f"{type(error).__name__}: {error}"
                raise FogSimError(f"{self._odd.path}: probes.{name}.signal: {what}") from error
            if isinstance(value, float) and math.isfinite(value):
                value = round(value / divisor, _DIGITS)
            values[name] = value  # type: ignore[assignment]  # ODD files have numbers, words and flags only
        return values

    def document(self, scenario: str, findings: Sequence[Finding]) -> dict[str, Any]:
        """The run's coverage, with its outcome by what came of its expectations."""
        self._count()
        verdicts = {one.verdict for one in findings}
        failed = [one.time for one in findings if one.verdict is FindingVerdict.FAILED and one.time is not None]
        passed = None
        if FindingVerdict.FAILED in verdicts:
            passed = False
        elif verdicts == {FindingVerdict.PASSED}:
            passed = True
        return self._coverage.document(scenario, passed, min(failed, default=None))
