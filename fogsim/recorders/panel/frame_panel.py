"""One frame of the video: the camera's image, and next to it what is true, believed, advised and lit."""

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from fogsim.recorders.panel import camera_picture
from fogsim.recorders.panel.camera_picture import draw_camera_picture
from fogsim.recorders.panel.strip_chart import TITLE, Axis, Curve, StripChart
from fogsim.recorders.protocol import Derived
from fogsim.recorders.style import (
    ADVICE,
    ALARM,
    AMBER,
    BELIEF,
    BELIEF_BAND,
    GROUND,
    LINE,
    MUTED,
    TEXT,
    TRUTH,
    UNLIT,
    WELL,
    Colour,
    font,
    method_colours,
)
from fogsim.units import KMH_PER_MPS, visibility_from_extinction
from fogsim.values import Collision, DriverWarning, Estimate, FogProfile, FogReport, Lamp, Step

_NEAREST, FARTHEST = -100.0, 500.0
"""Distances ahead at both ends of the chart [m]."""

_TICKS = (0.0, 200.0, 400.0)
_OVERSAMPLING = 2
_DOT = 5
"""Radius of the dot of a report, before the chart is shrunk [px]."""

_FOOT = 12
"""Space for the distances below the curves [px]."""


def _draw_profile(
    size: tuple[int, int],
    axis: Axis,
    believed: FogProfile,
    true: FogProfile | None,
    reported: Sequence[tuple[float, float]] = (),
) -> Image.Image:
    """Draw the visibility at places along the road [m], the vehicle's own a fine line."""
    width, height = size[0] * _OVERSAMPLING, (size[1] - _FOOT) * _OVERSAMPLING
    image = Image.new("RGB", (width, height), WELL)
    draw = ImageDraw.Draw(image)

    def points(profile: FogProfile, share: float) -> list[tuple[float, float]]:
        distances: Sequence[float] = np.linspace(_NEAREST, FARTHEST, 49).tolist()
        inside = [one for one in distances if profile.distance[0] <= one <= profile.distance[-1]]
        return [(_across(one, width), _up(profile.visibility_quantile(one, share), axis, height)) for one in inside]

    for tick in axis.ticks:
        draw.line([(0, _up(tick, axis, height)), (width, _up(tick, axis, height))], fill=LINE, width=_OVERSAMPLING)
    draw.polygon(points(believed, 0.05) + points(believed, 0.95)[::-1], fill=BELIEF_BAND)
    draw.line(
        [(_across(0.0, width), TITLE * _OVERSAMPLING), (_across(0.0, width), height)], fill=TEXT, width=_OVERSAMPLING
    )
    draw.line(points(believed, 0.5), fill=BELIEF, width=2 * _OVERSAMPLING)
    if true is not None and true.distance.size > 1:
        told = points(true, 0.5)
        for start in range(0, len(told) - 1, 3):
            draw.line(told[start : start + 3], fill=TRUTH, width=2 * _OVERSAMPLING)
    for distance, visibility in reported:
        if _NEAREST <= distance <= FARTHEST:
            x, y = _across(distance, width), _up(visibility, axis, height)
            draw.ellipse([(x - _DOT, y - _DOT), (x + _DOT, y + _DOT)], fill=ADVICE)
    chart = Image.new("RGB", size, GROUND)
    chart.paste(image.reduce(_OVERSAMPLING), (0, 0))
    draw = ImageDraw.Draw(chart)
    draw.text((5, 4), "visibility along the road [m]", fill=MUTED, font=font(10), anchor="lt")
    for tick in _TICKS:
        place = (_across(tick, width) / _OVERSAMPLING, size[1])
        draw.text(place, f"{tick:.0f}", fill=MUTED, font=font(9), anchor="mb")
    return chart


def _across(distance: float, width: int) -> float:
    return width * (distance - _NEAREST) / (FARTHEST - _NEAREST)


def _up(visibility: float, axis: Axis, height: int) -> float:
    margin, title = 3 * _OVERSAMPLING, TITLE * _OVERSAMPLING
    return height - margin - axis.height(visibility) * (height - margin - title)


_PANEL_WIDTH = 384
FRAME_WIDTH = camera_picture.WIDTH + _PANEL_WIDTH
FRAME_HEIGHT = camera_picture.HEIGHT

