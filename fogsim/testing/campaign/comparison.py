"""Before and after: the cases of an earlier campaign, run again to find those whose outcome changed."""

import csv
import io
import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from pathlib import Path

from fogsim.core.files.readers import read_text
from fogsim.errors import InputError, shown
from fogsim.scenario.variation import number_with_unit
from fogsim.testing.campaign.drawing_plan import (
    VERDICTS,
    Drawn,
    Findings,
    Purpose,
    Space,
    fitted,
    run_batch,
    verdict_of,
)
from fogsim.testing.results import CaseResult

CASES = "cases.csv"
"""Name of the table of a campaign's cases."""


@dataclass(frozen=True, slots=True)
class EarlierCase:
    """A case of an earlier campaign: what was drawn, its seed and its verdict."""

    drawn: Drawn
    seed: int
    verdict: str


@dataclass(frozen=True, slots=True)
class Change:
    """A case with another verdict than before."""

    result: CaseResult
    before: str
    after: str


def first_columns(space: Space) -> list[str]:
    """The first columns of the table of cases, up to the verdict."""
    names = [f"{name} [{axis.unit}]" if axis.unit else name for name, axis in space.axes.items()]
    return ["case", "purpose", *names, "seed", "verdict"]


def read_earlier(directory: Path, space: Space) -> tuple[EarlierCase, ...]:
    """Cases of the campaign in a directory; InputError if it has none, or those of another space."""
    path = directory / CASES
    if not path.is_file():
        raise InputError(f"--against {directory}: no {CASES} of a campaign is there")
    (_, header), *rows = _rows(path) or [(1, [])]
    wanted = first_columns(space)
    if header[: len(wanted)] != wanted:
        raise InputError(
            f"{path}: expected the columns {', '.join(wanted)} of this file's space, got {', '.join(header)}"
        )
    if not rows:
        raise InputError(f"{path}: has no case")
    return tuple(_case(path, line, row, space) for line, row in rows)


def _rows(path: Path) -> list[tuple[int, list[str]]]:
    """Rows of a table, and the line in which each ends; a message may have several."""
    reader = csv.reader(io.StringIO(read_text(path), newline=""))
    try:
        return [(reader.line_num, row) for row in reader]
    except csv.Error as error:
        raise InputError(f"{path}:{reader.line_num}: not a table with commas between its columns: {error}") from error


def _case(path: Path, line: int, row: Sequence[str], space: Space) -> EarlierCase:
    try:
        _, purpose, *numbers, seed, verdict = row[: len(space.axes) + 4]
        values = {
            name: number_with_unit(_finite(number), axis.unit)
            for number, (name, axis) in zip(numbers, space.axes.items(), strict=True)
        }
        return EarlierCase(Drawn(Purpose(purpose), values), int(seed), VERDICTS[VERDICTS.index(verdict)])
    except ValueError as error:
        raise InputError(f"{path}:{line}: expected a case of a campaign, got {shown(','.join(row))}") from error


def _finite(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(text)
    return number


def again(
    space: Space, earlier: Sequence[EarlierCase], found: Findings
) -> Generator[list[Drawn], list[CaseResult], None]:
    """One batch with the cases of an earlier campaign, as `drawing_plan.batches`."""
    yield from run_batch([one.drawn for one in earlier], found)
    found.boundary = fitted(space, found.results)
    found.why_no_rate = "the cases are those of an earlier campaign"


def changes(earlier: Sequence[EarlierCase], found: Findings) -> list[Change]:
    """Cases with another verdict than before, in the order of the draws."""
    compared = [(one, before.verdict, verdict_of(one)) for one, before in zip(found.results, earlier, strict=True)]
    return [Change(one, before, after) for one, before, after in compared if before != after]


def changes_text(earlier: Sequence[EarlierCase], found: Findings) -> str:
    """How many verdicts changed, and how."""
    changed = changes(earlier, found)
    kinds = [f"{one.before} → {one.after}" for one in changed]
    counted = ", ".join(f"{kinds.count(kind)} {kind}" for kind in dict.fromkeys(kinds))
    return f"{len(changed)} of {len(earlier)} cases changed" + (f": {counted}" if counted else "")
