"""Figures of the report, drawn without any of matplotlib's global state."""

import io
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator
from numpy.typing import NDArray

from fogsim.recorders.panel.camera_picture import shown_image
from fogsim.recorders.protocol import Derived
from fogsim.recorders.sign_marks import sign_looks
from fogsim.recorders.style import ON_LIGHT, method_colours
from fogsim.units import KMH_PER_MPS, finite_or_none
from fogsim.values import DriverWarning, Step

MOST_PICTURES = 8
"""Pictures in a report."""

AHEAD = 200.0
"""Distance ahead along the route of the place whose believed fog is drawn [m]."""


@dataclass(slots=True)
class _AheadCurves:
    """Visibility at a place `AHEAD` of the ego over time [m]: true (None in clear air), and believed."""

    # time, truth, low, belief, high: time [s]; `low` and `high` are the ends of the 90 % interval. Empty where nothing
    # is believed of places
    time: list[float] = field(default_factory=list)
    truth: list[float | None] = field(default_factory=list)
    low: list[float] = field(default_factory=list)
    belief: list[float] = field(default_factory=list)
    high: list[float] = field(default_factory=list)

    def add(self, step: Step) -> None:
        """Take in one step."""
        believed, true = step.belief.profile, step.truth.profile
        if believed is None or true is None or not true.distance.size or true.distance[-1] < AHEAD:
            return
        self.time.append(step.time)
        self.truth.append(finite_or_none(true.visibility_quantile(AHEAD, 0.5)))
        for quantiles, share in ((self.low, 0.05), (self.belief, 0.5), (self.high, 0.95)):
            quantiles.append(believed.visibility_quantile(AHEAD, share))


@dataclass(slots=True)
class Curves:
    """Quantities over time, one entry a step; None where a quantity is undefined or without limit."""

    # time, speed, limit, advice, gap, time_to_collision, margin, truth, low, belief, high: in s, m/s and m as their
    # names say; the last four are visibilities, `low` and `high` the ends of the belief's 90 % interval
    time: list[float] = field(default_factory=list)
    speed: list[float] = field(default_factory=list)
    limit: list[float | None] = field(default_factory=list)
    advice: list[float | None] = field(default_factory=list)
    gap: list[float | None] = field(default_factory=list)
    time_to_collision: list[float | None] = field(default_factory=list)
    margin: list[float | None] = field(default_factory=list)
    truth: list[float | None] = field(default_factory=list)
    low: list[float] = field(default_factory=list)
    belief: list[float] = field(default_factory=list)
    high: list[float] = field(default_factory=list)
    # By method, (time [s], visibility [m]) of each valid estimate of fog
    estimates: dict[str, list[tuple[float, float]]] = field(default_factory=dict)
    collisions: list[float] = field(default_factory=list)  # Instants of collisions [s]
    warning: list[DriverWarning | None] = field(default_factory=list)  # What the driver was warned of, one entry a step
    ahead: _AheadCurves = field(default_factory=_AheadCurves)  # What was believed of a place ahead

    def add(self, step: Step, derived: Derived) -> None:
        """Take in one step."""
        self.time.append(step.time)
        self.speed.append(float(step.traffic.speed[step.ego]))
        self.limit.append(finite_or_none(step.speed_limit))
        self.advice.append(finite_or_none(step.command.advice.speed))
        self.gap.append(None if step.leader is None else step.leader.gap)
        self.time_to_collision.append(derived["time_to_collision_s"])
        self.margin.append(derived["visibility_margin_m"])
        self.truth.append(finite_or_none(step.truth.visibility_ahead))
        for quantiles, share in ((self.low, 0.05), (self.belief, 0.5), (self.high, 0.95)):
            quantiles.append(step.belief.visibility_quantile(share))
        self.collisions.extend(map(step.time_of, step.collisions))
        self.warning.append(step.command.warning)
        self.ahead.add(step)
        for estimate in step.estimates:
            points = self.estimates.setdefault(estimate.method, [])
            if estimate.valid and math.isfinite(estimate.visibility):
                points.append((step.time, estimate.visibility))


@dataclass(frozen=True, slots=True)
class ReportPicture:
    """One camera image and what was known when it was taken."""

    # time, route_position: when [s] and where [m]
    time: float
    route_position: float
    truth: float | None  # True visibility ahead [m]; None in clear air
    # low, belief, high: believed visibility with its 90 % interval [m]
    low: float
    belief: float
    high: float
    image: NDArray[np.uint8]  # The image

    @classmethod
    def of_step(cls, step: Step) -> "ReportPicture":
        """Take the picture of a step; the image is copied, since a camera may use its memory again."""
        low, middle, high = (step.belief.visibility_quantile(share) for share in (0.05, 0.5, 0.95))
        truth = finite_or_none(step.truth.visibility_ahead)
        return cls(step.time, step.route_position, truth, low, middle, high, shown_image(step.observation).copy())


