"""A study as a page to read: what was compared, the results, and their certainty."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fogsim.core.files.atomic import write_text
from fogsim.metrics import DEFAULT_STANDARD, metric_topics
from fogsim.recorders.manifest import versions
from fogsim.recorders.templating import render
from fogsim.scenario import Scenario
from fogsim.scenario.wording.sentences import SENTENCES, Setting, non_default_settings
from fogsim.study.comparison import (
    RESAMPLES,
    Difference,
    adjust_p_values,
    compare_to_baseline,
    incomplete_metrics,
    mean_interval,
    moved_denominators,
    number_of,
    numeric_metrics,
    uninformative,
)
from fogsim.study.drawing import MUTED, Grid, StudyFigure, label_figure, svg_of
from fogsim.study.main_metrics import DELAY_METRICS, SAFETY_METRICS, main_metrics, metric_words, percent
from fogsim.study.plan import Study, file_digests
from fogsim.study.profile_figures import collisions_figure, speed_figure, survival_figure
from fogsim.study.profiles import Cell, PooledProfiles
from fogsim.study.report_words import Table, comparison_table, events_of_both, main_tables, summary
from fogsim.study.table import Row, rows_of_cells, write_csv

_MOST_VARIANTS = 10
_DISTRIBUTIONS = {"fogsim": "FogSim", "libsumo": "SUMO (libsumo)", "python": "Python"}


@dataclass(frozen=True, slots=True)
class Methods:
    """Paragraphs by their headings, and tables of text by their captions."""

    paragraphs: Mapping[str, str]
    tables: Mapping[str, Table]

    def markdown(self, title: str) -> str:
        """Text of ``methods.md``."""
        parts = [f"# {title}", *(f"**{name}.** {text}" for name, text in self.paragraphs.items())]
        for caption, table in self.tables.items():
            lines = [table.head, ["---"] * len(table.head), *table.rows]
            cells = [[str(cell).replace("|", "\\|").replace("\n", " ") for cell in row] for row in lines]
            parts += [f"## {caption}", "\n".join(f"| {' | '.join(row)} |" for row in cells)]
        return "\n\n".join(parts) + "\n"


def _write_methods(study: Study, folder: Path) -> Methods:
    """Write ``methods.md`` and return its content."""
    found = study_methods(study)
    write_text(folder / "methods.md", found.markdown(f"Methods of the study {study.name}"))
    return found


def study_methods(study: Study) -> Methods:
    """Methods of a study."""
    scenarios = list(study.cells().values())
    paragraphs = {
        "Design": _design(study),
        **{heading: _by_level(study, words) for heading, words in SENTENCES.items()},
        "Statistics": _statistics(study),
        "Software": _software(),
    }
    levels = [
        [factor, level, ", ".join(given) or "–"]
        for factor, of_factor in study.level_settings.items()
        for level, given in of_factor.items()
    ]
    settings = [[key, one.value, one.default or "(required)", one.meaning] for key, one in _common(scenarios).items()]
    digests = dict(item for one in scenarios for item in file_digests(one).items())
    tables = {
        "Factors": Table(["factor", "level", "settings"], levels),
        "Settings of all runs that differ from FogSim's defaults": Table(
            ["key", "value", "default", "meaning"], settings
        ),
        "Input files": Table(["file", "SHA-256 (first 20 digits)"], list(digests.items())),
    }
    return Methods(paragraphs, {caption: table for caption, table in tables.items() if table.rows})


def _software() -> str:
    found = {_DISTRIBUTIONS.get(name, name): version for name, version in versions().items() if version}
    return "; ".join(f"{name} {version}" for name, version in found.items()) + "."


def _common(scenarios: Sequence[Scenario]) -> dict[str, Setting]:
    """Non-default settings that all scenarios have in common."""
    first, *others = [non_default_settings(one) for one in scenarios]
    return {key: one for key, one in first.items() if all(other.get(key) == one for other in others)}


def _by_level(study: Study, words: Callable[[Scenario], str]) -> str:
    """Words on the scenarios of all cells: once if they agree, else by the levels of the factor that they depend on."""
    texts = [(run.levels, words(run.scenario)) for run in {id(run.scenario): run for run in study.runs}.values()]
    cells_of: dict[str, list[Mapping[str, str]]] = {}
    for levels, text in texts:
        cells_of.setdefault(text, []).append(levels)
    if len(cells_of) == 1:
        return texts[0][1]
    if len(cells_of) > _MOST_VARIANTS:
        return f"{texts[0][1]} (The first cell, {_levels(texts[0][0])}; the table of factors has what varies.)"
    for factor in study.factors:
        of_text = {text: list(dict.fromkeys(at[factor] for at in cells)) for text, cells in cells_of.items()}
        if sum(map(len, of_text.values())) == len(study.factors[factor]):
            return " ".join(f"{factor} {', '.join(levels)}: {text}" for text, levels in of_text.items())
    return " ".join(f"{'; '.join(map(_levels, cells))}: {text}" for text, cells in cells_of.items())


def _levels(levels: Mapping[str, str]) -> str:
    return ", ".join(f"{factor} {level}" for factor, level in levels.items())


def _design(study: Study) -> str:
    shape = "; ".join(f"{name}: {', '.join(levels)}" for name, levels in study.factors.items())
    seeds = list(dict.fromkeys(run.seed for run in study.runs))
    is_range = len(seeds) > 1 and seeds == list(range(seeds[0], seeds[-1] + 1))
    numbered = f"{seeds[0]} to {seeds[-1]}" if is_range else ", ".join(map(str, seeds))
    return (
        f"Every combination of the factors ({shape}) was run with {len(seeds)} seeds ({numbered}), {len(study.runs)} "
        f"runs in all. The baseline is {_levels(study.baseline)}. Runs of the same seed have the same demand, the "
        "same drivers and the same sensor noise."
    )


def _statistics(study: Study) -> str:
    return (
        "Differences to the baseline are means over pairs of runs with the same seed. Intervals: "
        f"{100.0 * study.confidence:g} %, bias-corrected and accelerated bootstrap of {RESAMPLES:,} resamples "
        "(Efron 1987). p-values: two-sided paired permutation tests, adjusted among the main metrics by Benjamini & "
        "Hochberg (1995). "
        f"Thresholds of the safety metrics: reaction time {DEFAULT_STANDARD.reaction_time:g} s and deceleration "
        f"{DEFAULT_STANDARD.deceleration:g} m/s² in stopping sight distances, time to collision "
        f"{DEFAULT_STANDARD.time_to_collision:g} s."
    )


def differences_figure(study: Study, metric: str, differences: Sequence[Difference]) -> StudyFigure:
    """Differences of one metric to the baseline with their intervals: a line per policy, a panel per fog."""
    grid, words = Grid(study), metric_words(metric)
    by_cell = {tuple(one.levels.values()): one for one in differences}
    compared = [
        policy for policy in reversed(grid.policies) if policy in {d.levels[grid.policy_factor] for d in differences}
    ]
    figure, panels = grid.figure(0.35 + 0.19 * len(compared), across=4)
    for panel, axes in panels:
        for place, policy in enumerate(compared):
            one = by_cell.get(grid.cell(policy, panel))
            if one is None or one.untested:
                continue
            look = grid.looks[policy]
            if one.low is not None and one.high is not None:
                ends = (words.scale * one.low, words.scale * one.high)
                axes.plot(ends, (place, place), color=look.colour, linewidth=2.0, solid_capstyle="butt")
            filled = look.colour if one.is_shown(study.confidence) else "white"
            axes.plot(
                words.scale * one.difference,
                place,
                look.marker,
                color=look.colour,
                markersize=5.5,
                markerfacecolor=filled,
            )
        axes.axvline(0.0, color=MUTED, linewidth=0.9, zorder=0.5)
        axes.set_yticks(range(len(compared)), compared)
        axes.set_ylim(-0.6, len(compared) - 0.4)
        axes.grid(visible=False, axis="y")
        axes.locator_params(axis="x", nbins=4)
    baseline = " · ".join(study.baseline.values())
    figure.supxlabel(f"{words.axis}, difference to {baseline}", fontsize=8.5)
    caption = (
        f"{words.label}: difference to {baseline} of runs with the same seed, mean and {percent(study.confidence)} "
        "interval. Filled: a difference is shown; open: none could be shown."
    )
    if any(one.untested for one in differences):
        caption += " No marker: a pair lacks a value."
    columns = [*study.factors, "difference", "low", "high"]
    rows = [[*one.levels.values(), one.difference, one.low, one.high] for one in differences]
    return StudyFigure(metric, caption, svg_of(figure, metric), columns, rows)


def trade_off_figure(study: Study, rows: Sequence[Row], across: str, upwards: str) -> StudyFigure:
    """Means of two metrics of completed runs with their intervals: a point per policy, a panel per fog."""
    grid = Grid(study)
    by_cell = rows_of_cells(study.factors, rows)
    figure, panels = grid.figure(2.4, same_axes=False)
    scales = metric_words(across).scale, metric_words(upwards).scale
    table = []
    for panel, axes in panels:
        for policy, look in grid.looks.items():
            cell = grid.cell(policy, panel)
            found = [
                _mean_and_interval(by_cell.get(cell, []), metric, study.confidence) for metric in (across, upwards)
            ]
            (x, *of_x), (y, *of_y) = found
            if x is None or y is None:
                continue
            table.append([*cell, x, *of_x, y, *of_y])
            errors = [_errors(mean, ends, scale) for (mean, *ends), scale in zip(found, scales, strict=True)]
            axes.errorbar(
                *(scales[0] * x, scales[1] * y, errors[1], errors[0]),
                fmt=look.marker,
                color=look.colour,
                markersize=6.0,
                elinewidth=0.9,
                alpha=0.9,
                label=policy,
            )
        if not any(axes.dataLim.intervaly):
            # Around only zeros matplotlib would show negative numbers, which do not occur.
            axes.set_ylim(-0.05, 1.0)
    label_figure(figure, metric_words(across).axis, metric_words(upwards).axis)
    name = f"trade_off_{upwards}"
    caption = (
        f"{metric_words(upwards).label} against {metric_words(across).label}: mean of all seeds; bars are its "
        f"{percent(study.confidence)} bootstrap intervals. The panels' axes differ."
    )
    ends = [f"{metric}{end}" for metric in (across, upwards) for end in ("", "_low", "_high")]
    return StudyFigure(name, caption, svg_of(figure, name), [*study.factors, *ends], table)


def _mean_and_interval(
    rows: Sequence[Row], metric: str, confidence: float
) -> tuple[float | None, float | None, float | None]:
    values = np.array([v for row in rows if (v := number_of(row.get(metric))) is not None])
    if not len(values):
        return None, None, None
    return float(values.mean()), *mean_interval(values, confidence)


def _errors(mean: float | None, ends: Sequence[float | None], scale: float) -> list[list[float]] | None:
    """Lengths of the two error bars at a point, as matplotlib needs them."""
    low, high = ends
    if mean is None or low is None or high is None:
        return None
    # An end that is the mean itself may miss it by a rounding.
    return [[scale * max(mean - low, 0.0)], [scale * max(high - mean, 0.0)]]


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
    differences = adjust_p_values(compare_to_baseline(study, done, main)) + compare_to_baseline(study, done, others)
    shown = {one.metric for one in differences if one.is_shown(study.confidence)}
    remarks = uninformative(done, [name for name in (*main, *others) if name not in shown])
    _write_comparison(study, done, differences, remarks, folder)
    telling = [one for one in differences if one.metric in main and one.metric not in remarks]
    figures = [*_figures(study, done, remarks, profiles, telling)]
    (folder / "figures").mkdir(exist_ok=True)
    # Of an earlier call with other metrics, another baseline or fewer seeds.
    for old in (folder / "figures").glob("*.svg"):
        if old.stem not in {figure.name for figure in figures} and old.with_suffix(".csv").is_file():
            old.unlink()
            old.with_suffix(".csv").unlink()
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
            *(*events_of_both(study, cells, one), one.untested or remarks.get(one.metric)),
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
    known = numeric_metrics(rows, study.factors)
    incomplete = incomplete_metrics(study, rows, known)
    drawable = [name for name in known if name not in incomplete and remarks.get(name) != "does not vary"]
    across = next((name for name in DELAY_METRICS if name in drawable), None)
    for group in SAFETY_METRICS:
        upwards = next((name for name in group if name in drawable), None)
        if across is not None and upwards is not None:
            yield trade_off_figure(study, rows, across, upwards)
    if profiles:
        yield survival_figure(study, profiles)
        over_road = speed_figure(study, profiles), collisions_figure(study, profiles)
        yield from (figure for figure in over_road if figure is not None)
    for metric in dict.fromkeys(one.metric for one in differences if not one.untested):
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
        methods=_write_methods(study, folder),
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
