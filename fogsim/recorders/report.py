"""The run as a report to read: one HTML page."""

import base64
import io
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Generic

from fogsim.files.atomic import write_text
from fogsim.recorders.manifest import versions
from fogsim.recorders.panel.camera_picture import scale_image
from fogsim.recorders.protocol import AnyStep_contra, Derived, RunInformation
from fogsim.recorders.report_data import Album, Curves, DecisiveFrames, ReportPicture, SignBook, SignRow
from fogsim.recorders.report_figures import draw_figures
from fogsim.units import KMH_PER_MPS
from fogsim.values import Step

_UNITS: Mapping[str, str] = {
    "_mps3": "m/s³",
    "_mps2": "m/s²",
    "_mps": "m/s",
    "_s2": "s²",
    "_s": "s",
    "_m": "m",
    "_percent": "%",
    "_share": "%",
}
"""Unit by the end of a key."""

MOST_SIGNS = 60
"""Signs listed in the report."""

PAGE_STYLE = """
:root { color-scheme: light; }
body { font: 15px/1.5 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; color: #1c2733; background: #fff;
  max-width: 62rem; margin: 2.5rem auto; padding: 0 1.25rem; }
h1 { font-size: 1.9rem; margin: 0 0 .25rem; letter-spacing: -.01em; }
h2 { font-size: 1.15rem; margin: 2.4rem 0 .6rem; padding-bottom: .3rem; border-bottom: 2px solid #e3e8ed; }
p.lead { color: #44505c; margin: 0 0 1rem; white-space: pre-line; }
.partial { background: #cf3a34; color: #fff; font-weight: 600; padding: .7rem 1rem; border-radius: .4rem;
  margin: 1rem 0; }
table { border-collapse: collapse; width: 100%; font-size: .9rem; }
th, td { text-align: left; padding: .3rem .8rem .3rem 0; border-bottom: 1px solid #edf0f3; vertical-align: baseline; }
th { font-weight: 600; color: #44505c; }
td.value, th.value { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums; }
td.meaning { color: #5d6975; }
.numbers { display: grid; grid-template-columns: repeat(3, 1fr); gap: .7rem; margin: 1.2rem 0; }
.numbers div { background: #f4f6f8; border-radius: .4rem; padding: .7rem .9rem; }
.numbers b { display: block; font-size: 1.45rem; line-height: 1.25; font-variant-numeric: tabular-nums; }
.numbers span, .numbers small { font-size: .85rem; font-weight: 400; color: #44505c; }
details { margin: .6rem 0; } summary { cursor: pointer; font-weight: 600; color: #44505c; }
figure { margin: 1.2rem 0 0; break-inside: avoid; }
figure img { width: 100%; height: auto; display: block; }
figcaption, p.note { font-size: .85rem; color: #5d6975; margin-top: .25rem; }
.pictures { display: grid; grid-template-columns: repeat(auto-fill, minmax(19rem, 1fr)); gap: 1rem; }
.pictures figure { margin: 0; }
.pictures img { border-radius: .3rem; background: #11151b; }
footer { margin-top: 2.5rem; font-size: .8rem; color: #5d6975; border-top: 2px solid #e3e8ed; padding-top: .6rem; }
@media print { body { margin: 0; max-width: none; font-size: 11px; } .pictures { grid-template-columns: 1fr 1fr 1fr; } }
"""


@dataclass(frozen=True, slots=True)
class ReportContent:
    """Everything that a report shows."""

    # title, description: name and description of the scenario
    title: str
    description: str
    interrupted_at: float | None  # Instant at which the run was cut short [s], None if it was complete
    recorded: bool  # Whether there was a step
    not_played: Sequence[str]  # What of the script was not played, a line each
    # Summary of the run; a key ends in its unit, and a mapping under ``estimators`` has one entry per method
    metrics: Mapping[str, object]
    meanings: Mapping[str, str]  # One line on each key
    topics: Mapping[str, Sequence[str]]  # Keys by topic
    settings: Mapping[str, str]  # Paragraphs on how the run was set up, by their headings
    figures: Sequence[tuple[str, bytes]]  # (str, bytes): Caption and PNG of each figure
    decisive: Sequence[tuple[str, ReportPicture]]  # Captions and camera images of the decisive moments
    pictures: Sequence[ReportPicture]  # Camera images, spread evenly over the run
    signs: Sequence[SignRow]  # Signs of the map that were ahead
    footer: Mapping[str, str]  # Seed and versions


