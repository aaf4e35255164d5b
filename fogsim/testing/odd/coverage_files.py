"""Files of a campaign's coverage: of all cases together, of each case, and a page with the matrix."""

import shutil
from collections.abc import Sequence
from pathlib import Path

from fogsim.core.files.atomic import write_json, write_text
from fogsim.study.plan import StudyRun
from fogsim.testing.odd.odd_file import OddFile
from fogsim.testing.odd.openodd_library import CoveredItem, Document, covered_items, matrix_page, merged, write_cod
from fogsim.testing.results import read_coverage
from fogsim.testing.session import results_folder

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