PICTURE_SIZE = camera_picture.WIDTH, camera_picture.HEIGHT
"""Width and height of the picture next to the panel [px]."""

_LEFT, _RIGHT = camera_picture.WIDTH + 16, FRAME_WIDTH - 16
_SPEED_X, _ADVICE_X, _LIMIT_X = _LEFT, _LEFT + 148, _RIGHT - 27
_BANNER_TIME = 3.0
"""How long a collision stays on the picture [s]."""

_NEWS = 30.0
"""Age up to which a report is drawn [s]."""

_CHART_HEIGHT = 92
"""Of visibilities [px]."""

_MOST_METHODS = 4
"""Estimators for which there is a line."""

_LAMPS: Sequence[tuple[Lamp, str, int, Colour]] = (
    (Lamp.DAYTIME, "DAY", 38, TEXT),
    (Lamp.POSITION, "POS", 38, ADVICE),
    (Lamp.LOW_BEAM, "LOW", 38, ADVICE),
    (Lamp.HIGH_BEAM, "HIGH", 40, BELIEF),
    (Lamp.FRONT_FOG, "F FOG", 45, ADVICE),
    (Lamp.REAR_FOG, "R FOG", 45, AMBER),
    (Lamp.STOP, "STOP", 40, ALARM),
    (Lamp.INDICATOR_LEFT, "◀", 18, AMBER),
    (Lamp.INDICATOR_RIGHT, "▶", 18, AMBER),
)
"""Lamp, label, width of its field [px] and colour when lit."""

_VISIBILITY_AXIS = Axis(20.0, 2000.0, (50.0, 100.0, 300.0, 1000.0), logarithmic=True)
_SPEED_AXIS = Axis(0.0, 160.0, (50.0, 100.0))


class FramePanel:
    """Draws frames one after another; it remembers the last minute for its charts, and the last collision."""

    def __init__(self, draw_picture: Callable[[Step], Image.Image] = draw_camera_picture) -> None:
        self._draw_picture = draw_picture
        self._visibility: StripChart | None = None
        self._speed = StripChart(
            (_RIGHT - _LEFT, 70), _SPEED_AXIS, (Curve(ADVICE, (1,)), Curve(TEXT, (0,))), "speed and advice [km/h]"
        )
        self._collision: tuple[float, Collision] | None = None
        self._reports: list[FogReport] = []
        self._background = _draw_background()

    def draw(self, step: Step, derived: Derived) -> NDArray[np.uint8]:
        """Draw the frame of a step, red first (480, 1024, 3) uint8."""
        frame = self._background.copy()
        picture = self._draw_picture(step)
        self._draw_banners(ImageDraw.Draw(picture), step)
        frame.paste(picture, (0, 0))
        draw = ImageDraw.Draw(frame)
        _draw_speeds(draw, step)
        _draw_visibilities(draw, step)
        _draw_lead(draw, step, derived["time_to_collision_s"])
        _draw_lamps(draw, Lamp(int(step.traffic.lamps[step.ego])))
        self._draw_charts(frame, step)
        return np.asarray(frame)

    def _draw_charts(self, frame: Image.Image, step: Step) -> None:
        low, middle, high = (step.belief.visibility_quantile(share) for share in (0.05, 0.5, 0.95))
        profile = step.belief.profile
        # Next to a chart of the road ahead there is room for half a chart of the last minute.
        left = _LEFT if profile is None else (_LEFT + _RIGHT) // 2
        if self._visibility is None:
            self._visibility = _visibility_chart(_RIGHT - left)
        self._visibility.add(step.time, (middle, low, high, step.truth.visibility_ahead))
        advised = step.command.advice.speed
        self._speed.add(step.time, (_kmh(_speed(step)), _kmh(advised) if math.isfinite(advised) else None))
        frame.paste(self._visibility.draw(), (left, 300))
        if profile is not None:
            size = (left - _LEFT - 8, _CHART_HEIGHT)
            ahead = _draw_profile(size, _VISIBILITY_AXIS, profile, step.truth.profile, self._reported(step))
            frame.paste(ahead, (_LEFT, 300))
        frame.paste(self._speed.draw(), (_LEFT, 398))

    def _reported(self, step: Step) -> list[tuple[float, float]]:
        """Distance ahead and visibility of the latest reports from others [m, m]."""
        self._reports = [one for one in (*self._reports, *step.observation.reports) if step.time - one.time <= _NEWS]
        return [(one.place - step.route_position, visibility_from_extinction(one.extinction)) for one in self._reports]

    def _draw_banners(self, draw: ImageDraw.ImageDraw, step: Step) -> None:
        if step.collisions:
            self._collision = step.time_of(step.collisions[-1]), step.collisions[-1]
        if self._collision is not None and step.time - self._collision[0] <= _BANNER_TIME:
            _, hit = self._collision
            own = step.traffic.ids[step.ego] in {hit.collider, hit.victim}
            text = f"COLLISION   {hit.collider} → {hit.victim}   {_kmh(hit.impact_speed):.0f} km/h"
            _draw_banner(draw, 0, text, ALARM if own else AMBER)
        elif step.command.warning is not None:
            _draw_banner(draw, 0, _warning_text(step, step.command.warning), AMBER)
        elif step.belief.denser is not None:
            _draw_banner(draw, 0, f"denser fog ahead: {step.belief.denser.distance:.0f} m", WELL)
        if step.ending is not None:
            _draw_banner(draw, FRAME_HEIGHT - 34, f"end of the run: {step.ending.value}", WELL)