def render_report(content: ReportContent) -> str:
    """Render a report as HTML; nothing in it is loaded from elsewhere."""
    title = escape(content.title)
    return "\n".join(
        [
            '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f"<title>{title} – FogSim</title>\n<style>{PAGE_STYLE}</style>\n</head>\n<body>",
            f'<h1>{title}</h1>\n<p class="lead">{escape(content.description)}</p>',
            _banner(content.interrupted_at),
            *(f'<p class="note">Not played: {escape(line)}</p>' for line in content.not_played),
            _key_numbers(content.metrics, content.meanings),
            _figures(content.figures, recorded=content.recorded),
            _decisive(content.decisive),
            _methods_table(content.metrics, content.meanings),
            _signs_table(content.signs),
            _pictures(content.pictures),
            _metrics_by_topic(content.metrics, content.meanings, content.topics),
            _settings(content.settings),
            _footer(content.footer),
            "</body>\n</html>\n",
        ]
    )


def _banner(interrupted_at: float | None) -> str:
    if interrupted_at is None:
        return ""
    return f'<div class="partial">PARTIAL: interrupted at t = {interrupted_at:.1f} s</div>'


_KEY_NUMBERS: Sequence[tuple[str, str]] = (
    ("ego_collisions", "collisions of the ego"),
    ("minimum_time_to_collision_s", "least time to collision of the ego"),
    ("overdriven_m_per_km_in_fog", "m per km in fog driven too fast to stop in sight"),
    ("belief_median_error_percent", "median error of the estimated visibility"),
    ("belief_coverage_share", "of its 90 % intervals hold the truth"),
    ("above_advice_time_share", "of the time faster than advised"),
)
"""Metrics that answer the question of a run in fog, and what they are; the report opens with them."""

_KEY_NUMBERS_OF_TRAFFIC: Sequence[tuple[str, str]] = (
    ("traffic_collisions", "collisions"),
    ("traffic_minimum_time_to_collision_s", "least time to collision"),
    ("traffic_overdriven_m_per_vehicle_km_in_fog", "m per vehicle-km in fog driven too fast to stop in sight"),
    ("traffic_sight_margin_by_distance_m", "mean sight margin over the distance in fog"),
    ("traffic_mean_speed_mps", "mean speed"),
    ("traffic_delay_s_per_vehicle_km", "s of delay per vehicle-km"),
)


def _key_numbers(metrics: Mapping[str, object], meanings: Mapping[str, str]) -> str:
    """The first numbers that a reader asks about, large."""
    wanted = _KEY_NUMBERS if "ego_collisions" in metrics else _KEY_NUMBERS_OF_TRAFFIC
    shown = [(key, label) for key, label in wanted if key in metrics]
    tiles = [
        f'<div title="{escape(meanings.get(key, label))}"><b>{escape(_value(key, metrics[key]))}</b>'
        f"<span>{escape(label)}</span></div>"
        for key, label in shown
    ]
    return f'<div class="numbers">{"".join(tiles)}</div>' if tiles else ""


def _metrics_by_topic(
    metrics: Mapping[str, object], meanings: Mapping[str, str], topics: Mapping[str, Sequence[str]]
) -> str:
    """All metrics, a folded table for each topic."""
    topic_of = {key: topic for topic, keys in topics.items() for key in keys}
    tables: dict[str, list[str]] = {}
    for key, value in metrics.items():
        if not isinstance(value, Mapping):
            tables.setdefault(topic_of.get(key, "run"), []).append(
                f'<tr><td>{escape(_label(key))}</td><td class="value">{escape(_value(key, value))}</td>'
                f'<td class="meaning">{escape(meanings.get(key, ""))}</td></tr>'
            )
    head = '<tr><th>metric</th><th class="value">value</th><th>meaning</th></tr>'
    folded = [
        f"<details><summary>{escape(topic.capitalize())} ({len(rows)})</summary><table>{head}\n"
        + "\n".join(rows)
        + "</table></details>"
        for topic, rows in tables.items()
    ]
    return "\n".join(["<h2>All metrics</h2>", *folded]) if folded else ""


def _settings(paragraphs: Mapping[str, str]) -> str:
    """How the run was set up, folded."""
    if not paragraphs:
        return ""
    said = "\n".join(f"<p><b>{escape(name)}.</b> {escape(text)}</p>" for name, text in paragraphs.items())
    return f"<h2>How it was run</h2>\n<details><summary>Methods</summary>{said}</details>"