class Album:
    """Pictures spread evenly over a run whose length is not known before its end.

    Every second picture is dropped, and half as many are taken from then on, whenever twice as many are held as the
    report shows.
    """

    def __init__(self) -> None:
        self._stride = 1
        self._count = 0
        self._pictures: list[ReportPicture] = []
        self._last: Step | None = None

    def add(self, step: Step) -> None:
        """Take in one step."""
        if self._count % self._stride == 0:
            if len(self._pictures) == 2 * MOST_PICTURES:
                self._pictures = self._pictures[::2]
                self._stride *= 2
            self._pictures.append(ReportPicture.of_step(step))
        self._count += 1
        self._last = step

    def chosen(self) -> list[ReportPicture]:
        """Choose the pictures to show: the first, the last and what lies evenly between them."""
        if self._last is None:
            return []
        pictures = list(self._pictures)
        if pictures[-1].time != self._last.time:
            pictures.append(ReportPicture.of_step(self._last))
        count = min(MOST_PICTURES, len(pictures))
        places = np.linspace(0, len(pictures) - 1, count).round().astype(int)
        return [pictures[place] for place in places]


_CLOSE = 200.0
"""Visibility ahead below which drivers slow down [m] (White & Jeffery 1980)."""

_LEAST_BRAKING = 1.0  # m/s²; anything softer is no braking that a reader asks about


class DecisiveFrames:
    """Frames at the decisive moments of a run: into the fog, hardest braking, least time to collision, collision."""

    def __init__(self) -> None:
        self._found: dict[str, tuple[float, str, ReportPicture]] = {}
        self._was_clear = False

    def add(self, step: Step, derived: Derived) -> None:
        """Keep the frame of a step where it is the most decisive one so far."""
        row, left = step.ego, derived["time_to_collision_s"]
        ahead, braking = step.truth.visibility_ahead, -float(step.traffic.acceleration[row])
        if self._was_clear and ahead < _CLOSE:
            self._keep("fog", 0.0, f"First frame with less than {_CLOSE:.0f} m of visibility ahead", step)
        self._was_clear |= ahead >= _CLOSE
        if braking > _LEAST_BRAKING:
            self._keep("braking", -braking, f"Hardest braking: {braking:.1f} m/s²", step)
        if left is not None:
            gap = "" if step.leader is None else f", {round(step.leader.gap)} m behind the leader"
            self._keep("approach", left, f"Least time to collision: {left:.1f} s{gap}", step)
        hit = next((one for one in step.collisions if step.traffic.ids[row] in (one.collider, one.victim)), None)
        if hit is not None:
            self._keep("collision", 0.0, f"Collision of {hit.collider} with {hit.victim}", step)

    def _keep(self, kind: str, value: float, caption: str, step: Step) -> None:
        if kind not in self._found or value < self._found[kind][0]:
            self._found[kind] = value, caption, ReportPicture.of_step(step)

    def in_order(self) -> list[tuple[str, ReportPicture]]:
        """Captions and frames, by time."""
        return sorted(((said, one) for _, said, one in self._found.values()), key=lambda found: found[1].time)


@dataclass(frozen=True, slots=True)
class SignRow:
    """What became of a sign of the map in a run."""

    # sign_id, kind: the sign by the map
    sign_id: str
    kind: str
    mapped_at: float  # Distance at which the map first had it ahead [m]
    first_seen: float | None  # Distance at which it was first detected in a picture [m]; None if it never was
    nearest: float  # Least distance at which it was ahead [m]


class SignBook:
    """Signs of the map that were ahead in a run."""

    def __init__(self) -> None:
        self._rows: dict[str, SignRow] = {}

    @property
    def rows(self) -> tuple[SignRow, ...]:
        """One for each sign, in the order in which they came."""
        return tuple(self._rows.values())

    def add(self, step: Step) -> None:
        """Take in one step."""
        if not step.observation.signs:
            return
        seen = {look.sign_id: look.first_seen for look in sign_looks(step)}
        for sign in step.observation.signs:
            row = self._rows.get(sign.sign_id) or SignRow(sign.sign_id, sign.kind, sign.distance, None, sign.distance)
            first = row.first_seen if seen.get(sign.sign_id) is None else seen[sign.sign_id]
            self._rows[sign.sign_id] = replace(row, first_seen=first, nearest=min(row.nearest, sign.distance))


TRUTH, BELIEF, ADVICE, ALARM, SPEED = "#c28a00", "#1f6fd0", "#1f9d61", "#cf3a34", "#1c2733"
_MUTED = "#7b8794"
"""Colours of what is drawn; `ALARM` is of collisions and dangers."""