def _visibility_chart(width: int) -> StripChart:
    curves = (Curve(BELIEF_BAND, (1, 2)), Curve(BELIEF, (0,)), Curve(TRUTH, (3,), dashed=True))
    return StripChart((width, _CHART_HEIGHT), _VISIBILITY_AXIS, curves, "visibility, last 60 s [m]")


def _warning_text(step: Step, warning: DriverWarning) -> str:
    text = f"WARNING   {warning.replace('_', ' ')}"
    if warning is DriverWarning.FOG_AHEAD and step.belief.denser is not None:
        return f"{text}: {step.belief.denser.distance:.0f} m"
    return text


def _kmh(speed: float) -> float:
    return speed * KMH_PER_MPS


def _speed(step: Step) -> float:
    return float(step.traffic.speed[step.ego])


def _metres(visibility: float) -> str:
    """Visibility as a driver would say it: clear beyond ten kilometres, three figures elsewhere."""
    if visibility >= 10_000:
        return "clear"
    return f"{visibility:.0f} m" if visibility < 1000 else f"{visibility / 1000:.1f} km"


def _draw_background() -> Image.Image:
    """Draw everything that never changes."""
    image = Image.new("RGB", (FRAME_WIDTH, FRAME_HEIGHT), GROUND)
    draw = ImageDraw.Draw(image)
    for x, label in ((_SPEED_X, "speed"), (_ADVICE_X, "advised")):
        draw.text((x, 46), label, fill=MUTED, font=font(11), anchor="ls")
    draw.text((_LIMIT_X, 46), "limit", fill=MUTED, font=font(11), anchor="ms")
    for y in (112, 232):
        draw.line([(_LEFT, y), (_RIGHT, y)], fill=LINE)
    draw.text((_LEFT, 130), "visibility", fill=MUTED, font=font(11), anchor="ls")
    draw.text((_RIGHT, 130), "90 % interval", fill=MUTED, font=font(11), anchor="rs")
    return image


def _draw_banner(draw: ImageDraw.ImageDraw, top: int, text: str, colour: Colour) -> None:
    draw.rectangle([(0, top), (camera_picture.WIDTH, top + 34)], fill=colour)
    written = GROUND if colour == AMBER else TEXT
    draw.text((camera_picture.WIDTH / 2, top + 17), text, fill=written, font=font(15, bold=True), anchor="mm")


def _draw_speeds(draw: ImageDraw.ImageDraw, step: Step) -> None:
    advised, speed = step.command.advice.speed, _speed(step)
    draw.text((_LEFT, 24), f"t = {step.time:.1f} s", fill=TEXT, font=font(13), anchor="ls")
    draw.text((_RIGHT, 24), f"{step.route_position / 1000:.2f} km", fill=MUTED, font=font(13), anchor="rs")
    too_fast = speed > advised + 1.0 / KMH_PER_MPS
    _draw_number(draw, _SPEED_X, f"{_kmh(speed):.0f}", AMBER if too_fast else TEXT)
    if math.isfinite(advised):
        _draw_number(draw, _ADVICE_X, f"{_kmh(advised):.0f}", ADVICE)
    else:
        draw.text((_ADVICE_X, 92), "none", fill=MUTED, font=font(26), anchor="ls")
    if math.isfinite(step.speed_limit):
        _draw_limit(draw, _kmh(step.speed_limit))


