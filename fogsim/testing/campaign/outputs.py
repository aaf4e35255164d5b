"""Files of a campaign: a row a case as CSV, a test case a case as JUnit XML, and a page with the map first."""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator, StrMethodFormatter

from fogsim.core.files.atomic import write_text
from fogsim.recorders.templating import data_url, render
from fogsim.scenario.variation import Draws
from fogsim.study.drawing import INK, dress, svg_of
from fogsim.study.table import write_csv
from fogsim.testing.campaign.boundary import Boundary
from fogsim.testing.campaign.comparison import changes, changes_text, first_columns
from fogsim.testing.campaign.drawing_plan import Findings, Purpose, Space, margin_of, number_of, verdict_of
from fogsim.testing.campaign.running import Campaign, as_test
from fogsim.testing.collection import FogTest, label_of
from fogsim.testing.junit import add_requirements, xml_text
from fogsim.testing.page import command_text, finding_text
from fogsim.testing.results import CaseResult
from fogsim.testing.shrinking import SmallestCase, smallest_text

_METRICS = {
    "min_ttc_s": "minimum_time_to_collision_s",
    "min_gap_m": "minimum_gap_m",
    "max_drac_mps2": "max_drac_mps2",
    "impact_speed_mps": "ego_max_impact_speed_mps",
    "sight_margin_m": "minimum_visibility_margin_m",
}
"""Columns of cases.csv, and the metrics in them."""

_CELLS = 121
_MAPS = 6
_PURPOSES = {
    Purpose.SPACE: "to fill the space",
    Purpose.BOUNDARY: "near the boundary",
    Purpose.LEVEL: "to approach failures",
    Purpose.RATE: "for the failure rate",
}
_COLOURS = LinearSegmentedColormap.from_list("outcome", ["#b5d8c7", "#f7f4ee", "#efb3af"])
_MARKS = {"passed": ("#1f7a4d", "o"), "failed": ("#a31f1a", "X"), "inconclusive": ("#9a6700", "s"), "error": (INK, "*")}


def write_cases(path: Path, campaign: Campaign, found: Findings) -> None:
    """Write a row for each case, in the order of the draws."""
    before = ["verdict_before"] if campaign.earlier else []
    rows = [
        [
            number,
            drawn.purpose,
            *(number_of(one.run.levels[name]) for name in campaign.space.axes),
            one.run.seed,
            verdict_of(one),
            *([campaign.earlier[number].verdict] if before else []),
            margin_of(one),
            *(one.metrics.get(metric) for metric in _METRICS.values()),
            one.message,
        ]
        for number, (drawn, one) in enumerate(zip(found.drawn, found.results, strict=True))
    ]
    write_csv(path, [*first_columns(campaign.space), *before, "margin", *_METRICS, "message"], rows)


def write_campaign_junit(path: Path, campaign: Campaign, found: Findings, settings: Sequence[str]) -> None:
    """Write JUnit XML with a test case for each case; all but passed ones are failures or errors."""
    test, verdicts = as_test(campaign, found), [verdict_of(one) for one in found.results]
    errors, passed = verdicts.count("error"), verdicts.count("passed")
    failures = len(verdicts) - errors - passed
    counts = {"tests": str(len(verdicts)), "failures": str(failures), "errors": str(errors), "skipped": "0"}
    root = ET.Element("testsuites", name="fogsim")
    named = {"name": xml_text(test.name), "file": xml_text(str(test.path))}
    suite = ET.SubElement(root, "testsuite", named | counts)
    for one, verdict in zip(found.results, verdicts, strict=True):
        label, seconds = label_of(one.run), f"{one.duration:.3f}"
        case = ET.SubElement(suite, "testcase", classname=xml_text(str(test.path)), name=xml_text(label), time=seconds)
        add_requirements(case, one.run.scenario, one.run.scenario.expect)
        if verdict != "passed":
            why = xml_text(_why(one))
            wrong = ET.SubElement(case, "error" if verdict == "error" else "failure", type=verdict, message=why)
            wrong.text = xml_text(f"{_why(one)}\n{command_text(test, one.run, settings)}\n")
    ET.indent(root)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n')