def _decisive(frames: Sequence[tuple[str, ReportPicture]]) -> str:
    if not frames:
        return ""
    shown = "\n".join(_figure(_png(one), said, f"{said}. {_caption(one)}") for said, one in frames)
    return f'<h2>Decisive frames</h2>\n<div class="pictures">\n{shown}\n</div>'


def _methods_table(metrics: Mapping[str, object], meanings: Mapping[str, str]) -> str:
    """Show the metrics that have one entry per method, one row each."""
    return "\n".join(
        _method_rows(key, value, meanings.get(key, ""))
        for key, value in metrics.items()
        if isinstance(value, Mapping) and value
    )


def _method_rows(name: str, methods: Mapping[str, Mapping[str, object]], meaning: str) -> str:
    keys = list(next(iter(methods.values())))
    head = "".join(f'<th class="value">{escape(_label(key))}</th>' for key in keys)
    rows = [
        f"<tr><td>{escape(method)}</td>"
        + "".join(f'<td class="value">{escape(_value(key, values.get(key)))}</td>' for key in keys)
        + "</tr>"
        for method, values in methods.items()
    ]
    table = f"<table><tr><th>method</th>{head}</tr>\n" + "\n".join(rows) + "\n</table>"
    heading = f"<h2>{escape(_label(name).capitalize())}</h2>"
    return f'{heading}\n{table}\n<p class="note">{escape(meaning)}</p>'


def _figures(figures: Sequence[tuple[str, bytes]], *, recorded: bool) -> str:
    if not figures:
        return f"<p>{'Figures are of whole runs; the rows are a table.' if recorded else 'No step was recorded.'}</p>"
    return "<h2>Timeline</h2>\n" + "\n".join(_figure(png, caption, caption) for caption, png in figures)


def _signs_table(signs: Sequence[SignRow]) -> str:
    """Show the signs of the map that were ahead, and from where they were first seen."""
    if not signs:
        return ""
    head = "".join(f'<th class="value">{name}</th>' for name in ("on the map from", "first seen at", "nearest"))
    rows = [
        f"<tr><td>{escape(sign.sign_id)}</td><td>{escape(sign.kind)}</td>"
        + "".join(
            f'<td class="value">{"–" if distance is None else f"{distance:.0f} m"}</td>'
            for distance in (sign.mapped_at, sign.first_seen, sign.nearest)
        )
        + "</tr>"
        for sign in signs[:MOST_SIGNS]
    ]
    table = f"<table><tr><th>sign</th><th>kind</th>{head}</tr>\n" + "\n".join(rows) + "\n</table>"
    more = f"and {len(signs) - MOST_SIGNS} more; " if len(signs) > MOST_SIGNS else ""
    seen = sum(sign.first_seen is not None for sign in signs)
    note = f"{more}{seen} of {len(signs)} were found in a picture, by methods that look for signs."
    return f'<h2>Signs of the map</h2>\n{table}\n<p class="note">{note}</p>'


def _pictures(pictures: Sequence[ReportPicture]) -> str:
    if not pictures:
        return ""
    shown = "\n".join(_figure(_png(picture), "camera image", _caption(picture)) for picture in pictures)
    return (
        f"<h2>What the camera saw</h2>\n<details><summary>{len(pictures)} frames over the run</summary>"
        f'<div class="pictures">\n{shown}\n</div></details>'
    )


def _figure(png: bytes, alternative: str, caption: str) -> str:
    source = "data:image/png;base64," + base64.b64encode(png).decode("ascii")
    return (
        f'<figure><img src="{source}" alt="{escape(alternative)}"><figcaption>{escape(caption)}</figcaption></figure>'
    )


def _footer(entries: Mapping[str, str]) -> str:
    return "<footer>" + " · ".join(f"{escape(name)} {escape(value)}" for name, value in entries.items()) + "</footer>"


def _png(picture: ReportPicture) -> bytes:
    buffer = io.BytesIO()
    scale_image(picture.image, 480, 480).save(buffer, format="PNG")
    return buffer.getvalue()


def _caption(picture: ReportPicture) -> str:
    truth = "clear" if picture.truth is None else f"{picture.truth:.0f} m"
    return (
        f"t = {picture.time:.1f} s at {picture.route_position / 1000:.2f} km. Visibility ahead: true {truth}, "
        f"believed {picture.belief:.0f} m ({picture.low:.0f} – {picture.high:.0f} m)"
    )


