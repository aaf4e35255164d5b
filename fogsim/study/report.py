"""A study as a page to read: what was compared, the results, and their certainty."""

import base64
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

from fogsim.files.atomic import write_text
from fogsim.metrics import metric_topics
from fogsim.recorders.report import PAGE_STYLE
from fogsim.study.comparison import Difference, adjust_p_values, compare_to_baseline, numeric_metrics, uninformative
from fogsim.study.drawing import StudyFigure
from fogsim.study.figures import differences_figure, trade_off_figure
from fogsim.study.main_metrics import DELAY_METRICS, SAFETY_METRICS, main_metrics
from fogsim.study.methods import write_methods
from fogsim.study.plan import Study
from fogsim.study.pooled_profiles import Cell, PooledProfiles
from fogsim.study.profile_figures import collisions_figure, speed_figure, survival_figure
from fogsim.study.report_tables import comparison_table, events_of_both, main_tables, plain_table
from fogsim.study.report_words import summary
from fogsim.study.table import Row, rows_of_cells, write_csv

_STYLE = """
body { max-width: 76rem; }
h3 { font-size: 1rem; margin: 1.2rem 0 .3rem; }
.scrolls { overflow-x: auto; }
.scrolls td:first-child { min-width: 11rem; } .scrolls td, .scrolls th { padding-right: .5rem; }
.scrolls small { color: #5d6975; } .scrolls small b { color: #1c2733; }
figure { max-width: 52rem; }
p.warning { background: #fff4d6; border-left: 4px solid #e0a100; margin: .5rem 0; padding: .4rem .8rem; }
ul { margin: .2rem 0; padding-left: 1.2rem; } code { overflow-wrap: anywhere; }
"""

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
    title = escape(study.name)
    failed = [row for row in rows if row["status"] != "complete"]
    done = [row for row in rows if row["status"] == "complete"]
    return "\n".join(
        [
            '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f"<title>{title} – FogSim</title>\n<style>{PAGE_STYLE}{_STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>",
            *(
                [f'<div class="partial">PARTIAL: {len(failed)} of {len(rows)} runs missing or failed</div>']
                if failed
                else []
            ),
            summary(study, rows, found.of_main(), found.remarks),
            *_failures(study, failed),
            main_tables(study, done, found.main, found.of_main(), found.remarks),
            "<h2>Figures</h2>" if found.figures else "",
            *(_embedded(figure) for figure in found.figures),
            *_details(study, done, found),
            _methods(study, folder),
            "</body>\n</html>\n",
        ]
    )


def _embedded(figure: StudyFigure) -> str:
    """A figure as a separate image, so that ids within two figures do not clash."""
    data = base64.b64encode(figure.svg.encode()).decode("ascii")
    caption = f'{escape(figure.caption)} <a href="figures/{escape(figure.name)}.svg">SVG</a> '
    caption += f'<a href="figures/{escape(figure.name)}.csv">CSV</a>'
    picture = f'<img alt="{escape(figure.caption)}" src="data:image/svg+xml;base64,{data}">'
    return f"<figure>{picture}<figcaption>{caption}</figcaption></figure>"


def _failures(study: Study, failed: Sequence[Row]) -> list[str]:
    if not failed:
        return []
    rows = [
        [
            str(row["run"]),
            *(str(row[name]) for name in study.factors),
            str(row["seed"]),
            str(row["message"] or "missing"),
        ]
        for row in failed[:_MOST_FAILURES]
    ]
    more = len(failed) - len(rows)
    return [
        "<h2>Runs that failed</h2>",
        plain_table(["run", *study.factors, "seed", "message"], rows),
        f'<p class="note">And {more} more; study.csv has all.</p>' if more else "",
    ]


def _details(study: Study, rows: Sequence[Row], found: _Findings) -> Iterator[str]:
    """Details, folded."""
    yield "<h2>All comparisons</h2>"
    topics = {name: topic.capitalize() for topic, names in metric_topics().items() for name in names}
    of_title: dict[str, list[Difference]] = {"Main metrics": found.of_main()}
    for one in found.of_others():
        of_title.setdefault(topics.get(one.metric.partition(".")[0], "Other metrics"), []).append(one)
    for title, differences in of_title.items():
        if differences:
            table = comparison_table(study, rows, differences, found.remarks)
            count = len({one.metric for one in differences})
            yield f"<details><summary>{title} ({count})</summary>{table}</details>"
    yield (
        '<p class="note">In the metrics\' own units. Differences are of runs with the same seed; intervals by '
        "bootstrap (BCa; Efron 1987; 9999 resamples), p by a paired permutation test, adjusted among the main metrics "
        "by Benjamini &amp; Hochberg (1995); seeds needed by the normal law.</p>"
    )
    absent = [name for name in study.metrics if name not in found.main]
    told = {**dict.fromkeys(absent, "no run has a value"), **found.remarks}
    if told:
        yield "<details><summary>Metrics that do not separate the policies</summary>"
        yield plain_table(["metric", "why"], told.items()) + "</details>"


def _methods(study: Study, folder: Path) -> str:
    command = f"fogsim study {study.file} --out {folder}"
    return (
        f"<h2>Methods</h2>\n{write_methods(study, folder).html()}\n"
        f"<p>Command, which also resumes the study if runs are missing: <code>{escape(command)}</code></p>"
    )
