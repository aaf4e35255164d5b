"""The run as a report to read: one HTML page."""

import io
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Generic

from fogsim.core.files.atomic import write_text
from fogsim.recorders.manifest import versions
from fogsim.recorders.panel.camera_picture import scale_image
from fogsim.recorders.protocol import AnyStep_contra, Derived, RunInformation
from fogsim.recorders.report_figures import (
    Album,
    Curves,
    DecisiveFrames,
    ReportPicture,
    SignBook,
    SignRow,
    draw_figures,
)
from fogsim.recorders.templating import render
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

_MOST_SIGNS = 60
"""Signs listed in the report."""

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


def key_numbers(metrics: Mapping[str, object]) -> list[tuple[str, str]]:
    """Keys and words of the numbers that a reader asks about first."""
    wanted = _KEY_NUMBERS if "ego_collisions" in metrics else _KEY_NUMBERS_OF_TRAFFIC
    return [(key, words) for key, words in wanted if key in metrics]


def _by_topic(metrics: Mapping[str, object], topics: Mapping[str, Sequence[str]]) -> dict[str, list[str]]:
    """Keys of all metrics that are not by method, by topic."""
    topic_of = {key: topic for topic, keys in topics.items() for key in keys}
    found: dict[str, list[str]] = {}
    for key, value in metrics.items():
        if not isinstance(value, Mapping):
            found.setdefault(topic_of.get(key, "run"), []).append(key)
    return found


def _jpeg(picture: ReportPicture) -> bytes:
    buffer = io.BytesIO()
    # Noise is what a PNG would spend its bytes on: six times as many, in ten times the time.
    scale_image(picture.image, 480, 480).save(buffer, format="JPEG", quality=90)
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


def shown_metric(key: str, value: object) -> str:
    """A metric with its unit, speeds also in km/h."""
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
    """Writes ``report.html``: metrics, figures and pictures in one file that opens without a network."""

    def __init__(self, information: RunInformation) -> None:
        self._information = information
        self._last: float | None = None
        self._not_played: list[str] = []
        self._open = True

    def record(self, step: AnyStep_contra, derived: Derived) -> None:
        """Remember a step, and what was derived from it."""
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
        """Write the report; it says so if the run was cut short."""
        if not self._open:
            return
        information, metrics = self._information, self._information.summary()
        text = render(
            "run.html",
            title=information.title,
            description=information.description,
            interrupted_at=None if complete else self._last or 0.0,
            recorded=self._last is not None,
            not_played=self._not_played,
            key_numbers=key_numbers(metrics),
            metrics=metrics,
            meanings=information.meanings,
            by_topic=_by_topic(metrics, information.topics),
            settings=information.settings(),
            # Figures take longer than somebody waits who has pressed Ctrl-C.
            figures=self._figures() if self._last is not None and complete else [],
            decisive=self._decisive(),
            pictures=self._pictures(),
            signs=self._signs(),
            most_signs=_MOST_SIGNS,
            footer={"seed": str(information.seed), **{k: v or "not installed" for k, v in versions().items()}},
            label=_label,
            value=shown_metric,
            jpeg=_jpeg,
            caption=_caption,
        )
        write_text(information.directory.file("report"), text)
        self._open = False


class ReportRecorder(StepReport[Step]):
    """Writes the report of a run about an ego."""

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