_VISIBILITY_TICKS = (20, 50, 100, 200, 500, 1000, 2000)
_MOST_MARGIN = 300.0
"""Safety margins beyond this are drawn at it, so that the dangerous part can be read [m]."""


_WARNINGS = {
    DriverWarning.FOG_AHEAD: "#e39a1f",
    DriverWarning.CANNOT_SEE: _MUTED,
    DriverWarning.CAMERA_DEGRADED: ALARM,
    DriverWarning.COLLISION: SPEED,
}


def draw_figures(curves: Curves, time_to_collision_threshold: float = 3.0) -> list[tuple[str, bytes]]:
    """Caption and PNG of every figure of the report (`time_to_collision_threshold` [s])."""

    def figure(heights: Sequence[float], draw: Callable[[Sequence[Axes]], None]) -> bytes:
        return figure_over_time(curves.time, curves.collisions, heights, draw)

    ahead: list[tuple[str, bytes]] = []
    if curves.ahead.time:
        said = f"Visibility at the place {AHEAD:.0f} m ahead along the road: true, and believed with its 90 % interval."
        ahead.append((said, figure((2.9,), lambda axes: _draw_ahead(axes[0], curves.ahead))))
    return [
        (
            "Meteorological visibility: what was true ahead of the camera, what each method said frame by frame, "
            "and what was believed with its 90 % interval.",
            figure((3.4,), lambda axes: _draw_visibility(axes[0], curves)),
        ),
        *ahead,
        (
            "Speed of the ego, the advice in force and the speed limit; along the top, what the driver was warned of.",
            figure((2.5,), lambda axes: _draw_speed(axes[0], curves)),
        ),
        (
            "Gap to the vehicle ahead, and time to collision while it is approached.",
            figure((1.9, 1.7), lambda axes: _draw_conflict(axes, curves, time_to_collision_threshold)),
        ),
        (
            "Safety margin: true visibility ahead minus the distance in which the ego could stop. "
            "Where it is negative, something standing on the road could not have been avoided.",
            figure((2.5,), lambda axes: _draw_margin(axes[0], curves)),
        ),
    ]


def figure_over_time(
    time: Sequence[float],
    collisions: Sequence[float],
    heights: Sequence[float],
    draw: Callable[[Sequence[Axes]], None],
) -> bytes:
    """Draw quantities over time, collisions marked, as PNG (`time` [s], `collisions` [s], `heights` [inch])."""

    def draw_marked(axes: Sequence[Axes]) -> None:
        draw(axes)
        for axis in axes:
            for number, instant in enumerate(collisions):
                label = "collision" if number == 0 else None
                axis.axvline(instant, color=ALARM, linewidth=1.2, linestyle=(0, (4, 2)), zorder=5, label=label)
            axis.set_xlim(time[0], max(time[-1], time[0] + 1e-3))

    return drawn_figure(heights, draw_marked, "time [s]")


def drawn_figure(heights: Sequence[float], draw: Callable[[Sequence[Axes]], None], across: str) -> bytes:
    """Draw a figure in the look of the report, as PNG (`heights` [inch])."""
    figure = Figure(figsize=(9.2, sum(heights)), dpi=144)
    # The same margins in every figure, in inches, so that all time axes stand under one another.
    height = sum(heights)
    figure.subplots_adjust(left=0.08, right=0.985, bottom=0.45 / height, top=1 - 0.3 / height, hspace=0.12)
    grid = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=list(heights))
    axes = [row[0] for row in grid]
    draw(axes)
    for axis in axes:
        _dress(axis, legend=axis is axes[0])
    axes[-1].set_xlabel(across, fontsize=9)
    buffer = io.BytesIO()
    FigureCanvasAgg(figure)
    figure.savefig(buffer, format="png")
    return buffer.getvalue()


def _dress(axis: Axes, *, legend: bool) -> None:
    """Give an axis the look of the report."""
    axis.yaxis.set_label_coords(-0.052, 0.5)
    axis.grid(visible=True, color="#e3e8ed", linewidth=0.7)
    axis.set_axisbelow(True)
    axis.spines[["top", "right"]].set_visible(False)
    axis.spines[["left", "bottom"]].set_color("#aab4be")
    axis.tick_params(colors="#44505c", labelsize=8)
    handles, _ = axis.get_legend_handles_labels()
    if handles and legend:
        axis.legend(
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            borderaxespad=0.2,
            ncols=len(handles),
            frameon=False,
            fontsize=8,
            markerscale=2.0,
            columnspacing=1.4,
            handlelength=2.4,
        )