def _suffix(key: str) -> str:
    return next((suffix for suffix in _UNITS if key.endswith(suffix)), "")


def _label(key: str) -> str:
    """Words of a key without its unit; a share keeps its name."""
    suffix = _suffix(key)
    return key.removesuffix("" if suffix == "_share" else suffix).replace("_", " ")


def _value(key: str, value: object) -> str:
    """Say a value with its unit, speeds also in km/h."""
    if value is None:
        return "–"
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value)
    suffix = _suffix(key)
    if suffix == "_share":
        value *= 100
    number = str(value) if isinstance(value, int) else f"{value:.3g}" if abs(value) < 100 else f"{value:.0f}"
    in_kmh = f" ({value * KMH_PER_MPS:.0f} km/h)" if suffix == "_mps" else ""
    return f"{number} {_UNITS.get(suffix, '')}".strip() + in_kmh


class StepReport(ABC, Generic[AnyStep_contra]):
    """Writes ``report.html``: metrics, figures and pictures in one file that opens without a network.

    Parameters
    ----------
    information : RunInformation
        The run.
    """

    def __init__(self, information: RunInformation) -> None:
        self._information = information
        self._last: float | None = None
        self._not_played: list[str] = []
        self._open = True

    def record(self, step: AnyStep_contra, derived: Derived) -> None:
        """Remember a step.

        Parameters
        ----------
        step : TrafficStep
            The finished step.
        derived : mapping from str to float or None
            `DERIVED_QUANTITIES` of the step.
        """
        self._remember(step, derived)
        self._last = step.time
        self._not_played = step.unplayed.lines

    @abstractmethod
    def _remember(self, step: AnyStep_contra, derived: Derived) -> None:
        """Remember what figures and pictures need of a step."""

    @abstractmethod
    def _figures(self) -> Sequence[tuple[str, bytes]]:
        """Caption and PNG of each figure, once there was a step."""

    def _decisive(self) -> Sequence[tuple[str, ReportPicture]]:
        """Captions and camera images of the decisive moments; none where there is no camera."""
        return ()

    def _pictures(self) -> Sequence[ReportPicture]:
        """Camera images; none where there is no camera."""
        return ()

    def _signs(self) -> Sequence[SignRow]:
        """Signs of the map; none where there is no ego."""
        return ()

    def close(self, complete: bool) -> None:
        """Write the report; it says so if the run was cut short.

        Parameters
        ----------
        complete : bool
            False if the run was cut short.
        """
        if not self._open:
            return
        content = ReportContent(
            title=self._information.title,
            description=self._information.description,
            interrupted_at=None if complete else self._last or 0.0,
            recorded=self._last is not None,
            not_played=self._not_played,
            metrics=self._information.summary(),
            meanings=self._information.meanings,
            topics=self._information.topics,
            settings=self._information.settings(),
            # Figures take longer than somebody waits who has pressed Ctrl-C.
            figures=self._figures() if self._last is not None and complete else [],
            decisive=self._decisive(),
            pictures=self._pictures(),
            signs=self._signs(),
            footer=_footnotes(self._information.seed),
        )
        write_text(self._information.directory.report, render_report(content))
        self._open = False


class ReportRecorder(StepReport[Step]):
    """Writes the report of a run about an ego.

    Parameters
    ----------
    information : RunInformation
        The run.
    """

    def __init__(self, information: RunInformation) -> None:
        super().__init__(information)
        self._curves = Curves(estimates={method: [] for method in information.methods})
        self._album, self._book, self._moments = Album(), SignBook(), DecisiveFrames()

    def _remember(self, step: Step, derived: Derived) -> None:
        self._curves.add(step, derived)
        self._album.add(step)
        self._moments.add(step, derived)
        self._book.add(step)

    def _figures(self) -> Sequence[tuple[str, bytes]]:
        return draw_figures(self._curves)

    def _decisive(self) -> Sequence[tuple[str, ReportPicture]]:
        return self._moments.in_order()

    def _pictures(self) -> Sequence[ReportPicture]:
        return self._album.chosen()

    def _signs(self) -> Sequence[SignRow]:
        return self._book.rows


def _footnotes(seed: int) -> Mapping[str, str]:
    return {"seed": str(seed), **{name: version or "not installed" for name, version in versions().items()}}