def _why(result: CaseResult) -> str:
    if result.message is not None:
        return result.message
    return "; ".join(
        f"{one.name}.{one.clause}: {finding_text(one)}" for one in result.findings if one.verdict != "passed"
    )


def rate_text(found: Findings) -> str:
    """Failure rate with its interval, or why there is none."""
    if found.rate is None or not found.rate.is_known:
        return f"no failure rate: {found.why_no_rate}"
    rate, (low, high) = found.rate, found.rate_interval
    searched = f"{rate.rate:.2g} ({rate.low:.2g} … {rate.high:.2g}) if the search has found every kind of failure"
    cases = f"{rate.runs} cases, effectively {rate.effective:.0f} failures"
    said = f"failure rate under the declared distributions, 90 % interval: {low:.2g} … {high:.2g}; {searched} ({cases}"
    return f"{said}; {found.plain.failed} of {found.plain.drawn} drawn from the distributions alone failed)"


def counts_text(found: Findings) -> str:
    """How many cases had which verdict."""
    verdicts = [verdict_of(one) for one in found.results]
    counted = ", ".join(f"{verdicts.count(word)} {word}" for word in _MARKS if word in verdicts)
    return f"{len(verdicts)} cases: {counted}"


def write_report(
    path: Path, campaign: Campaign, found: Findings, settings: Sequence[str], smallest: SmallestCase | None = None
) -> None:
    """Write the page: maps, failure rate, and the cases that did not pass with the commands that run them again."""
    test, verdicts = as_test(campaign, found), [verdict_of(one) for one in found.results]
    worst = next((word for word in ("error", "failed", "inconclusive") if word in verdicts), "passed")
    page = render(
        "campaign.html",
        title=f"{test.name}: campaign",
        test=test,
        description=found.results[0].run.scenario.description,
        worst=worst,
        counts=counts_text(found),
        rate=rate_text(found),
        smallest=None if smallest is None else smallest_text(test, smallest, settings),
        compared=changes_text(campaign.earlier, found) if campaign.earlier else "",
        changes=[
            (
                one.before,
                one.after,
                label_of(one.result.run),
                _why(one.result),
                command_text(test, one.result.run, settings),
            )
            for one in changes(campaign.earlier, found)
        ]
        if campaign.earlier
        else [],
        space=[(name, _distribution(axis)) for name, axis in campaign.space.axes.items()],
        maps=[
            (caption, data_url(svg_of(figure, caption).encode(), "image/svg+xml"))
            for caption, figure in maps(campaign, found)
        ],
        failures=list(_failures(test, found, settings)),
        purposes=", ".join(
            f"{number} {words}"
            for purpose, words in _PURPOSES.items()
            if (number := sum(one.purpose is purpose for one in found.drawn))
        ),
    )
    write_text(path, page)


def _distribution(axis: Draws) -> str:
    first, second = axis.parameters
    limits = "".join(
        f", {word} {limit:g} {axis.unit}"
        for word, limit in zip(("at least", "at most"), axis.limits, strict=True)
        if math.isfinite(limit)
    )
    return f"{axis.distribution} {first:g}, {second:g} {axis.unit}".rstrip() + limits


def _failures(test: FogTest, found: Findings, settings: Sequence[str]) -> Iterator[tuple[str, str, str, str]]:
    """Verdict, case, reason and command of each case that did not pass, the worst margins first."""
    wrong = [one for one in found.results if verdict_of(one) != "passed"]
    for one in sorted(wrong, key=lambda result: (verdict_of(result) != "error", margin_of(result) or 0.0)):
        yield verdict_of(one), label_of(one.run), _why(one), command_text(test, one.run, settings)


