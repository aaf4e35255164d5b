"""Tables, records and notes of huang2015's evaluation: the thesis' figures beside ours."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.reproduce.huang2015_plan import FIRST, STEP, VARIANTS, VISIBILITY_4_2, WAYS, Case, Plan, Results, Rough
from fogsim.reproduce.huang2015_published import TABLE_4_1, TABLE_4_2, TABLE_4_3, TABLE_5_1, TABLE_5_2, TABLE_5_3
from fogsim.reproduce.result import Cell, Rows, TitledTable, found_visibility
from fogsim.units import extinction_from_visibility
from fogsim.values import Estimate

NOTES = (
    "The thesis tells neither size of image nor camera; its vehicles are clipped by hand from a simulator's pictures,"
    " which seem to be without noise. Ours: 800x600 px, airlight at 200 of 255 levels, noise of photons and read-out"
    " only where it says 'noisy', a radar's range with 0.25 m of noise; the estimator finds and follows the vehicle.",
    "Its eq. 4.11 has f = 1.4 mm, 400 px/mm and H = 1 m, which makes λ = 560 px·m, and says 5600. Table 4.1 tells: its"
    " first estimates lie 15, 11, 18, 20 and 12 rows below the true inflections if λ = 5600 (it speaks of '10 pixels"
    " inaccuracy'), and 1 to 2 rows if it is 560. So its camera is a long lens, as is ours: 400 px a car at 25 m.",
    "As published, the optimisation takes the bottom row's luminance for the road's own. It is fogged: with this lens"
    " that row is 19 m away and has 141 levels where the road has 19 (V_met = 50 m), so V_met comes out too large.",
    "As published, noise adds to every variance: with an ordinary sensor 50 m come out more than 3 times too large.",
    "As published, the way back fails in thin fog: found first at 90 m, the window holds a strip of sky down to 40 m,"
    " whose step to the roof is no detail of the vehicle. The corrected variant uses no variances.",
    "Without noise, 8 bits leave steps that nothing dithers: at 50 m the corrected variant is 6 % low, with noise 2 %.",
    "25 to 90 m every 5 m are 14 pictures over 65 m, not 13 over 75 m. Table 5.1 has ways of 80 to 250 m, which that"
    " vehicle never drives: we have none there.",
    "An interval of 40 m leaves two pictures and so one ratio; the corrected variant wants three.",
)


def tables(results: Results, rough: Rough, plan: Plan) -> tuple[TitledTable, ...]:
    """All tables of the thesis that have figures.

    Parameters
    ----------
    results : mapping
        Estimates of each case by range [m].
    rough : mapping
        Estimates from the road alone, by visibility [m] and variant.
    plan : Plan
        What was run.
    """
    found = "V_met [m]: thesis | published | corrected"
    return (
        TitledTable("Table 4.1: V_met from the road alone [m]", _table_4_1(rough)),
        TitledTable(
            f"Table 4.2: ratios of variances at V_met = {VISIBILITY_4_2:.0f} m [%]: thesis | ours", _table_4_2(results)
        ),
        TitledTable(
            "Table 4.3: V_met from a vehicle followed from 25 to 90 m, and back [m]", _table_4_3(results, plan)
        ),
        TitledTable(f"Table 5.1, by the way followed over the true V_met. {found}", _table_5_1(results, plan)),
        TitledTable(f"Table 5.2, by the interval of pictures. {found}", _table_5_2(results, plan)),
        TitledTable(f"Table 5.3, by the range of the first picture. {found}", _table_5_3(results, plan)),
    )


def _metres(estimate: Estimate | None) -> str:
    if estimate is None or not estimate.valid:
        return "—"
    return f"{estimate.visibility:.0f}" if 0.0 < estimate.visibility < 10_000.0 else "∞"


def _said(value: float | str | None) -> str:
    return "" if value is None else value if isinstance(value, str) else f"{value:.0f}"


def _last(results: Results, case: Case) -> Estimate | None:
    """Estimate of a case after its last frame."""
    found = results.get(case)
    return list(found.values())[-1] if found else None


def _table_4_1(rough: Rough) -> Rows:
    rows: list[tuple[str, ...]] = [
        ("V_met", "thesis, first", "ours, first", "thesis, optimised", "ours, optimised", "corrected", "reason if none")
    ]
    for visibility, found in rough.items():
        published = found["published"]
        first = published.diagnostics.get("first_extinction")
        ours = f"{np.log(20.0) / first:.0f}" if isinstance(first, float) else "—"
        before, after = TABLE_4_1.get(visibility, (None, None))
        told = (_said(before), ours, _said(after), _metres(published), _metres(found["corrected"]))
        rows.append((f"{visibility:.0f}", *told, str(published.diagnostics.get("reason", ""))))
    return tuple(rows)


def _table_4_2(results: Results) -> Rows:
    columns = (25.0, 30.0, 35.0, 40.0, 45.0)
    rows = [("apart", *(f"{column:.0f} m" for column in columns), "e^(-2kd)")]
    estimate = _last(results, Case(VISIBILITY_4_2, "published"))
    variance = dict.fromkeys(columns, np.nan)
    if estimate is not None and "variances" in estimate.diagnostics:
        distances = np.asarray(estimate.diagnostics["distances"])
        for column in columns:
            nearest = int(np.argmin(np.abs(distances - column)))
            if abs(distances[nearest] - column) < 0.3 * STEP:
                variance[column] = float(np.asarray(estimate.diagnostics["variances"])[nearest])
    for i, apart in enumerate((5.0, 10.0, 15.0, 20.0)):
        cells = []
        for j, column in enumerate(columns):
            ratio = 100.0 * variance[column] / variance[column - apart] if j > i else np.nan
            thesis = TABLE_4_2[apart].get(column)
            cells.append(f"{thesis:.1f} | {ratio:.1f}" if thesis is not None and np.isfinite(ratio) else _said(thesis))
        model = 100.0 * np.exp(-2.0 * extinction_from_visibility(VISIBILITY_4_2) * apart)
        rows.append((f"{apart:.0f} m", *cells, f"{model:.1f}"))
    return tuple(rows)


def _table_4_3(results: Results, plan: Plan) -> Rows:
    rows = [("V_met", "thesis", *(f"{name}, {way}" for name in VARIANTS for way in WAYS))]
    for visibility in plan.methods:
        ours = [
            _metres(_last(results, Case(visibility, name, back=way == "back", noisy=way == "noisy")))
            for name in VARIANTS
            for way in WAYS
        ]
        rows.append((f"{visibility:.0f}", _said(TABLE_4_3.get(visibility)), *ours))
    return tuple(rows)


def _three(thesis: float | str | None, estimates: Sequence[Estimate | None]) -> str:
    return " | ".join((_said(thesis) or "-", *map(_metres, estimates)))


def _grid(heading: str, columns: Sequence[float], rows: Mapping[str, Callable[[float], str]]) -> Rows:
    """Rows of cells by visibility."""
    head = (heading, *(f"{v:.0f} m" for v in columns))
    return (head, *((name, *(cell(v) for v in columns)) for name, cell in rows.items()))


def _after(results: Results, case: Case, track: float) -> Estimate | None:
    """Estimate once the vehicle has been followed for so long, rounded to the frames there are; none if too long."""
    ends = FIRST + STEP * max(round(track / STEP), 2)
    return results.get(case, {}).get(ends)


def _table_5_1(results: Results, plan: Plan) -> Rows:
    def cell(share: float) -> Callable[[float], str]:
        return lambda v: _three(
            TABLE_5_1[share].get(v), [_after(results, Case(v, name), share * v) for name in VARIANTS]
        )

    return _grid("track", plan.tracks, {f"{100 * share:.0f} %": cell(share) for share in TABLE_5_1})


def _table_5_2(results: Results, plan: Plan) -> Rows:
    def cell(interval: float) -> Callable[[float], str]:
        def told(v: float) -> str:
            if v not in plan.intervals[interval]:
                return ""
            found = [_last(results, Case(v, name, interval)) for name in VARIANTS]
            return _three(TABLE_5_2[interval].get(v), found)

        return told

    columns = sorted({v for row in plan.intervals.values() for v in row})
    return _grid("interval", columns, {f"{interval:.2f} m": cell(interval) for interval in plan.intervals})


def _table_5_3(results: Results, plan: Plan) -> Rows:
    def cell(start: float) -> Callable[[float], str]:
        return lambda v: _three(
            TABLE_5_3[start].get(v), [_last(results, Case(v, name, start=start)) for name in VARIANTS]
        )

    return _grid("first", plan.references, {f"{start:.0f} m": cell(start) for start in plan.starts})


def _record(table: str, visibility: float, variant: str, estimate: Estimate | None, **more: Cell) -> dict[str, Cell]:
    found = found_visibility(estimate)
    return {
        "paper": "huang2015",
        "table": table,
        "visibility_m": visibility,
        "variant": variant,
        **more,
        "found_m": found,
        "deviation_rel": estimate.standard_deviation / estimate.extinction if estimate and found is not None else None,
    }


def _number(value: float | str | None) -> float | None:
    return value if isinstance(value, float | int) else None


def _rough_records(rough: Rough) -> list[Mapping[str, Cell]]:
    return [
        _record("4.1", v, name, found, thesis_m=_number(TABLE_4_1.get(v, (None, None))[1]))
        for v, by_variant in rough.items()
        for name, found in by_variant.items()
    ]


def _lead_records(results: Results, plan: Plan) -> list[Mapping[str, Cell]]:
    records: list[Mapping[str, Cell]] = []
    for name in VARIANTS:
        for v in plan.methods:
            for way in WAYS:
                thesis = _number(TABLE_4_3.get(v)) if way == "away" else None
                found = _last(results, Case(v, name, back=way == "back", noisy=way == "noisy"))
                records.append(_record("4.3", v, name, found, thesis_m=thesis, way=way))
        for share, row in TABLE_5_1.items():
            for v in plan.tracks:
                found = _after(results, Case(v, name), share * v)
                records.append(_record("5.1", v, name, found, thesis_m=_number(row.get(v)), track_share=share))
        for interval, visibilities in plan.intervals.items():
            for v in visibilities:
                thesis = _number(TABLE_5_2[interval].get(v))
                found = _last(results, Case(v, name, interval))
                records.append(_record("5.2", v, name, found, thesis_m=thesis, interval_m=interval))
        for start in plan.starts:
            for v in plan.references:
                thesis = _number(TABLE_5_3[start].get(v))
                found = _last(results, Case(v, name, start=start))
                records.append(_record("5.3", v, name, found, thesis_m=thesis, first_m=start))
    return records


def verdicts(records: Sequence[Mapping[str, Cell]]) -> list[str]:
    """How far the thesis and ours are from the truth, over the cells that both have.

    Parameters
    ----------
    records : sequence of mapping
        Flat records as of `records`.
    """
    told = []
    for table in ("4.1", "4.3", "5.1", "5.2", "5.3"):
        parts: list[str] = []
        for name in VARIANTS:
            rows = [r for r in records if r["table"] == table and r["variant"] == name and r["thesis_m"] is not None]
            thesis, ours = _misses(rows, "thesis_m"), _misses(rows, "found_m")
            if not parts and thesis.size:
                parts.append(f"thesis {np.median(thesis):.1f}")
            parts.append(f"{name} {np.median(ours):.1f} ({ours.size} of {len(rows)})" if ours.size else f"{name} none")
        told.append(f"Table {table}, median |error| in %: {', '.join(parts)}.")
    return told


def _misses(rows: Sequence[Mapping[str, Cell]], key: str) -> NDArray[np.float64]:
    pairs = [(row[key], row["visibility_m"]) for row in rows]
    return np.array([100.0 * abs(a / b - 1.0) for a, b in pairs if isinstance(a, float | int) and isinstance(b, float)])


def records(results: Results, rough: Rough, plan: Plan) -> list[Mapping[str, Cell]]:
    """A flat record for each case of each variant.

    Parameters
    ----------
    results : mapping
        Estimates of each case by range [m].
    rough : mapping
        Estimates from the road alone, by visibility [m] and variant.
    plan : Plan
        What was run.
    """
    return [*_rough_records(rough), *_lead_records(results, plan)]
