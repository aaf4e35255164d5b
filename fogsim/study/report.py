"""A study as a page to read: what was compared, the results, and their certainty."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from fogsim.core.files.atomic import write_text
from fogsim.metrics import metric_topics
from fogsim.recorders.templating import render
from fogsim.study.comparison import (
    Difference,
    adjust_p_values,
    compare_to_baseline,
    moved_denominators,
    numeric_metrics,
    uninformative,
)
from fogsim.study.drawing import StudyFigure
from fogsim.study.figures import differences_figure, trade_off_figure
from fogsim.study.main_metrics import DELAY_METRICS, SAFETY_METRICS, main_metrics
from fogsim.study.methods import write_methods
from fogsim.study.plan import Study
from fogsim.study.pooled_profiles import Cell, PooledProfiles
from fogsim.study.profile_figures import collisions_figure, speed_figure, survival_figure
from fogsim.study.report_tables import Table, comparison_table, events_of_both, main_tables
from fogsim.study.report_words import summary
from fogsim.study.table import Row, rows_of_cells, write_csv

_MOST_FAILURES = 50


@dataclass(frozen=True, slots=True)
class _Findings:
    """Content of the report: metrics shown first, all differences, uninformative metrics with reasons, and figures."""

    main: Sequence[str]
    differences: Sequence[Difference]
    remarks: Mapping[str, str]
    figures: Sequence[StudyFigure]

    def of_main(self) -> list[Difference]:
        return [one for one in self.differences if one.metric in self.main]

    def of_others(self) -> list[Difference]:
        return [one for one in self.differences if one.metric not in self.main]


def write_report(study: Study, rows: Sequence[Row], profiles: Mapping[Cell, PooledProfiles], folder: Path) -> None:
    """Write ``comparison.csv``, ``report.html``, and the figures as SVG and CSV in ``figures``."""
    done = [row for row in rows if row["status"] == "complete"]
    known = numeric_metrics(done, study.factors)
    main = main_metrics(study.metrics, known)
    others = [] if study.metrics else [name for name in known if name not in main]
    remarks = uninformative(done, [*main, *others])
    differences = adjust_p_values(compare_to_baseline(study, done, main)) + compare_to_baseline(study, done, others)
    _write_comparison(study, done, differences, remarks, folder)
    telling = [one for one in differences if one.metric in main and one.metric not in remarks]
    figures = [*_figures(study, done, remarks, profiles, telling)]
    (folder / "figures").mkdir(exist_ok=True)
    for figure in figures:
        write_text(folder / "figures" / f"{figure.name}.svg", figure.svg)
        write_csv(folder / "figures" / f"{figure.name}.csv", figure.columns, figure.rows)
    write_text(folder / "report.html", _page(study, rows, _Findings(main, differences, remarks, figures), folder))


def _write_comparison(
    study: Study,
    rows: Sequence[Row],
    differences: Sequence[Difference],
    remarks: Mapping[str, str],
    folder: Path,
) -> None:
    names = ("metric", "baseline_mean", "mean", "difference", "low", "high", "p_value", "p_value_adjusted", "pairs")
    events = ("baseline_events", "events")
    seeds = f"seeds_for_{100 * study.wanted_interval:g}_percent"
    cells = rows_of_cells(study.factors, rows)
    lines = [
        [
            *(one.levels[name] for name in study.factors),
            *(one.metric, one.baseline_mean, one.mean, one.difference, one.low, one.high),
            *(one.p_value, one.adjusted_p_value, one.pairs, one.seeds_for_half_width),
            *(*events_of_both(study, cells, one), remarks.get(one.metric)),
        ]
        for one in differences
    ]
    write_csv(folder / "comparison.csv", [*study.factors, *names, seeds, *events, "remark"], lines)


def _figures(
    study: Study,
    rows: Sequence[Row],
    remarks: Mapping[str, str],
    profiles: Mapping[Cell, PooledProfiles],
    differences: Sequence[Difference],
) -> Iterator[StudyFigure]:
    """All figures with data."""
    drawable = [name for name in numeric_metrics(rows, study.factors) if remarks.get(name) != "does not vary"]
    across = next((name for name in DELAY_METRICS if name in drawable), None)
    for group in SAFETY_METRICS:
        upwards = next((name for name in group if name in drawable), None)
        if across is not None and upwards is not None:
            yield trade_off_figure(study, rows, across, upwards)
    if profiles:
        yield survival_figure(study, profiles)
        over_road = speed_figure(study, profiles), collisions_figure(study, profiles)
        yield from (figure for figure in over_road if figure is not None)
    for metric in dict.fromkeys(one.metric for one in differences):
        yield differences_figure(study, metric, [one for one in differences if one.metric == metric])


def _page(study: Study, rows: Sequence[Row], found: _Findings, folder: Path) -> str:
    failed = [row for row in rows if row["status"] != "complete"]
    done = [row for row in rows if row["status"] == "complete"]
    return render(
        "study.html",
        title=study.name,
        failed=len(failed),
        runs=len(rows),
        summary=summary(study, rows, found.of_main(), found.remarks),
        failures=_failures(study, failed[:_MOST_FAILURES]),
        main=main_tables(study, done, found.main, found.of_main(), found.remarks),
        moved=moved_denominators(study, done),
        figures=found.figures,
        comparisons=_comparisons(study, done, found),
        uninformative=_uninformative(study, found),
        methods=write_methods(study, folder),
        command=f"fogsim study {study.file} --out {folder}",
    )


def _failures(study: Study, failed: Sequence[Row]) -> Table:
    keys = ["run", *study.factors, "seed"]
    rows = [[*(str(row[key]) for key in keys), str(row["message"] or "missing")] for row in failed]
    return Table([*keys, "message"], rows)


def _comparisons(study: Study, rows: Sequence[Row], found: _Findings) -> dict[str, tuple[int, Table]]:
    """Number of metrics and table of all comparisons, by topic."""
    topics = {name: topic.capitalize() for topic, names in metric_topics().items() for name in names}
    of_title: dict[str, list[Difference]] = {"Main metrics": found.of_main()}
    for one in found.of_others():
        of_title.setdefault(topics.get(one.metric.partition(".")[0], "Other metrics"), []).append(one)
    return {
        title: (
            len({one.metric for one in differences}),
            comparison_table(study, rows, differences, found.remarks),
        )
        for title, differences in of_title.items()
        if differences
    }


def _uninformative(study: Study, found: _Findings) -> Table:
    absent = [name for name in study.metrics if name not in found.main]
    reasons = {**dict.fromkeys(absent, "no run has a value"), **found.remarks}
    return Table(["metric", "why"], list(reasons.items()))