def _draw_visibility(axis: Axes, curves: Curves) -> None:
    low, high = (np.clip(plottable(values), *_ends()) for values in (curves.low, curves.high))
    axis.fill_between(curves.time, low, high, color=BELIEF, alpha=0.18, linewidth=0, label="90 % interval")
    axis.plot(curves.time, curves.belief, color=BELIEF, linewidth=1.6, label="belief")
    colours = method_colours(list(curves.estimates), ON_LIGHT)
    for method, points in curves.estimates.items():
        times, values = np.array(points, dtype=np.float64).reshape(-1, 2).T
        colour = [part / 255.0 for part in colours[method]]
        axis.scatter(times, values, s=5, color=colour, linewidths=0, alpha=0.7, label=method)
    dashes = (0, (5, 1.5))
    axis.plot(
        curves.time, shown_visibility(curves.truth), color=TRUTH, linewidth=1.8, linestyle=dashes, label="truth ahead"
    )
    scale_visibility(axis)


def _draw_ahead(axis: Axes, curves: _AheadCurves) -> None:
    low, high = (np.clip(plottable(values), *_ends()) for values in (curves.low, curves.high))
    axis.fill_between(curves.time, low, high, color=BELIEF, alpha=0.18, linewidth=0, label="90 % interval")
    believed = np.clip(plottable(curves.belief), *_ends())
    axis.plot(curves.time, believed, color=BELIEF, linewidth=1.6, label=f"believed {AHEAD:.0f} m ahead")
    truth = shown_visibility(curves.truth)
    axis.plot(curves.time, truth, color=TRUTH, linewidth=1.8, linestyle=(0, (5, 1.5)), label="truth there")
    scale_visibility(axis)


def scale_visibility(axis: Axes) -> None:
    """Let an axis be of visibility [m]."""
    axis.set_yscale("log")
    axis.set_ylim(*_ends())
    axis.yaxis.set_major_locator(FixedLocator(_VISIBILITY_TICKS))
    axis.yaxis.set_minor_locator(NullLocator())
    axis.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.0f}"))
    axis.set_ylabel("visibility [m]", fontsize=9)


def shown_visibility(values: Sequence[float | None]) -> NDArray[np.float64]:
    """Visibilities to plot [m]; clear air is at the upper end of the axis (`values` [m])."""
    return np.clip(np.nan_to_num(plottable(values), nan=_ends()[1]), *_ends())


def _draw_speed(axis: Axes, curves: Curves) -> None:
    axis.plot(curves.time, plottable(curves.limit) * KMH_PER_MPS, color=_MUTED, linewidth=1.0, label="speed limit")
    advice = plottable(curves.advice) * KMH_PER_MPS
    axis.plot(curves.time, advice, color=ADVICE, linewidth=1.6, drawstyle="steps-post", label="advice")
    axis.plot(curves.time, plottable(curves.speed) * KMH_PER_MPS, color=SPEED, linewidth=1.6, label="speed")
    axis.set_ylim(0.0, 1.06 * axis.get_ylim()[1])
    axis.set_ylabel("speed [km/h]", fontsize=9)
    for warning, colour in _WARNINGS.items():
        given = np.array([one is warning for one in curves.warning])
        if given.any():
            across = axis.get_xaxis_transform()
            label = warning.value.replace("_", " ")
            axis.fill_between(curves.time, 0.95, 1.0, where=given, transform=across, color=colour, lw=0, label=label)


def _draw_conflict(axes: Sequence[Axes], curves: Curves, threshold: float) -> None:
    axes[0].plot(curves.time, plottable(curves.gap), color=SPEED, linewidth=1.6)
    axes[0].set_ylim(bottom=min(0.0, *(gap for gap in curves.gap if gap is not None), 0.0))
    axes[0].set_ylabel("gap [m]", fontsize=9)
    axes[1].axhspan(0, threshold, color=ALARM, alpha=0.10, linewidth=0)
    axes[1].plot(curves.time, plottable(curves.time_to_collision), color=SPEED, linewidth=1.6)
    axes[1].set_ylim(0, 20)
    axes[1].set_ylabel("time to\ncollision [s]", fontsize=9)


def _draw_margin(axis: Axes, curves: Curves) -> None:
    margin = np.minimum(np.nan_to_num(plottable(curves.margin), nan=_MOST_MARGIN), _MOST_MARGIN)
    axis.fill_between(curves.time, margin, 0, where=margin < 0, color=ALARM, alpha=0.25, linewidth=0, interpolate=True)
    axis.axhline(0, color=_MUTED, linewidth=1.0)
    axis.plot(curves.time, margin, color=SPEED, linewidth=1.6)
    axis.set_ylabel("margin [m]", fontsize=9)


def _ends() -> tuple[float, float]:
    return float(_VISIBILITY_TICKS[0]), float(_VISIBILITY_TICKS[-1])


def plottable(values: Sequence[float | None]) -> NDArray[np.float64]:
    """Make an array to plot; matplotlib leaves a gap where a value is missing."""
    return np.array(values, dtype=np.float64)
