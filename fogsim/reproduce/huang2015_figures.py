"""Each figure of huang2015's tables, the chase that FogSim runs in its place, and both compared."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import inf

import numpy as np

from fogsim.reproduce.result import Cell, PaperCell, Rows
from fogsim.units import extinction_from_visibility
from fogsim.values import Estimate

TABLE_4_1: Mapping[float, tuple[float, float]] = {
    50.0: (46.0, 59.0),
    100.0: (88.0, 103.0),
    200.0: (140.0, 222.0),
    350.0: (193.0, 279.0),
    400.0: (255.0, 288.0),
    500.0: (inf, inf),
}
"""True visibility: that of the inflection, and after the optimisation."""

TABLE_4_2: Mapping[float, Mapping[float, float]] = {
    5.0: {30.0: 84.9044, 35.0: 92.1565, 40.0: 77.1763, 45.0: 92.0751},
    10.0: {35.0: 78.2449, 40.0: 71.1230, 45.0: 71.0602},
    15.0: {40.0: 60.3865, 45.0: 65.4866},
    20.0: {45.0: 55.6010},
}
"""Ratios of variances [%] by difference of range and far range."""

TABLE_4_3: Mapping[float, tuple[float, float]] = {
    50.0: (60.0, 59.0),
    100.0: (95.0, 103.0),
    200.0: (180.0, 222.0),
    350.0: (340.0, 279.0),
    400.0: (380.0, 288.0),
    500.0: (480.0, inf),
}
"""True visibility: from the vehicle ("new approach"), and from the road ("old approach")."""

TABLE_5_1: Mapping[float, Mapping[float, float]] = {
    0.1: {100.0: 106.0, 200.0: 247.0, 300.0: 417.0, 400.0: inf, 500.0: inf},
    0.2: {100.0: 99.0, 200.0: 205.0, 300.0: 402.0, 400.0: 895.0, 500.0: inf},
    0.3: {100.0: 103.0, 200.0: 189.0, 300.0: 364.0, 400.0: 691.0, 500.0: 714.0},
    0.4: {100.0: 95.0, 200.0: 205.0, 300.0: 342.0, 400.0: 459.0, 500.0: 512.0},
    0.5: {100.0: 91.0, 200.0: 201.0, 300.0: 298.0, 400.0: 388.0, 500.0: 523.0},
    0.6: {100.0: 94.0, 400.0: 392.0},
}
"""By track over true visibility, and true visibility."""

TABLE_5_2: Mapping[float, Mapping[float, float]] = {
    1.25: {50.0: 61.0, 100.0: 94.9, 200.0: 202.0},
    2.5: {50.0: 59.0, 100.0: 93.0, 200.0: 186.0},
    3.75: {50.0: 58.0, 100.0: 94.0, 200.0: 178.0},
    5.0: {50.0: 61.0, 100.0: 96.0, 200.0: 200.0, 400.0: 409.0},
    7.5: {50.0: 57.0, 100.0: 91.0, 200.0: 181.0},
    10.0: {50.0: 59.0, 100.0: 95.0, 200.0: 180.0, 400.0: 376.0},
    15.0: {50.0: 62.0, 100.0: 93.0, 200.0: 181.0},
    20.0: {50.0: 55.0, 100.0: 94.0, 200.0: 188.0, 400.0: 409.0},
    30.0: {100.0: 95.0},
    40.0: {400.0: 402.0},
}
"""By interval of pictures [m], and true visibility."""

TABLE_5_3: Mapping[float, Mapping[float, float]] = {
    25.0: {100.0: 97.0, 200.0: 200.0, 300.0: 298.0, 400.0: 388.0, 500.0: 512.0},
    30.0: {100.0: 95.0, 200.0: 198.0, 300.0: 296.0, 400.0: 380.0, 500.0: 484.0},
    35.0: {100.0: 95.0, 200.0: 203.0, 300.0: 281.0, 400.0: 362.0, 500.0: 479.0},
    40.0: {100.0: 91.0, 200.0: 203.0, 300.0: 290.0, 400.0: 373.0, 500.0: 429.0},
    50.0: {100.0: 97.0, 200.0: 203.0, 300.0: 267.0, 400.0: 344.0, 500.0: 434.0},
    60.0: {100.0: 102.0, 200.0: 228.0, 300.0: 316.0, 400.0: 349.0, 500.0: 437.0},
    70.0: {100.0: 112.0, 200.0: 310.0, 300.0: 323.0, 400.0: 373.0, 500.0: 470.0},
}
"""By range of the first picture [m], and true visibility."""


TABLES = ("4.1", "4.2", "4.3", "5.1", "5.2", "5.3")
VARIANTS = ("published", "corrected")

STEP, _FIRST, LAST = 5.0, 25.0, 90.0
"""Ranges at which the thesis clips [m]; table 5.1 has tracks that end beyond."""

_VISIBILITY_4_2 = 150.0
"""V_met of table 4.2 [m]."""

FARTHEST = 10_000.0
"""Visibility from which a result counts as infinite [m]."""


@dataclass(frozen=True, slots=True)
class Case:
    """A vehicle followed in one fog: ranges [m] in steps of `interval` from `start`; back from 90 m, or with noise."""

    visibility: float
    interval: float = STEP
    start: float = _FIRST
    back: bool = False
    noisy: bool = False

    def frames(self, last: float = LAST) -> list[float]:
        """Ranges up to the last one [m], with more than are kept where larger jumps would lose the vehicle."""
        step = min(self.interval, STEP) if self.interval % STEP == 0 else self.interval
        ranges = [float(r) for r in np.arange(self.start, last + 1e-9, step)]
        return ranges[::-1] if self.back else ranges


@dataclass(frozen=True, slots=True)
class Figure:
    """A figure of the thesis: its place, and the chase and range after which ours is read; no chase: from the road.

    `pair` are the near and the far range [m] of table 4.2; `first` is an estimate before the search of section 4.2.4.
    """

    table: str
    row: str
    column: str
    paper: float
    visibility: float
    case: Case | None = None
    after: float = LAST
    pair: tuple[float, float] | None = None
    first: bool = False


Results = Mapping[Case, Mapping[str, Mapping[float, Estimate]]]
"""Estimates by case, variant and range of the latest frame [m]."""

Rough = Mapping[float, Mapping[str, Estimate]]
"""Estimates from the road alone, by visibility [m] and variant."""


def figures(tables: Sequence[str]) -> list[Figure]:
    """All figures of some tables of the thesis."""
    return [figure for figure in (*_of_chapter_4(), *_of_chapter_5()) if figure.table in tables]


def _of_chapter_4() -> Iterator[Figure]:
    for v, (first, optimised) in TABLE_4_1.items():
        yield Figure("4.1", _fog(v), "first", first, v, first=True)
        yield Figure("4.1", _fog(v), "optimised", optimised, v)
    case, farthest = Case(_VISIBILITY_4_2), max(TABLE_4_2[STEP])
    for apart, ratios in TABLE_4_2.items():
        for far, ratio in ratios.items():
            row, column = f"{apart:g} m apart [%]", f"far one at {far:g} m"
            yield Figure("4.2", row, column, ratio, _VISIBILITY_4_2, case, farthest, (far - apart, far))
    for v, (vehicle, road) in TABLE_4_3.items():
        yield Figure("4.3", _fog(v), "from the vehicle", vehicle, v, Case(v))
        yield Figure("4.3", _fog(v), "from the road", road, v)


def _of_chapter_5() -> Iterator[Figure]:
    for share, row in TABLE_5_1.items():
        for v, paper in row.items():
            after = _FIRST + STEP * max(round(share * v / STEP), 2)
            yield Figure("5.1", f"track of {100 * share:g} % of V_met", _fog(v), paper, v, Case(v), after)
    for interval, row in TABLE_5_2.items():
        for v, paper in row.items():
            case = Case(v, interval)
            after = case.frames()[-1]
            yield Figure("5.2", f"every {interval:g} m", _fog(v), paper, v, case, after)
    for start, row in TABLE_5_3.items():
        for v, paper in row.items():
            yield Figure("5.3", f"from {start:g} m", _fog(v), paper, v, Case(v, start=start))


def _fog(visibility: float) -> str:
    return f"V_met {visibility:g} m"


def wanted_cases(wanted: Sequence[Figure], more: Sequence[Case]) -> dict[Case, float]:
    """Every case once, with the last range that is needed [m]."""
    cases = dict.fromkeys(more, LAST)
    for figure in wanted:
        if figure.case is not None:
            cases[figure.case] = max(cases.get(figure.case, 0.0), figure.after)
    return cases


def _estimate(figure: Figure, variant: str, results: Results, rough: Rough) -> Estimate:
    if figure.case is None:
        return rough[figure.visibility][variant]
    return results[figure.case][variant][figure.after]


def seen_visibility(estimate: Estimate) -> float | None:
    """Visibility of a valid estimate [m], infinite beyond `FARTHEST`; None if it is not valid."""
    if not estimate.valid:
        return None
    return estimate.visibility if estimate.visibility < FARTHEST else math.inf


def _ours(figure: Figure, variant: str, estimate: Estimate) -> float | None:
    if figure.first:
        first = estimate.diagnostics.get("first_extinction")
        return math.log(20.0) / first if isinstance(first, float) else None
    if figure.pair is None:
        return seen_visibility(estimate)
    if not estimate.valid:
        return None
    if variant == "corrected":
        # It compares no variances: what its extinction makes of theirs.
        return _ratio(figure.pair, estimate.extinction)
    distances, variances = (np.asarray(estimate.diagnostics[name]) for name in ("distances", "variances"))
    near, far = (float(variances[np.argmin(np.abs(distances - at))]) for at in figure.pair)
    return 100.0 * far / near


def _ratio(pair: tuple[float, float], extinction: float) -> float:
    """Far variance over the near one, e^(−2k (d₂ − d₁)) [%]."""
    return 100.0 * math.exp(-2.0 * extinction * (pair[1] - pair[0]))


def cells(wanted: Sequence[Figure], results: Results, rough: Rough) -> list[PaperCell]:
    """Every figure of the thesis with ours."""
    found = []
    for figure in wanted:
        published, corrected = (_ours(figure, name, _estimate(figure, name, results, rough)) for name in VARIANTS)
        names = (f"table {figure.table}", figure.row, figure.column)
        found.append(PaperCell(*names, figure.paper, published, corrected, truth=_truth(figure)))
    return found


def records(wanted: Sequence[Figure], more: Sequence[Case], results: Results, rough: Rough) -> list[dict[str, Cell]]:
    """A flat record for each figure, and for each further case, and variant: the truth and what was found."""
    asked = [*wanted, *(_further(case) for case in more)]
    found: list[dict[str, Cell]] = []
    for figure in asked:
        for name in VARIANTS:
            estimate = _estimate(figure, name, results, rough)
            visibility = seen_visibility(estimate)
            known = visibility is not None and visibility < FARTHEST
            found.append(
                {
                    "paper": "huang2015",
                    "table": figure.table,
                    "row": figure.row,
                    "column": figure.column,
                    "variant": name,
                    "visibility_m": figure.visibility,
                    "found_m": visibility if known else None,
                    "deviation_rel": estimate.standard_deviation / estimate.extinction if known else None,
                }
            )
    return found


def _further(case: Case) -> Figure:
    way = "on the way back" if case.back else "noisy"
    after = case.frames()[-1]
    return Figure("beyond", _fog(case.visibility), way, math.nan, case.visibility, case, after)


def error_table(wanted: Sequence[Figure], compared: Sequence[PaperCell]) -> Rows:
    """Median error of each table against the truth: the thesis', and ours where the thesis has a finite figure."""
    rows: list[tuple[str, ...]] = [("table", "figures", "thesis", *VARIANTS)]
    for table in dict.fromkeys(figure.table for figure in wanted):
        here = [(f, c) for f, c in zip(wanted, compared, strict=True) if f.table == table and math.isfinite(c.paper)]
        columns = ([c.paper for _, c in here], [c.as_published for _, c in here], [c.corrected for _, c in here])
        truths = [_truth(figure) for figure, _ in here]
        rows.append((table, str(len(here)), *(_median_error(column, truths) for column in columns)))
    return tuple(rows)


def _truth(figure: Figure) -> float:
    if figure.pair is None:
        return figure.visibility
    return _ratio(figure.pair, extinction_from_visibility(figure.visibility))


def _median_error(found: Sequence[float | None], truths: Sequence[float]) -> str:
    errors = [100.0 * abs(a / b - 1.0) for a, b in zip(found, truths, strict=True) if a is not None]
    return f"{np.median(errors):.1f} % of {len(errors)}" if errors else "—"
