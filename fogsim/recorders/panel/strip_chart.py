"""A small chart of the last minute, drawn fast enough for every frame of a video."""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from PIL import Image, ImageDraw

from fogsim.recorders.style import GROUND, LINE, MUTED, WELL, Colour, font

_WINDOW = 60.0
"""Time that a chart shows [s]."""

_SPACING = 0.25
"""Least time between two points of a curve [s]: about one point in 1.5 pixels."""

_GUTTER = 30
"""Space for the numbers to the right of the curves [px]."""

TITLE = 16
"""Space for the title above the curves [px]."""

_OVERSAMPLING = 2
"""Curves are drawn this much larger and shrunk, since Pillow's own lines are jagged."""


@dataclass(frozen=True, slots=True)
class Axis:
    """The vertical axis of a chart."""

    # low, high: its ends; values beyond are drawn at them
    low: float
    high: float
    ticks: Sequence[float]  # Values with a line and a number
    logarithmic: bool = False  # True for equal ratios at equal distances

    def height(self, value: float) -> float:
        """Place of a value between the ends, 0 … 1."""
        value = min(max(value, self.low), self.high)
        if self.logarithmic:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)


@dataclass(frozen=True, slots=True)
class Curve:
    """One curve of a chart."""

    colour: Colour  # Its colour
    # One column of the chart's rows for a line, two (low, high) for a filled band
    columns: tuple[int] | tuple[int, int]
    dashed: bool = False  # True for a line that lets another show through


class StripChart:
    """Curves over the last minute; now is at the right edge (`size` [px])."""

    def __init__(self, size: tuple[int, int], axis: Axis, curves: Sequence[Curve], title: str) -> None:
        self._axis = axis
        self._curves = curves
        self._outer_size = size
        self._size = ((size[0] - _GUTTER) * _OVERSAMPLING, size[1] * _OVERSAMPLING)
        self._title = title
        self._background = self._draw_background()
        self._chart = self._draw_frame()
        self._rows: deque[tuple[float, tuple[float | None, ...]]] = deque()
        self._latest: tuple[float, tuple[float | None, ...]] | None = None
        self._gone = 0

    def _draw_background(self) -> Image.Image:
        image = Image.new("RGB", self._size, WELL)
        draw = ImageDraw.Draw(image)
        for tick in self._axis.ticks:
            y = self._y(tick)
            draw.line([(0, y), (self._size[0], y)], fill=LINE, width=_OVERSAMPLING)
        for quarter in (1, 2, 3):
            x = self._size[0] * quarter / 4
            draw.line([(x, 0), (x, self._size[1])], fill=LINE, width=1)
        return image

    def add(self, time: float, values: tuple[float | None, ...]) -> None:
        """Add a row of values at an instant [s]; None leaves a gap (`time` [s])."""
        self._latest = (time, values)
        if not self._rows or time - self._rows[-1][0] >= _SPACING - 1e-9:
            self._rows.append(self._latest)
        while self._rows and self._rows[0][0] < time - _WINDOW - 2 * _SPACING:
            self._rows.popleft()
            self._gone += 1

    def draw(self) -> Image.Image:
        """Draw the chart as it is now."""
        image = self._background.copy()
        draw = ImageDraw.Draw(image)
        for curve in self._curves:
            for points in self._stretches(curve.columns):
                self._draw_stretch(draw, curve, points)
        self._chart.paste(image.reduce(_OVERSAMPLING), (0, 0))
        ImageDraw.Draw(self._chart).text((5, 4), self._title, fill=MUTED, font=font(10), anchor="lt")
        return self._chart

    def _stretches(self, columns: Sequence[int]) -> list[list[tuple[float, ...]]]:
        """Points (x, y, …) of the curve, parted where a value is missing."""
        rows = [*self._rows]
        if self._latest is not None and rows[-1] is not self._latest:
            rows.append(self._latest)
        stretches: list[list[tuple[float, ...]]] = [[]]
        for time, values in rows:
            chosen = [values[column] for column in columns]
            present = [value for value in chosen if value is not None]
            if len(present) == len(chosen):
                stretches[-1].append((self._x(time), *map(self._y, present)))
            elif stretches[-1]:
                stretches.append([])
        return [stretch for stretch in stretches if len(stretch) > 1]

    def _draw_stretch(self, draw: ImageDraw.ImageDraw, curve: Curve, points: list[tuple[float, ...]]) -> None:
        lower = [(point[0], point[1]) for point in points]
        if curve.dashed:
            # The dashes move with the curve: the count of the points that have left says where one begins.
            for start in range(-(self._gone % 6), len(lower) - 1, 6):
                draw.line(lower[max(start, 0) : start + 4], fill=curve.colour, width=4)
        elif len(curve.columns) == 1:
            draw.line(lower, fill=curve.colour, width=4)
        else:
            draw.polygon(lower + [(point[0], point[-1]) for point in reversed(points)], fill=curve.colour)

    def _draw_frame(self) -> Image.Image:
        frame = Image.new("RGB", self._outer_size, GROUND)
        draw = ImageDraw.Draw(frame)
        for tick in self._axis.ticks:
            place = (self._outer_size[0] - 1, self._y(tick) / _OVERSAMPLING)
            draw.text(place, f"{tick:g}", fill=MUTED, font=font(9), anchor="rm")
        return frame

    def _x(self, time: float) -> float:
        now = time if self._latest is None else self._latest[0]
        return self._size[0] * (1.0 - (now - time) / _WINDOW)

    def _y(self, value: float) -> float:
        margin, title = 3 * _OVERSAMPLING, TITLE * _OVERSAMPLING
        return self._size[1] - margin - self._axis.height(value) * (self._size[1] - margin - title)