def maps(campaign: Campaign, found: Findings) -> Iterator[tuple[str, Figure]]:
    """Caption and map of each pair of parameters, at most six, those that matter most first."""
    names = list(campaign.space.axes)
    if found.boundary is not None:
        lengths = found.boundary.parameters[1:]
        names = [names[i] for i in np.argsort(lengths, kind="stable")]
    pairs = list(itertools.combinations(names, 2)) if len(names) > 1 else []
    for across, upwards in pairs[:_MAPS]:
        yield _map(campaign, found, across, upwards)


def _map(campaign: Campaign, found: Findings, across: str, upwards: str) -> tuple[str, Figure]:
    axes = campaign.space.axes
    figure = Figure(figsize=(6.4, 4.6), layout="constrained")
    panel = figure.subplots()
    middles = {name: axis.quantile(0.5) for name, axis in axes.items()}
    others = {name: value for name, value in middles.items() if name not in (across, upwards)}
    if found.boundary is not None:
        _draw_boundary(panel, campaign.space, found.boundary, middles, (across, upwards))
    places = campaign.space.places(found.results)
    middle = np.array([axis.place(middles[name]) for name, axis in axes.items()])
    away = [i for i, name in enumerate(axes) if name in others]
    far = np.sqrt(((places - middle)[:, away] ** 2).sum(axis=1)) if away else np.zeros(len(places))
    for word, (colour, marker) in _MARKS.items():
        shown = np.array([verdict_of(one) == word for one in found.results])
        if shown.any():
            x, y = (
                [
                    number_of(one.run.levels[name])
                    for one, is_shown in zip(found.results, shown, strict=True)
                    if is_shown
                ]
                for name in (across, upwards)
            )
            # The nearer to the slice, the larger.
            size = 34.0 * np.exp(-((far[shown] / 0.25) ** 2)) + 5.0
            panel.scatter(x, y, s=size, c=colour, marker=marker, edgecolors="white", linewidths=0.4, label=word)
    for name, set_scale, set_label, set_ends in (
        (across, panel.set_xscale, panel.set_xlabel, panel.set_xlim),
        (upwards, panel.set_yscale, panel.set_ylabel, panel.set_ylim),
    ):
        set_scale("log" if axes[name].is_logarithmic else "linear")
        if axes[name].is_logarithmic:
            ruler = panel.xaxis if name == across else panel.yaxis
            ruler.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            ruler.set_major_formatter(StrMethodFormatter("{x:g}"))
            ruler.set_minor_locator(NullLocator())
        set_label(f"{name} [{axes[name].unit}]" if axes[name].unit else name, fontsize=9, color=INK)
        set_ends(*axes[name].ends)
    dress(panel)
    figure.legend(loc="outside upper right", fontsize=8, frameon=False, ncols=4)
    cut = ", ".join(f"{name} = {value:.4g} {axes[name].unit}".rstrip() for name, value in others.items())
    caption = f"{across} and {upwards}" + (f", cut at {cut}; cases off the cut are drawn smaller" if cut else "")
    if found.boundary is not None:
        caption += "; line: as likely to pass as to fail; dashed: from there on one outcome is 95 % certain"
    return caption, figure


def _draw_boundary(
    panel: Axes, space: Space, boundary: Boundary, middles: Mapping[str, float], shown: tuple[str, str]
) -> None:
    axes, steps = space.axes, np.linspace(0.0, 1.0, _CELLS)
    x, y = ([axes[name].on_axis(one) for one in steps.tolist()] for name in shown)
    places = np.tile([axis.place(middles[name]) for name, axis in axes.items()], (_CELLS * _CELLS, 1))
    columns = [list(axes).index(name) for name in shown]
    places[:, columns[0]], places[:, columns[1]] = np.tile(steps, _CELLS), np.repeat(steps, _CELLS)
    failure = boundary.failure(places).reshape(_CELLS, _CELLS)
    panel.contourf(x, y, failure, levels=np.linspace(0.0, 1.0, 21), cmap=_COLOURS)
    for share, width, style in ((0.5, 1.8, "solid"), (0.05, 0.9, "dashed"), (0.95, 0.9, "dashed")):
        if failure.min() < share < failure.max():
            panel.contour(x, y, failure, levels=[share], colors=[INK], linewidths=width, linestyles=style)
