"""A study as a page to read: what was compared, what came out, and how sure that is."""

from collections.abc import Sequence
from html import escape
from pathlib import Path

from fogsim.files.atomic import write_text
from fogsim.recorders.report import PAGE_STYLE
from fogsim.scenario.schema import NO_RENDERER
from fogsim.study.comparison import Difference, compare_to_baseline, numeric_metrics, uninformative
from fogsim.study.figures import differences_figure, trade_off_figure
from fogsim.study.plan import Study
from fogsim.study.table import Row, write_csv

SHOWN = (
    "collisions",
    "ego_collisions",
    "max_impact_speed_mps",
    "time_exposed_time_to_collision_s",
    "max_drac_mps2",
    "negative_margin_time_share",
    "minimum_visibility_margin_m",
    "mean_speed_mps",
    "max_deceleration_mps2",
    "above_advice_time_share",
    "belief_median_error_percent",
)
"""Metrics that have a figure in the report; comparison.csv has all of them."""

_TRADE_OFFS = (("mean_speed_mps", "negative_margin_time_share"), ("mean_speed_mps", "collisions"))
_COMPARISON = (
    *("metric", "baseline_mean", "mean", "difference", "low", "high", "p_value", "pairs", "seeds_for_10_percent"),
    "remark",
)


def write_report(study: Study, rows: Sequence[Row], folder: Path) -> list[Difference]:
    """Write ``comparison.csv``, ``report.html``, and the figures as SVG in ``figures``.

    Parameters
    ----------
    study : Study
        The study.
    rows : sequence of Row
        Its table.
    folder : Path
        Where they go.

    Returns
    -------
    list of Difference
        What the page shows.
    """
    done = [row for row in rows if row["status"] == "complete"]
    metrics = numeric_metrics(done, study.factors)
    remarks = uninformative(done, metrics)
    differences = compare_to_baseline(study, done, metrics)
    write_csv(
        folder / "comparison.csv",
        [*study.factors, *_COMPARISON],
        [_comparison_row(study, one, remarks.get(one.metric)) for one in differences],
    )
    figures = _figures(study, done, [one for one in differences if one.metric not in remarks])
    (folder / "figures").mkdir(exist_ok=True)
    for name, svg in figures.items():
        write_text(folder / "figures" / f"{name}.svg", svg)
    write_text(folder / "report.html", _page(study, rows, differences, remarks, figures))
    return differences


def _comparison_row(study: Study, one: Difference, remark: str | None) -> list[object]:
    return [
        *(one.levels[name] for name in study.factors),
        *(one.metric, one.baseline_mean, one.mean, one.difference, one.low, one.high, one.p_value, one.pairs),
        *(one.seeds_for_half_width, remark),
    ]


def _figures(study: Study, rows: Sequence[Row], differences: Sequence[Difference]) -> dict[str, str]:
    figures = {}
    known = {key for row in rows for key in row}
    for across, upwards in _TRADE_OFFS:
        if {across, upwards} <= known:
            figures[f"{upwards}_against_{across}"] = trade_off_figure(study, rows, across, upwards)
    for metric in SHOWN:
        of_metric = [one for one in differences if one.metric == metric]
        if of_metric:
            figures[metric] = differences_figure(study, metric, of_metric)
    return figures


def _page(
    study: Study,
    rows: Sequence[Row],
    differences: Sequence[Difference],
    remarks: dict[str, str],
    figures: dict[str, str],
) -> str:
    title = escape(study.name)
    done = sum(row["status"] == "complete" for row in rows)
    factors = "; ".join(f"{name}: {', '.join(levels)}" for name, levels in study.factors.items())
    failed = [row for row in rows if row["status"] != "complete"]
    return "\n".join(
        [
            '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
            f"<title>{title} – FogSim</title>\n<style>{PAGE_STYLE}</style>\n</head>\n<body>",
            f'<h1>{title}</h1>\n<p class="lead">{done} of {len(rows)} runs. {escape(factors)}. Compared to '
            f"{escape(' · '.join(study.baseline.values()))}, seed by seed.</p>",
            *([f'<div class="partial">PARTIAL: {len(failed)} runs are missing or failed</div>'] if failed else []),
            *(_failures(study, failed)),
            _cameraless(study),
            _differences_table(study, [one for one in differences if one.metric in SHOWN], remarks),
            "<h2>Figures</h2>" if figures else "",
            *(
                f"<figure>{_embedded(svg)}<figcaption>{escape(name)}</figcaption></figure>"
                for name, svg in figures.items()
            ),
            _remarks(remarks),
            "</body>\n</html>\n",
        ]
    )


def _cameraless(study: Study) -> str:
    """Say which cells were run without frames, since nothing in them goes by what a camera sees."""
    cells = dict.fromkeys(" · ".join(r.levels.values()) for r in study.runs if r.scenario.renderer == NO_RENDERER)
    if not cells:
        return ""
    return f'<p class="note">Run without camera, which nothing in them goes by: {escape("; ".join(cells))}.</p>'


def _embedded(svg: str) -> str:
    return svg[svg.index("<svg") :]


def _failures(study: Study, failed: Sequence[Row]) -> list[str]:
    told = [row for row in failed if row["message"]]
    return [
        f'<p class="note">Run {row["run"]} ({escape(" · ".join(str(row[name]) for name in study.factors))}, seed '
        f"{row['seed']}): {escape(str(row['message']))}</p>"
        for row in told[:20]
    ]


def _differences_table(study: Study, differences: Sequence[Difference], remarks: dict[str, str]) -> str:
    head = "".join(f"<th>{escape(name)}</th>" for name in ("metric", *study.factors))
    numbers = ("baseline", "mean", "difference", f"{study.confidence:.0%} interval", "p", "seeds", "seeds for ± 10 %")
    head += "".join(f'<th class="value">{escape(name)}</th>' for name in numbers)
    body = []
    for one in differences:
        cells = "".join(f"<td>{escape(text)}</td>" for text in (one.metric, *one.levels.values()))
        interval = remarks.get(one.metric, "–") if one.low is None else f"{one.low:.3g} … {one.high:.3g}"
        values = (
            *(f"{one.baseline_mean:.3g}", f"{one.mean:.3g}", f"{one.difference:+.3g}", interval),
            *(_shown(one.p_value), str(one.pairs), _shown(one.seeds_for_half_width)),
        )
        body.append(f"<tr>{cells}" + "".join(f'<td class="value">{escape(v)}</td>' for v in values) + "</tr>")
    note = (
        "Differences are of runs with the same seed; intervals by bootstrap (BCa, 9999 resamples), p by a paired "
        "permutation test. The last column says how many seeds an interval of ± 10 % of the baseline's mean would need."
    )
    return f'<h2>Differences</h2><table><tr>{head}</tr>{"".join(body)}</table><p class="note">{note}</p>'


def _shown(value: float | None) -> str:
    return "–" if value is None else f"{value:.2g}" if value < 1 else f"{value:.0f}"


def _remarks(remarks: dict[str, str]) -> str:
    if not remarks:
        return ""
    rows = "".join(f"<tr><td>{escape(name)}</td><td>{escape(why)}</td></tr>" for name, why in remarks.items())
    return f"<h2>Metrics that cannot tell the policies apart</h2><table>{rows}</table>"