def _draw_number(draw: ImageDraw.ImageDraw, x: int, number: str, colour: Colour) -> None:
    large = font(44, bold=True)
    draw.text((x - 2, 92), number, fill=colour, font=large, anchor="ls")
    draw.text((x + large.getlength(number) + 4, 92), "km/h", fill=MUTED, font=font(11), anchor="ls")


def _draw_limit(draw: ImageDraw.ImageDraw, limit: float) -> None:
    draw.ellipse([(_LIMIT_X - 24, 53), (_LIMIT_X + 24, 101)], fill=ALARM)
    draw.ellipse([(_LIMIT_X - 19, 58), (_LIMIT_X + 19, 96)], fill=(240, 240, 236))
    draw.text((_LIMIT_X, 78), f"{limit:.0f}", fill=GROUND, font=font(17, bold=True), anchor="mm")


def _draw_visibilities(draw: ImageDraw.ImageDraw, step: Step) -> None:
    low, middle, high = (step.belief.visibility_quantile(share) for share in (0.05, 0.5, 0.95))
    _draw_visibility(draw, 150, "belief", BELIEF, (_metres(middle), f"{_metres(low)} – {_metres(high)}"), 15)
    y = 170
    shown = step.estimates if len(step.estimates) <= _MOST_METHODS else step.estimates[: _MOST_METHODS - 1]
    spacing = 17 if len(step.estimates) < _MOST_METHODS else 13
    colours = method_colours([estimate.method for estimate in step.estimates])
    for estimate in shown:
        _draw_visibility(draw, y, estimate.method, colours[estimate.method], _say_estimate(estimate), 12)
        y += spacing
    if len(shown) < len(step.estimates):
        draw.text((_LEFT, y), f"and {len(step.estimates) - len(shown)} more", fill=MUTED, font=font(11), anchor="ls")
    _draw_visibility(
        draw, 224, "truth ahead", TRUTH, (_metres(step.truth.visibility_ahead), "not seen by any method"), 12
    )


def _say_estimate(estimate: Estimate) -> tuple[str, str]:
    if not estimate.valid:
        return "—", "no estimate"
    low, high = estimate.visibility_interval
    return _metres(estimate.visibility), f"{_metres(low)} – {_metres(high)}"


def _draw_visibility(
    draw: ImageDraw.ImageDraw, y: int, label: str, colour: Colour, values: tuple[str, str], size: int
) -> None:
    draw.text((_LEFT, y), label, fill=colour, font=font(12), anchor="ls")
    draw.text((_LEFT + 196, y), values[0], fill=colour, font=font(size, bold=size > 12), anchor="rs")
    draw.text((_RIGHT, y), values[1], fill=MUTED, font=font(11), anchor="rs")


def _draw_lead(draw: ImageDraw.ImageDraw, step: Step, time_to_collision: float | None) -> None:
    if step.leader is None:
        draw.text((_LEFT, 254), "no vehicle ahead", fill=MUTED, font=font(13), anchor="ls")
        return
    gap = f"gap {step.leader.gap:.0f} m to a lead at {_kmh(step.leader.speed):.0f} km/h"
    draw.text((_LEFT, 254), gap, fill=TEXT, font=font(13), anchor="ls")
    if time_to_collision is not None and time_to_collision < 100:
        colour = ALARM if time_to_collision < 3 else TEXT
        draw.text((_RIGHT, 254), f"TTC {time_to_collision:.1f} s", fill=colour, font=font(13, bold=True), anchor="rs")


def _draw_lamps(draw: ImageDraw.ImageDraw, lit: Lamp) -> None:
    x = _LEFT
    for lamp, label, width, colour in _LAMPS:
        on = bool(lit & lamp)
        box = [(x, 268), (x + width, 286)]
        draw.rounded_rectangle(box, radius=4, fill=colour if on else None, outline=colour if on else LINE)
        draw.text((x + width / 2, 277), label, fill=GROUND if on else UNLIT, font=font(10, bold=True), anchor="mm")
        x += width + 4
