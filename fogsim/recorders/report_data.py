"""What the report remembers of a run: curves over time, and a few pictures spread over it."""

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from fogsim.recorders.panel.camera_picture import shown_image
from fogsim.recorders.protocol import Derived
from fogsim.recorders.sign_marks import sign_looks
from fogsim.units import finite_or_none
from fogsim.values import DriverWarning, Step

MOST_PICTURES = 8
"""Pictures in a report."""

AHEAD = 200.0
"""Distance ahead along the route of the place whose believed fog is drawn [m]."""


@dataclass(slots=True)
class AheadCurves:
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
    ahead: AheadCurves = field(default_factory=AheadCurves)  # What was believed of a place ahead

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
        self.collisions.extend(hit.time for hit in step.collisions)
        self.warning.append(step.command.warning)
        self.ahead.add(step)
        self._add_estimates(step)

    def _add_estimates(self, step: Step) -> None:
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
            gap = "" if step.leader is None else f", {step.leader.gap:.0f} m behind the leader"
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
